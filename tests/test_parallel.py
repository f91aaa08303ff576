"""Two ranks give what one gives; run by `mpirun -n 2 python -m pytest -m mpi`."""

from __future__ import annotations

import numpy as np
import pytest
from mpi4py import MPI

from ramiefenics import BendingTest, override, simulate


@pytest.mark.mpi
def test_ranks_agree(coarse: BendingTest) -> None:
    test = override(coarse, ["numerics.stepping.relative_tolerance=1e-9"])
    alone, together = simulate(test, MPI.COMM_SELF), simulate(test, MPI.COMM_WORLD)
    assert together.statistics.dofs == alone.statistics.dofs
    for column in (
        "force_N",
        "support_force_N",
        "section_height_mm",
        "void_height_mm",
        "stored_energy_Nmm",
        "friction_work_Nmm",
        "indenter_contact_width_mm",
    ):
        one, two = alone.curve[column].to_numpy(), together.curve[column].to_numpy()
        assert np.abs(one - two).max() <= 1e-7 * np.abs(one).max(), column


@pytest.mark.mpi
def test_snapshot_is_whole_on_the_first_rank(coarse: BendingTest) -> None:
    alone, together = simulate(coarse, MPI.COMM_SELF), simulate(coarse, MPI.COMM_WORLD)
    if MPI.COMM_WORLD.rank:
        assert not together.snapshots
        return
    one, two = alone.snapshots[-1], together.snapshots[-1]
    assert len(one.cells) == len(two.cells)
    for name in ("von_mises", "axial_stress", "min_volume_ratio"):
        assert np.sort(two.cell_data[name]) == pytest.approx(
            np.sort(one.cell_data[name]), rel=1e-4, abs=1e-4
        )
    # the search for it ranks the points of each rank, so other cells may differ
    least = one.cell_data["min_acoustic_MPa"].min()
    assert two.cell_data["min_acoustic_MPa"].min() == pytest.approx(least, rel=1e-4)
    middle = two.points[two.cells].mean(axis=1)
    assert {tuple(m) for m in middle.round(6)} == {
        tuple(m) for m in one.points[one.cells].mean(axis=1).round(6)
    }

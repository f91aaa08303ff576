"""Two ranks give the results of one; most tests run by `mpirun -n 2 python -m pytest -m mpi`."""

from __future__ import annotations

import itertools
import subprocess
import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from mpi4py import MPI

from ramiefenics import BendingTest, override, simulate, write_test
from ramiefenics.model.snapshot import Grid
from ramiefenics.model.tube import build_tube
from ramiefenics.runs import SharedRuns


def middles(grid: Grid) -> tuple[np.ndarray, np.ndarray]:
    """Return the sorted midpoints of the cells, and the order that sorts them."""
    at = grid.points[grid.cells].mean(axis=1).round(6)
    order = np.lexsort(at.T)
    return at[order], order


@pytest.mark.mpi
def test_each_rank_has_a_slice_of_the_stalk(coarse: BendingTest) -> None:
    """The slices are always the same, because kept solutions are indexed by unknown."""
    comm = MPI.COMM_WORLD
    meshes = [build_tube(coarse, comm).mesh for _ in range(2)]
    first, second = (mesh.geometry.x for mesh in meshes)
    assert np.array_equal(first, second)
    own = comm.allgather((first[:, 2].min(), first[:, 2].max(), len(first)))
    for (_, end, _), (start, _, _) in itertools.pairwise(own):
        thickest = np.diff(np.unique(first[:, 2].round(6))).max()
        assert abs(end - start) <= thickest  # they may share a layer of elements
    numbers = [number for *_, number in own]
    assert max(numbers) < 1.1 * min(numbers)


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
@pytest.mark.parametrize(
    "changes",
    [
        ["fixture.inner_span_mm=40"],
        ["stalk.section_height_mm=13", "stalk.rotation_deg=30", "numerics.domain=full"],
    ],
    ids=["four_point", "turned"],
)
def test_ranks_agree_in_other_fixtures(coarse: BendingTest, changes: list[str]) -> None:
    short = ["protocol.travel_mm=0.5", "numerics.stepping.relative_tolerance=1e-9"]
    test = override(coarse, [*short, *changes])
    alone, together = simulate(test, MPI.COMM_SELF), simulate(test, MPI.COMM_WORLD)
    for column in ("force_N", "support_force_N"):
        one, two = alone.curve[column].to_numpy(), together.curve[column].to_numpy()
        assert np.abs(one - two).max() <= 1e-7 * np.abs(one).max(), column


@pytest.mark.mpi
def test_snapshot_is_whole_on_the_first_rank(coarse: BendingTest) -> None:
    alone, together = simulate(coarse, MPI.COMM_SELF), simulate(coarse, MPI.COMM_WORLD)
    if MPI.COMM_WORLD.rank:
        assert not together.snapshots
        return
    one, two = alone.snapshots[-1].body, together.snapshots[-1].body
    assert len(one.cells) == len(two.cells)
    for name in ("von_mises_MPa", "axial_stress_MPa", "min_volume_ratio"):
        assert np.sort(two.cell_data[name]) == pytest.approx(
            np.sort(one.cell_data[name]), rel=1e-4, abs=1e-4
        )
    # the search ranks the points on each MPI rank, so only the least value must agree
    least = one.cell_data["min_acoustic_MPa"].min()
    assert two.cell_data["min_acoustic_MPa"].min() == pytest.approx(least, rel=1e-4)
    assert np.array_equal(middles(one)[0], middles(two)[0])


@pytest.mark.mpi
@pytest.mark.parametrize("order", [1, 2])
def test_contact_is_whole_on_the_first_rank(coarse: BendingTest, order: int) -> None:
    """It has each facet once, with the values found on one rank."""
    test = override(
        coarse,
        [
            f"numerics.mesh.order={order}",
            "protocol.travel_mm=0.5",
            "numerics.stepping.relative_tolerance=1e-9",
        ],
    )
    alone, together = simulate(test, MPI.COMM_SELF), simulate(test, MPI.COMM_WORLD)
    if MPI.COMM_WORLD.rank:
        assert not together.snapshots
        return
    one, two = alone.snapshots[-1].contact, together.snapshots[-1].contact
    (at, first), (also_at, second) = middles(one), middles(two)
    assert np.array_equal(at, also_at)
    assert np.any(one.cell_data["contact_state"])
    for name, expected in one.cell_data.items():
        # rounding differs, amplified by solving to a relative tolerance of 1e-9
        size = np.abs(expected).max()
        assert two.cell_data[name][second] == pytest.approx(expected[first], abs=1e-6 * size), name


@pytest.mark.mpi
@pytest.mark.filterwarnings("ignore:some results kept")
def test_ranks_compute_together_what_is_damaged(coarse: BendingTest, tmp_path: Path) -> None:
    test = override(coarse, ["protocol.travel_mm=0.5"])
    folder = MPI.COMM_WORLD.bcast(tmp_path)
    runs = SharedRuns(MPI.COMM_WORLD, folder)
    first = runs.run(test)
    assert runs.has(test)
    assert runs.run(test).cpu_s == first.cpu_s
    MPI.COMM_WORLD.barrier()  # after all ranks have read it
    if MPI.COMM_WORLD.rank == 0:
        (file,) = folder.iterdir()
        file.write_bytes(file.read_bytes()[:-1])
    assert not runs.has(test)
    again = runs.run(test).result.curve["force_N"].to_numpy()
    assert again == pytest.approx(first.result.curve["force_N"].to_numpy(), rel=1e-9)


def run(ranks: int, *arguments: str | Path) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "ramiefenics", *map(str, arguments)]
    start = ["mpirun", "-n", str(ranks)] if ranks > 1 else []
    done = subprocess.run([*start, *command], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return done


@pytest.mark.slow
@pytest.mark.parametrize(("tolerance", "allowed"), [(1e-5, 1e-5), (1e-9, 1e-9)])
def test_command_on_two_ranks_is_that_on_one(
    coarse: BendingTest, tmp_path: Path, tolerance: float, allowed: float
) -> None:
    """The linear equations are solved more tightly too, as their tolerance follows Newton's."""
    test = override(coarse, [f"numerics.stepping.relative_tolerance={tolerance}"])
    write_test(test, tmp_path / "test.toml")
    said = {
        ranks: run(ranks, "bend", tmp_path / "test.toml", "--out", tmp_path / str(ranks))
        for ranks in (1, 2)
    }
    one, two = (pd.read_csv(tmp_path / str(ranks) / "curve.csv") for ranks in (1, 2))
    assert len(one) == len(two)
    assert np.abs(one["force_N"] - two["force_N"]).max() <= allowed * one["force_N"].max()
    files = [sorted(p.name for p in (tmp_path / str(ranks)).rglob("*")) for ranks in (1, 2)]
    assert files[0] == files[1]
    assert said[2].stdout.count("unknowns") == said[1].stdout.count("unknowns") == 1


def test_only_the_first_rank_writes_where_all_do_the_same(tmp_path: Path) -> None:
    travel = np.linspace(0.0, 5.0, 60)
    np.savetxt(tmp_path / "stalk.csv", np.column_stack([travel, 10.0 * travel]), delimiter=",")
    raw, out = tmp_path / "stalk.csv", tmp_path / "data"
    done = run(2, "import", raw, "--format", "columns", "--baseline", "table3", "--out", out)
    assert done.stdout.count("1 curves in") == 1
    assert (out / "curves" / "stalk.csv").exists()

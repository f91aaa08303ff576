"""Several tests of one stalk, whose material remembers the earlier ones."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from mpi4py import MPI

import ramiefenics as rf
from ramiefenics import BendingTest, override, simulate
from ramiefenics.model.bending import BendingProblem

BACK = "protocol.then=[{to_mm=0}]"


@pytest.fixture(scope="module")
def there_and_back(coarse: BendingTest) -> BendingTest:
    return override(coarse, ["numerics.acoustic_check=false", "protocol.travel_mm=1.5", BACK])


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        (["further=[{}]"], "protocol.then = 3.0 must be 0 at the end of the path"),
        ([BACK, "further=[{}, {protocol={then=[]}}, {}]"], "further.1.protocol.then = 3.0 must be"),
        ([BACK, "further=[{law='x'}]"], "further.0.law = 'x' must be one of fixture"),
        ([BACK, "further=[{stalk={taper=0}}]"], "further.0.stalk = .* must be that of the first"),
        ([BACK, "further=[{fixture={spam_mm=7}}]"], "further.0.fixture.spam_mm = 7 is an unknown"),
        ([BACK, "further=[{fixture={span_mm=500}}]"], "further.0.fixture.span_mm = 500.0 must be"),
        ([BACK, "further=[{stalk={rotation_deg=90}}]"], "further.0.numerics.domain = 'quarter'"),
        (["further=1"], r"further = 1 must be a list of tables, \[\[further\]\]"),
    ],
)
def test_what_cannot_follow_is_refused(coarse: BendingTest, changes, message: str) -> None:
    with pytest.raises(rf.SpecificationError, match=message):
        override(coarse, changes)


def test_an_elastic_stalk_bends_again_as_at_first(there_and_back: BendingTest) -> None:
    """On another span too it bends as in a first test, on a mesh that serves both spans."""
    tight = override(there_and_back, ["numerics.stepping.relative_tolerance=1e-8"])
    test = override(tight, ["further=[{fixture={span_mm=80}}, {protocol={then=[]}}]"])
    result = simulate(test, MPI.COMM_SELF)
    assert result.completed
    near, again = result.further
    assert [one.test.fixture.span_mm for one in (result, near, again)] == [100.0, 80.0, 100.0]
    for column in ("displacement_mm", "force_N", "stored_energy_Nmm"):
        first = result.loading[column].to_numpy()
        assert again.curve[column].to_numpy() == pytest.approx(first, abs=1e-6 * first.max())
    other_way = override(tight, ["fixture.span_mm=80", "further=[{fixture={span_mm=100}}]"])
    first = simulate(other_way, MPI.COMM_SELF).curve["force_N"].to_numpy()
    assert near.curve["force_N"].to_numpy() == pytest.approx(first, abs=1e-6 * first.max())


def test_a_second_test_goes_on_from_what_the_first_has_left(
    there_and_back: BendingTest, tmp_path: Path
) -> None:
    """Compared with reloading in the same run: the path is the same, except for its start."""
    yielding = override(there_and_back, ["law=fibre_plasticity", "protocol.travel_mm=4"])
    further = "further=[{protocol={travel_mm=4.5, then=[]}}]"
    result = simulate(override(yielding, [further]), MPI.COMM_SELF)
    again = simulate(
        override(yielding, ["protocol.then=[{to_mm=0}, {to_mm=4.5}]"]), MPI.COMM_SELF
    ).curve
    reloading = again.iloc[len(result.curve) - 1 :]
    (second,) = result.further
    assert second.curve["dissipated_Nmm"].iloc[0] == result.curve["dissipated_Nmm"].iloc[-1] > 0.0
    # how far the indenter moves before it touches the bent stalk
    x, force = (reloading[name].to_numpy() for name in ("displacement_mm", "force_N"))
    later = second.curve[["displacement_mm", "force_N"]].to_numpy()[1:]
    gaps = np.interp(later[2:6, 1], force, x) - later[2:6, 0]
    assert gaps.mean() > 0.1
    # the state of friction is lost between tests: its share of the force is about one per cent
    assert np.ptp(gaps) < 0.05 * gaps.mean() + 0.02
    rf.write_folder(result, tmp_path / "found")
    read = rf.read_folder(tmp_path / "found")
    assert isinstance(read, rf.BendingResult)
    assert read.test == result.test
    assert read.further[0].curve["force_N"].to_numpy() == pytest.approx(
        second.curve["force_N"].to_numpy(), rel=1e-6
    )
    assert "Test 2: " in repr(read)
    assert {"curve_2.csv", "curves.png", "test_2"} <= {
        path.name for path in (tmp_path / "found").iterdir()
    }


@pytest.mark.parametrize("law", ["crushing", "viscoelasticity"])
def test_what_is_remembered_turns_with_the_stalk(there_and_back: BendingTest, law: str) -> None:
    """Turned and deformed as before, it has the same stored and dissipated energy."""
    test = override(there_and_back, ["numerics.domain=full", f"law={law}"])
    turned = override(test, ["stalk.rotation_deg=30"])
    before, after = (BendingProblem(one, MPI.COMM_SELF) for one in (test, turned))
    # crushed obliquely, then partly unloaded: no axis of the memory is an axis of the mesh
    crush = np.array([[-0.12, 0.05, 0.0], [0.02, -0.2, 0.01], [0.0, 0.0, 0.01]])
    angle = np.radians(30.0)
    turn = np.eye(3)
    turn[:2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
    before.displacement.interpolate(lambda x: crush @ x)
    before.solid.duration.value = 2.0
    before.remember()
    before.displacement.interpolate(lambda x: 0.3 * crush @ x)
    before.remember()
    after.take_over(before)
    after.displacement.interpolate(lambda x: turn @ (0.5 * crush) @ turn.T @ x)
    before.displacement.interpolate(lambda x: 0.5 * crush @ x)
    for problem in (before, after):
        problem.solid.duration.value = 3.0
    assert min(before.energies()) > 0.0
    assert after.energies() == pytest.approx(before.energies(), rel=1e-9)
    unturned = BendingProblem(test, MPI.COMM_SELF)  # shows that the comparison can fail
    unturned.take_over(before)
    unturned.displacement.interpolate(lambda x: turn @ (0.5 * crush) @ turn.T @ x)
    unturned.solid.duration.value = 3.0
    assert unturned.energies() != pytest.approx(before.energies(), rel=1e-3)


@pytest.mark.mpi
def test_ranks_agree_on_a_second_test(there_and_back: BendingTest) -> None:
    test = override(
        there_and_back,
        [
            "law=fibre_plasticity",
            "numerics.stepping.relative_tolerance=1e-9",
            "further=[{fixture={span_mm=80}, protocol={then=[]}}]",
        ],
    )
    alone, together = (simulate(test, comm) for comm in (MPI.COMM_SELF, MPI.COMM_WORLD))
    one, two = (result.further[0].curve["force_N"].to_numpy() for result in (alone, together))
    assert np.abs(one - two).max() <= 1e-7 * one.max()

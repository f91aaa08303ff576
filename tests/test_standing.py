"""Stalks that represent others in simulations, and transfer of their changes, in closed form."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import pandas as pd
import pytest

import ramiefenics as rf
from ramiefenics.discovery.curves.changed_curves import Carried, following
from ramiefenics.discovery.curves.standing import Place, Standing, change_of
from ramiefenics.discovery.curves.stepping import Stepping
from ramiefenics.runs.curve import normalised
from ramiefenics.surrogate.coordinates import Direction

OUTER = "stalk.layers.phloem.outer_diameter_mm"


@pytest.fixture
def stalks(screening: rf.BendingTest) -> list[rf.BendingTest]:
    """Three stalks of nearly the same size, the middle one last, and one on a shorter span."""
    near = [rf.override(screening, [f"{OUTER}={mm}"]) for mm in (14.0, 14.6, 14.3)]
    return [*near, rf.override(screening, ["fixture.span_mm=70"])]


def standing(stalks: list[rf.BendingTest], changed: list[rf.BendingTest]) -> Standing:
    return Standing.of([Place.of(test) for test in stalks], [Place.of(test) for test in changed])


@pytest.mark.parametrize(
    "change",
    ["fixture.friction.static=0.9", "numerics.mesh=standard", "law=neo_hookean"],
    ids=["a number", "the mesh", "the law"],
)
def test_one_in_the_middle_stands_for_those_near(stalks: list[rf.BendingTest], change: str) -> None:
    found = standing(stalks, [rf.override(test, [change]) for test in stalks])
    assert found.by.tolist() == [2, 2, 2, 3]
    assert found.size == pytest.approx(1.0)
    assert sorted(found.chosen) == [2, 3]


def test_a_larger_change_is_carried_over_in_proportion(stalks: list[rf.BendingTest]) -> None:
    frictions = [0.59 + change for change in (0.1, 0.15, 0.1, 0.1)]
    changed = [
        rf.override(test, [f"fixture.friction.static={friction}"])
        for test, friction in zip(stalks, frictions, strict=True)
    ]
    found = standing(stalks, changed)
    assert found.by.tolist() == [2, 2, 2, 3]
    assert found.size == pytest.approx([1.0, 1.5, 1.0, 1.0])


def test_changes_of_another_kind_are_simulated(stalks: list[rf.BendingTest]) -> None:
    """Such changes come from effects that depend on where a specimen comes from."""
    changes = (
        "fixture.friction.static=0.7",
        f"{OUTER}=14.7",
        "fixture.span_mm=99",
        "law=neo_hookean",
    )
    found = standing(
        stalks, [rf.override(test, [c]) for test, c in zip(stalks, changes, strict=True)]
    )
    assert found.by.tolist() == [0, 1, 2, 3]


def test_what_needs_no_simulation_is_not_carried_over(stalks: list[rf.BendingTest]) -> None:
    """This applies to a common factor on the moduli, and to errors of the machine."""
    stiffer = [
        rf.override(test, ["stalk.stiffness_gradient_per_m=0.2", f"stalk.position_mm={mm}"])
        for test, mm in zip(stalks, (100.0, 200.0, 300.0, 400.0), strict=True)
    ]
    gapped = [rf.override(test, ["machine.seating_gap_mm=0.3"]) for test in stalks]
    for changed in (stiffer, gapped):
        assert standing(stalks, changed).by.tolist() == [0, 1, 2, 3]


def test_a_curve_without_force_is_refused() -> None:
    nothing = pd.DataFrame({"displacement_mm": [0.0, 1.0, 2.0], "force_N": 0.0})
    with pytest.raises(rf.SpecificationError, match=r"force_N = 0\.0 must be above 0"):
        change_of(nothing, nothing)


def beam(test: rf.BendingTest, directions: Sequence[Direction] = ()) -> pd.DataFrame:
    """Return a degressive curve that depends on diameter, span and friction, with derivatives."""
    x = np.linspace(0.0, 14.0, 29)

    def force(test: rf.BendingTest) -> np.ndarray:
        diameter = test.stalk.measured_at_midspan().outer_diameter_mm
        size = diameter**4 / test.fixture.span_mm**3 * test.stalk.stiffness_factor
        friction = test.fixture.friction.static * (diameter / 14.3) ** 3
        return np.asarray(size * x / (1.0 + 0.05 * x) * (1.0 + 0.2 * friction * x / 14.0))

    found = pd.DataFrame({"displacement_mm": x, "force_N": force(test), "by": 0.5 * force(test)})
    normal, _ = normalised(test)  # as for simulations
    for one in directions:
        up, down = (force(one.apply(normal, step))[1:] for step in (1e-4, -1e-4))
        found[one.name] = force(test) * np.append(0.0, np.log(up / down) / 2e-4)
    return found


def changed_curves(
    curves: Sequence[pd.DataFrame],
    before: Sequence[rf.BendingTest],
    after: Sequence[rf.BendingTest],
    simulate: Callable[[rf.BendingTest, Sequence[Direction]], pd.DataFrame],
) -> list[pd.DataFrame]:
    carried = Carried.of(before, after)
    return carried.changed(
        curves,
        {
            i: (simulate(before[i], of.before.directions), simulate(after[i], of.after.directions))
            for i, of in carried.represented.items()
        },
    )


@pytest.mark.parametrize(
    ("differentiated", "error"),
    [(True, 4e-4), (False, 6e-3)],  # of second and of first order in 0.02, the half range
)
def test_few_simulations_tell_what_effects_make_of_all_curves(
    stalks: list[rf.BendingTest], differentiated: bool, error: float
) -> None:
    changed = [rf.override(test, ["fixture.friction.static=0.9"]) for test in stalks]
    simulated: list[rf.BendingTest] = []

    def simulate(test: rf.BendingTest, directions: Sequence[Direction]) -> pd.DataFrame:
        simulated.append(test)
        return beam(test, directions if differentiated else ())

    found = changed_curves([beam(test) for test in stalks], stalks, changed, simulate)
    assert simulated == [stalks[2], changed[2], stalks[3], changed[3]]
    off = [
        np.abs(curve["force_N"] / beam(test)["force_N"] - 1.0).max()
        for curve, test in zip(found, changed, strict=True)
    ]
    assert off[2:] == pytest.approx([0.0, 0.0], abs=1e-9)  # these are simulated
    assert error / 10.0 < max(off) < error


def test_derivatives_change_as_those_of_the_representative(
    stalks: list[rf.BendingTest],
) -> None:
    changed = [rf.override(test, ["fixture.friction.static=0.9"]) for test in stalks]
    slopes = {id(test): 0.5 for test in stalks} | {id(test): 0.8 for test in changed}

    def simulate(test: rf.BendingTest, directions: Sequence[Direction]) -> pd.DataFrame:
        curve = beam(test, directions)
        return curve.assign(by=slopes[id(test)] * curve["force_N"])

    found = changed_curves([beam(test) for test in stalks], stalks, changed, simulate)
    for curve in found:
        assert curve["by"].to_numpy() == pytest.approx(0.8 * curve["force_N"].to_numpy())


def test_moduli_in_proportion_and_the_machine_need_no_simulation(
    stalks: list[rf.BendingTest],
) -> None:
    changes = [
        "stalk.stiffness_gradient_per_m=0.5",
        "stalk.position_mm=400",
        "machine.seating_gap_mm=1",
    ]
    changed = [rf.override(test, changes) for test in stalks]
    found = changed_curves(
        [beam(test) for test in stalks], stalks, changed, lambda *_: pytest.fail("simulated")
    )
    for curve, test in zip(found, stalks, strict=True):
        assert curve["force_N"].to_numpy() == pytest.approx(1.2 * beam(test)["force_N"].to_numpy())


def test_factors_on_the_moduli_of_each_stalk_are_not_carried_over(
    stalks: list[rf.BendingTest],
) -> None:
    """The stalks come from places of their own, and the indenter is off centre besides."""
    off = ["fixture.indenter_offset_mm=7", "numerics.domain=half", "fixture.friction.static=0.9"]
    changed = [
        rf.override(test, [*off, "stalk.stiffness_gradient_per_m=0.5", f"stalk.position_mm={mm}"])
        for test, mm in zip(stalks, (-400.0, 300.0, 100.0, 0.0), strict=True)
    ]
    carried = Carried.of(stalks, changed)
    assert sorted(carried.represented) == [2, 3]
    found = changed_curves([beam(test) for test in stalks], stalks, changed, beam)
    for curve, test in zip(found, changed, strict=True):
        # of second order in 0.02, the half range of the diameters
        assert curve["force_N"].to_numpy() == pytest.approx(beam(test)["force_N"], rel=4e-4)


def test_a_changed_stalk_that_does_not_reach_the_end_is_refused(
    stalks: list[rf.BendingTest],
) -> None:
    changed = [rf.override(test, ["fixture.friction.static=0.9"]) for test in stalks]
    with pytest.raises(rf.SpecificationError, match=r"the simulation ends at 9\.50 mm"):
        changed_curves(
            [beam(test) for test in stalks],
            stalks,
            changed,
            lambda test, along: beam(test, along).iloc[: 20 if test in changed else None],
        )


def test_changes_by_which_specimens_differ_are_not_carried_over(
    stalks: list[rf.BendingTest],
) -> None:
    """With a taper, diameters measured off midspan differ from those at midspan."""
    xylem, void = "stalk.layers.xylem.outer_diameter_mm", "stalk.void_diameter_mm"
    measured = [
        rf.override(test, [f"stalk.measured_at_mm={z}", f"{xylem}={d}", f"{void}={d - 5.5}"])
        for test, z, d in zip(stalks, (-90, 90, -90, 60), (12.7, 13.1, 12.9, 13.0), strict=True)
    ]
    tapered = [rf.EFFECTS["taper"].apply(test, 0.005) for test in measured]
    between = following(measured, tapered)
    diameters = [test.stalk.outer_diameter_mm for test in between]
    assert diameters == pytest.approx([14.0 - 0.45, 14.6 + 0.45, 14.3 - 0.45, 14.23 + 0.3])
    assert {test.stalk.taper for test in between} == {0.0}
    stepping = Stepping.of(measured, measured, tapered)
    tapers = [test for test, _ in stepping.simulated if test.stalk.taper != 0.0]
    assert len(tapers) == 2  # one for three, and that of the other span
    simulated = [beam(*one) for one in stepping.simulated]
    found = stepping.stepped([beam(test) for test in measured], simulated)
    for curve, test in zip(found, tapered, strict=True):  # exact: the formula has no taper
        assert curve["force_N"].to_numpy() == pytest.approx(beam(test)["force_N"].to_numpy())


def test_places_to_either_side_are_different(stalks: list[rf.BendingTest]) -> None:
    """The void is off the axis, towards the indenter or the supports."""
    places = [
        Place.of(rf.override(stalks[0], [f"stalk.void_offset_mm={mm}"])) for mm in (-0.4, -0.2, 0.2)
    ]
    assert not any(places[i].is_at(places[j]) for i, j in ((0, 1), (1, 2), (0, 2)))

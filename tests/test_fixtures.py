"""Fixtures other than three-point bending, against theories of beams and a ring."""

from __future__ import annotations

import json
import math

import numpy as np
import pandas as pd
import pytest
from mpi4py import MPI

import ramiefenics as rf
from ramiefenics.model.grading import axial_positions

YOUNG, POISSON, SPAN, DIAMETER = 300.0, 0.3, 200.0, 8.0
SECOND_MM4 = np.pi / 64 * DIAMETER**4
SHEAR = YOUNG / 2 / (1 + POISSON)
SHEAR_N = SHEAR * np.pi / 4 * DIAMETER**2 * 6 * (1 + POISSON) / (7 + 6 * POISSON)  # Cowper 1966


def rod(*changes: str, width: float = DIAMETER, friction: float = 0.0) -> rf.BendingTest:
    """Return a slender isotropic rod; it needs friction if nothing else holds it along Z."""
    material = rf.Material(rf.Elastic.isotropic(YOUNG, POISSON))
    stalk = rf.Stalk(240.0, 0.0, (rf.Layer("core", width, material),))
    fixture = rf.Fixture(span_mm=SPAN, friction=rf.Friction(friction, friction))
    settings = (
        "numerics.mesh=ladder_q2_1",
        "numerics.mesh.contact_size=0.04",
        "numerics.acoustic_check=false",
        "protocol.travel_mm=2",
        "protocol.save_every_mm=2",
    )
    return rf.override(rf.BendingTest(stalk, fixture, law="isotropic"), [*settings, *changes])


def end(result: rf.BendingResult, column: str = "force_N") -> float:
    assert result.completed, result.ending.reason
    return float(result.curve[column].iloc[-1])


def test_cylinders_say_where_everything_is() -> None:
    found = rf.Fixture(inner_span_mm=40.0, other_support_radius_mm=7.0).cylinders
    assert [(c.moves, c.side, c.z_mm, c.radius_mm) for c in found] == [
        (True, "above", 20.0, 5.0),
        (True, "above", -20.0, 5.0),
        (False, "below", 50.0, 5.0),
        (False, "below", -50.0, 7.0),
    ]
    assert len({c.name for c in found}) == 4
    assert [c.z_mm for c in rf.Fixture(indenter_offset_mm=-10.0).cylinders] == [-10.0, 50.0, -50.0]
    plates = rf.Fixture(0.0, math.inf, math.inf).cylinders
    assert [(c.moves, c.flat, c.z_mm) for c in plates] == [(True, True, 0.0), (False, True, 0.0)]


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        (["inner_span_mm=85"], "span_mm = 100.0 must be above 105 mm, or the indenter cannot"),
        (["inner_span_mm=9"], "inner_span_mm = 9.0 must be above 10 mm, or 0"),
        (["indenter_offset_mm=-41"], "span_mm = 100.0 must be above 102 mm"),
        (["support_radius_mm=inf"], "support_radius_mm = inf must be finite unless span_mm = 0"),
        (["span_mm=0", "indenter_offset_mm=1"], "indenter_offset_mm = 1.0 must be left out if"),
        (["indenter_offset_mm=5"], "domain = 'quarter' must be half or full for a fixture that"),
        (["other_support_radius_mm=4"], "domain = 'quarter' must be half or full"),
    ],
)
def test_impossible_fixtures_get_one_sentence(changes: list[str], sentence: str) -> None:
    with pytest.raises(rf.SpecificationError, match=sentence):
        rf.override(rf.published_test("table3"), [f"fixture.{change}" for change in changes])


NOSE = ("nose", "above", True, 0.0, 5.0)
SUPPORTS = (("right", "below", False, 50.0, 5.0), ("left", "below", False, -50.0, 5.0))


def stated(
    *cylinders: tuple[str, str, bool, float, float], friction: float | None = None
) -> list[str]:
    """Return the change that states a fixture's cylinders one by one, as in TOML."""
    names = ("name", "side", "moves", "z_mm", "radius_mm")
    tables = ", ".join(
        "{" + ", ".join(f"{n} = {json.dumps(v)}" for n, v in zip(names, c, strict=True)) + "}"
        for c in cylinders
    )
    rub = "" if friction is None else f", friction = {{static = {friction}, dynamic = {friction}}}"
    return [f"fixture={{cylinders = [{tables.replace('Infinity', 'inf')}]{rub}}}"]


def test_stated_cylinders_bend_as_those_of_the_named_fixture(coarse: rf.BendingTest) -> None:
    short = rf.override(coarse, ["protocol.travel_mm=0.5", "numerics.acoustic_check=false"])
    same = rf.override(short, stated(NOSE, *reversed(SUPPORTS)))
    assert same.fixture.beam_mm == short.fixture.beam_mm == (100.0, 0.0)
    curves = [rf.simulate(test, MPI.COMM_SELF).curve for test in (short, same)]
    pd.testing.assert_frame_equal(*curves, check_exact=True)
    moved = rf.override(same, ["fixture.cylinders.nose.radius_mm=4"])
    assert [c.radius_mm for c in moved.fixture.cylinders] == [4.0, 5.0, 5.0]


@pytest.mark.parametrize(
    ("cylinders", "sentence"),
    [
        (SUPPORTS, r"cylinders = \['right', 'left'\] must include a moving cyl"),
        ([NOSE], "must hold the stalk: the ranges of Z above and below it must overlap"),
        ([("nose", "above", True, 60.0, 5.0), *SUPPORTS], "must hold the stalk"),
        ([("nose", "below", True, 0.0, 5.0), *SUPPORTS], "nose.side = 'below' must be 'above' for"),
        ([("nose", "beside", True, 0.0, 5.0), *SUPPORTS], "nose.side = 'beside' must be one of"),
        ([("a nose", "above", True, 0.0, 5.0)], "name = 'a nose' must be one word"),
        ([("nose", "above", True, 0.0, 0.0)], "nose.radius_mm = 0.0 must be a number above 0 mm"),
        ([NOSE, NOSE, *SUPPORTS], "cylinders = 'nose' must not name a cylinder twice"),
        (
            [NOSE, ("next", "above", False, 8.5, 4.0), *SUPPORTS],
            "next.z_mm = 8.5 must be more than 8.94427 mm from nose, or they overlap",
        ),
        (
            [NOSE, ("near", "below", False, 9.0, 5.0), *SUPPORTS],
            "near.z_mm = 9.0 must be more than 10 mm from nose, or directly opposite",
        ),
        (
            [NOSE, ("plate", "below", False, 0.0, math.inf), *SUPPORTS],
            "right.side = 'below' must be on the opposite side of the stalk from the plate plate",
        ),
        ([NOSE, SUPPORTS[0], ("left", "below", False, -95.0, 5.0)], "must be within 90 mm of"),
        ([NOSE, SUPPORTS[0], ("left", "below", False, -40.0, 5.0)], "'quarter' must be half or"),
    ],
)
def test_impossible_cylinders_get_one_sentence(
    cylinders: list[tuple[str, str, bool, float, float]], sentence: str
) -> None:
    with pytest.raises(rf.SpecificationError, match=sentence):
        rf.override(rf.ramie(14.23, 7.28, 0.67), stated(*cylinders))


def test_stalk_pressed_off_centre_needs_friction() -> None:
    with pytest.raises(rf.SpecificationError, match="must be above 0: nothing else keeps"):
        rod("numerics.domain=half", "fixture.indenter_offset_mm=30")


def test_turned_stalk_needs_the_full_model() -> None:
    with pytest.raises(
        rf.SpecificationError, match="'half' must be full for a stalk with rotation"
    ):
        rf.override(rf.published_test("table3"), ["stalk.rotation_deg=30", "numerics.domain=half"])


def test_fixture_survives_a_file(tmp_path) -> None:
    plates = ["span_mm=0", "indenter_radius_mm=inf", "support_radius_mm=inf"]
    for changes in (plates, ["inner_span_mm=40"]):
        test = rf.override(rf.published_test("table3"), [f"fixture.{c}" for c in changes])
        rf.write_test(test, tmp_path / "test.toml")
        assert rf.read_test(tmp_path / "test.toml") == test


def test_mesh_is_graded_for_every_cylinder() -> None:
    askew = ("fixture.indenter_offset_mm=30", "fixture.other_support_radius_mm=2")
    test = rod("numerics.domain=half", *askew, friction=0.1)
    z = axial_positions(test)
    for cylinder in test.fixture.cylinders:
        assert np.abs(z - cylinder.z_mm).min() < 1e-9
    lengths = np.diff(z)
    under = {c.name: lengths[np.abs(z[1:] - c.z_mm).argmin()] for c in test.fixture.cylinders}
    # 0.04 of 9 diameters, or of 21 radii of 2 mm
    assert under["support"] == pytest.approx(0.04 * 72, rel=0.15)
    assert under["other_support"] == pytest.approx(0.04 * 42, rel=0.15)


@pytest.mark.parametrize("offset_mm", [-0.02, 1e-6, 0.5])
def test_an_indenter_off_centre_makes_no_slivers(offset_mm: float) -> None:
    centred = np.diff(axial_positions(rod("numerics.domain=half", friction=0.1)))
    change = f"fixture.indenter_offset_mm={offset_mm}"
    moved = np.diff(axial_positions(rod("numerics.domain=half", change, friction=0.1)))
    assert len(moved) == len(centred)
    # the spaces between the cylinders become longer and shorter by up to one per cent
    assert moved == pytest.approx(centred, rel=0.02)


@pytest.mark.parametrize("first_step_mm", [0.05, 0.1, 0.2])
def test_plates_crush_a_thin_ring_as_its_closed_solution_says(first_step_mm: float) -> None:
    """Diameters change by 0.1488 and 0.1366 P R^3 / (E I) (Timoshenko 1956, section 17).

    These are the vertical and the lateral diameter. The ring is crushed by half a per cent of its
    diameter. A wall of a twentieth of the radius adds 0.4 % by shear and thrust; the rest of the
    tolerance is for the mesh and the growing contact. Only contact holds the ring: an iterate that
    touches no plate drifts, and only dynamic relaxation ends this.
    """
    radius, wall, length = 20.0, 1.0, 4.0
    material = rf.Material(rf.Elastic.isotropic(YOUNG, 0.0))
    layers = (rf.Layer("ring", 2 * radius + wall, material),)
    stalk = rf.Stalk(length, 2 * radius - wall, layers)
    fixture = rf.Fixture(0.0, math.inf, math.inf, rf.Friction(0.0, 0.0))
    changes = (
        "numerics.mesh=ladder_q2_1",
        "numerics.mesh.angular_elements=24",
        "numerics.mesh.side_growth=1.0",
        "numerics.mesh.coarse_size=0.6",
        "numerics.acoustic_check=false",
        f"numerics.stepping.first_step_mm={first_step_mm}",
        "protocol.travel_mm=0.2",
    )
    test = rf.override(rf.BendingTest(stalk, fixture, law="isotropic"), changes)
    result = rf.simulate(test, MPI.COMM_SELF)
    unit = end(result) * radius**3 / (YOUNG * length * wall**3 / 12)
    assert pytest.approx(0.1488 * unit, rel=0.025) == 0.2
    widening = end(result, "section_width_mm") - (2 * radius + wall)
    assert widening == pytest.approx(0.1366 * unit, rel=0.025)
    assert end(result, "support_force_N") == pytest.approx(end(result), rel=1e-3)


@pytest.mark.slow
def test_four_point_bending_is_pure_between_the_inner_cylinders() -> None:
    inner = 80.0
    result = rf.simulate(rod(f"fixture.inner_span_mm={inner}"), MPI.COMM_SELF)
    arm = (SPAN - inner) / 2
    beam = arm**2 * (3 * SPAN - 4 * arm) / (12 * YOUNG * SECOND_MM4) + arm / (2 * SHEAR_N)
    # indentation makes up a few per cent of the 2 mm, and makes the beam softer
    assert 0.95 < end(result) * beam / 2.0 < 1.0
    body = result.snapshots[-1].body
    middle = body.points[body.cells].mean(axis=1)
    strain = body.cell_data["axial_stretch"] - 1.0
    curvatures = []
    for at in (0.0, 10.0, 20.0, 25.0):
        near = np.abs(middle[:, 2] - at) < 5.0
        curvatures.append(-np.polyfit(middle[near, 1], strain[near], 1)[0])
    assert curvatures == pytest.approx([curvatures[0]] * 4, rel=2e-3)
    # contact is not quite at the axes of the cylinders: up to 1 mm of the 60 mm arm
    moment = end(result) / 2 * arm
    assert curvatures[0] == pytest.approx(moment / (YOUNG * SECOND_MM4), rel=0.02)


@pytest.mark.slow
def test_indenter_off_centre_finds_the_beams_stiffness() -> None:
    """The deflection is P a^2 b^2 / (3 E I L) plus shear; friction keeps the rod from sliding."""
    test = rod("numerics.domain=half", "fixture.indenter_offset_mm=40", friction=0.1)
    a, b = SPAN / 2 - 40.0, SPAN / 2 + 40.0
    beam = (a * b) ** 2 / (3 * YOUNG * SECOND_MM4 * SPAN) + a * b / (SPAN * SHEAR_N)
    # indentation makes it softer by some per cent, friction stiffer by less than one
    assert 0.95 < end(rf.simulate(test, MPI.COMM_SELF)) * beam / 2.0 < 1.01


@pytest.mark.slow
def test_cantilever_between_two_rollers_finds_the_beams_stiffness() -> None:
    """An overhang c deflects by P c^2 (d + c) / (3 E I) (Gere and Goodno 2013, Table G-1)."""
    d, c = 60.0, 80.0
    held = stated(
        ("nose", "above", True, c, 5.0),
        ("pivot", "below", False, 0.0, 5.0),
        ("clamp", "above", False, -d, 5.0),
        friction=0.1,
    )
    test = rod(*held, "numerics.domain=half")
    beam = c**2 * (d + c) / (3 * YOUNG * SECOND_MM4) + c * (1 + c / d) / SHEAR_N
    # indentation makes it softer by some per cent, friction stiffer by less than one
    assert 0.95 < end(rf.simulate(test, MPI.COMM_SELF)) * beam / 2.0 < 1.01


@pytest.mark.slow
def test_supports_of_different_radii_bear_the_same() -> None:
    test = rod("numerics.domain=half", "fixture.other_support_radius_mm=2.5", friction=0.1)
    equal = rod(friction=0.1)
    forces = [end(rf.simulate(t, MPI.COMM_SELF)) for t in (test, equal)]
    # two supports of a beam: the sharper one indents a little more
    assert forces[0] == pytest.approx(forces[1], rel=0.01)


@pytest.mark.slow
def test_ellipse_turned_by_a_right_angle_is_the_one_with_swapped_diameters() -> None:
    changes = ("numerics.domain=full", "protocol.travel_mm=1", "fixture.span_mm=100")
    turned = rod("stalk.section_height_mm=6", "stalk.rotation_deg=90", *changes, friction=0.1)
    swapped = rod("stalk.section_height_mm=8", *changes, width=6.0, friction=0.1)
    forces = [end(rf.simulate(test, MPI.COMM_SELF)) for test in (turned, swapped)]
    # the same section with other nodes; lying and upright differ by a factor of 1.78
    assert forces[0] == pytest.approx(forces[1], rel=0.01)

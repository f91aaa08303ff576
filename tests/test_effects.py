"""Expected consequences of effects for a mesh, a law, a record and a force curve."""

from dataclasses import replace

import numpy as np
import pytest
from mpi4py import MPI

import ramiefenics as rf
from ramiefenics.effects import EFFECTS, load_effects
from ramiefenics.model.tube import SURFACES, build_tube

SHORT = ["protocol.travel_mm=3", "protocol.save_every_mm=3", "numerics.acoustic_check=false"]


@pytest.fixture(scope="module")
def stalk():
    return rf.override(rf.ramie(14.23, 7.28, 0.67), ["numerics.mesh=ladder_q2_1", *SHORT])


@pytest.fixture(scope="module")
def force(simulated):
    def of(test, at_mm=3.0):
        curve = simulated(test).curve
        return float(np.interp(at_mm, curve["displacement_mm"], curve["force_N"]))

    return of


def placed(test, **values):
    return replace(test, stalk=replace(test.stalk, **values))


@pytest.mark.parametrize("effect", EFFECTS.values(), ids=EFFECTS)
def test_nothing_at_zero_something_at_the_typical_amplitude(effect, stalk):
    placed_stalk = placed(stalk, position_mm=500.0)
    assert effect.apply(placed_stalk, 0.0) == placed_stalk
    assert effect.apply(placed_stalk, effect.typical) != placed_stalk


@pytest.mark.parametrize("effect", EFFECTS.values(), ids=EFFECTS)
def test_extended_specifications_survive_a_file(effect, stalk, tmp_path):
    extended = effect.apply(stalk, effect.typical)
    rf.write_test(extended, tmp_path / "extended.toml")
    assert rf.read_test(tmp_path / "extended.toml") == extended


def test_machine_records_gap_travel_and_its_own_deflection(stalk, force):
    test = EFFECTS["machine_compliance"].apply(stalk, 0.02)
    curve = rf.simulate(EFFECTS["seating_gap"].apply(test, 0.5)).curve
    expected = 0.5 + curve["displacement_mm"] + 0.02 * curve["force_N"]
    assert np.allclose(curve["recorded_displacement_mm"], expected, rtol=1e-12)
    assert curve["force_N"].iloc[-1] == pytest.approx(force(stalk), rel=1e-6)


def test_taper_narrows_the_mesh_along_the_stalk(stalk):
    tapered = EFFECTS["taper"].apply(placed(stalk, measured_at_mm=-90.0), 0.01)
    tube = build_tube(tapered, MPI.COMM_SELF)
    x = tube.mesh.geometry.x
    radius = np.hypot(x[:, 0], x[:, 1])
    for z, diameter in ((-90.0, 14.23), (0.0, 14.23 - 0.9), (90.0, 14.23 - 1.8)):
        assert 2.0 * radius[np.isclose(x[:, 2], z)].max() == pytest.approx(diameter, rel=1e-12)
    assert len(tube.facets.find(SURFACES["outer"])) > 0


def test_tapered_stalk_bears_what_a_straight_one_of_its_midspan_does(stalk, force):
    """One side is thicker and the other thinner, so the difference is of second order."""
    taper = EFFECTS["taper"]
    midspan = placed(
        stalk,
        void_diameter_mm=7.28 * (1 - 0.45 / 14.23),
        layers=tuple(
            replace(layer, outer_diameter_mm=layer.outer_diameter_mm * (1 - 0.45 / 14.23))
            for layer in stalk.stalk.layers
        ),
    )
    tapered = force(taper.apply(placed(stalk, measured_at_mm=-90.0), 0.005))
    # (0.25 mm / 7 mm)^2 is 0.1 %; the diameter measured at the end gives a force 6 % off
    assert tapered == pytest.approx(force(midspan), rel=3e-3)
    assert abs(tapered / force(stalk) - 1.0) > 0.03


def test_a_stalk_is_the_same_by_its_section_at_midspan(stalk):
    """A tapered, turned ellipse with an eccentric void has similar sections all along."""
    full = replace(stalk, numerics=replace(stalk.numerics, domain="full"))
    oval = placed(full, section_height_mm=13.0, rotation_deg=20.0, void_offset_mm=0.5)
    tapered = EFFECTS["taper"].apply(placed(oval, measured_at_mm=-90.0), 0.01)
    described = replace(tapered, stalk=tapered.stalk.measured_at_midspan())
    one, other = (build_tube(test, MPI.COMM_SELF).mesh.geometry.x for test in (tapered, described))
    assert described.stalk.outer_diameter_mm == pytest.approx(14.23 - 0.9)
    assert other == pytest.approx(one, abs=1e-5)  # Gmsh finds places on arcs by iteration


def test_taper_refuses_the_symmetric_model(stalk):
    with pytest.raises(rf.SpecificationError, match=r"numerics\.domain.*half or full"):
        placed(stalk, taper=0.01)


def test_stiffness_gradient_scales_the_force(stalk, force):
    """All stresses scale with the moduli, so the force is proportional to a common factor."""
    graded = EFFECTS["stiffness_gradient"].apply(placed(stalk, position_mm=800.0), 0.25)
    assert force(graded) == pytest.approx(1.2 * force(stalk), rel=1e-4)


@pytest.mark.parametrize("own_gradient", [0.0, 0.4])
def test_a_centred_gradient_changes_no_mean(stalk, own_gradient):
    """This holds for any positions on the plant, whatever gradient the specification has."""
    places = [300.0, 800.0, 1300.0]
    tests = [placed(stalk, position_mm=p, stiffness_gradient_per_m=own_gradient) for p in places]
    effect = EFFECTS["stiffness_gradient"].centred(tests)
    moduli = np.array([[axial_MPa(effect.apply(t, a)) for t in tests] for a in (0.0, 0.25)])
    assert moduli[1].mean() == pytest.approx(moduli[0].mean(), rel=1e-12)
    in_the_middle = moduli[0, 1]
    assert moduli[1] - moduli[0] == pytest.approx(np.array([-1, 0, 1]) * 0.125 * in_the_middle)


def test_lengths_are_judged_by_the_span(stalk):
    """Typical amplitudes for 100 mm are halved for 50 mm, and repeating this changes nothing."""
    short = rf.override(stalk, ["fixture.span_mm=50"])
    for name in ("span_error", "seating_gap", "off_centre_indenter"):
        effect = EFFECTS[name]
        sized = effect.sized([short, short])
        assert sized.typical == pytest.approx(0.5 * effect.typical)
        assert sized.bounds == pytest.approx(tuple(0.5 * np.array(effect.bounds)))
        assert sized.sized([short]).typical == pytest.approx(sized.typical)
        assert effect.sized([stalk]).typical == pytest.approx(effect.typical)
    assert EFFECTS["machine_compliance"].sized([short]) is EFFECTS["machine_compliance"]
    ring = rf.override(stalk, ["fixture.span_mm=0", "fixture.support_radius_mm=inf"])
    assert EFFECTS["seating_gap"].sized([ring]) is EFFECTS["seating_gap"]


@pytest.mark.slow
@pytest.mark.parametrize("name", [name for name, effect in EFFECTS.items() if effect.even])
def test_even_effects_have_a_size_only(name, stalk, force):
    effect, short = EFFECTS[name], rf.override(stalk, ["protocol.travel_mm=1"])
    there, back, without = (force(effect.apply(short, a), 1.0) for a in (5.0, -5.0, 0.0))
    assert back == pytest.approx(there, rel=1e-5)  # mirrored meshes; tolerance of the steps
    assert abs(there / without - 1.0) > 1e-4
    assert effect.as_found([short]).bounds == (0.0, effect.bounds[1])


def test_effects_that_are_not_even_keep_their_sign(stalk):
    effect = EFFECTS["load_offset"]
    assert effect.as_found([stalk]) == effect.sized([stalk])


def axial_MPa(test):
    return test.stalk.layers[0].material.scaled(test.stalk.stiffness_factor).elastic.E_Z_MPa


def test_moisture_softens_all_that_resists(coarse, force):
    """The force scales with the moduli, which are given for the mean moisture of 1 and 2."""
    stalk = rf.override(coarse, [*SHORT, "protocol.travel_mm=1"])
    tests = [placed(stalk, moisture=m, position_mm=500.0 * m) for m in (1.0, 2.0)]
    wet = [EFFECTS["moisture"].centred(tests).apply(test, 1.5) for test in tests]
    expected = np.exp([0.75, -0.75]) * axial_MPa(stalk)
    assert [axial_MPa(test) for test in wet] == pytest.approx(expected)
    assert force(wet[1], 1.0) == pytest.approx(np.exp(-0.75) * force(stalk, 1.0), rel=1e-4)
    # two softenings and a gradient with height, each from its own reference
    twice = EFFECTS["moisture"].apply(wet[1], 0.5, reference=1.8)
    graded = EFFECTS["stiffness_gradient"].apply(twice, 0.2, reference_mm=750.0)
    softer = np.exp(-0.75 - 0.5 * 0.2) * axial_MPa(stalk)
    assert axial_MPa(graded) == pytest.approx(1.05 * softer)


@pytest.mark.parametrize("effect", EFFECTS.values(), ids=EFFECTS)
def test_only_covariates_are_centred(effect, stalk):
    """Displacement, diameters and a distance from midspan have a natural zero."""
    places = (200.0, 600.0)
    tests = [placed(stalk, position_mm=p, measured_at_mm=90.0, moisture=p / 1e3) for p in places]
    centred = effect.centred(tests)
    same = [effect.apply(t, effect.typical) == centred.apply(t, effect.typical) for t in tests]
    assert all(same) == (not effect.covariates)


def test_vanishing_pith_leaves_the_hollow_stalk(stalk, force):
    """The mesh of the tube must not depend on what fills it."""
    stalk = rf.override(stalk, ["numerics.mesh.angular_elements=8"])  # four to a quadrant
    filled = EFFECTS["pith_core"].apply(stalk, 1e-6)
    assert force(filled) == pytest.approx(force(stalk), rel=2e-4)


def test_pith_carries_load(stalk, force):
    assert force(EFFECTS["pith_core"].apply(stalk, 1.0)) > 1.05 * force(stalk)


def test_pith_needs_a_void(stalk):
    with pytest.raises(rf.SpecificationError, match="no void to fill"):
        EFFECTS["pith_core"].apply(placed(stalk, void_diameter_mm=0.0), 0.1)


AGEING = """
from ramiefenics import Effect, override

def stiffer(test, share, mean_mm):
    scale = 1 + share * (test.stalk.void_diameter_mm - mean_mm)
    return override(test, [f"protocol.travel_mm={test.protocol.travel_mm * scale}"])

AGEING = Effect("ageing", "Wider is older.", "none", "1/mm", (-1.0, 1.0), 0.1, stiffer, COVARIATES)
"""


def test_covariates_of_the_users_effects_are_centred(tmp_path, stalk):
    covariates = '{"mean_mm": "stalk.void_diameter_mm"}'
    (tmp_path / "own.py").write_text(AGEING.replace("COVARIATES", covariates))
    tests = [placed(stalk, void_diameter_mm=width) for width in (7.0, 8.0)]
    effect = load_effects(tmp_path / "own.py")["ageing"].centred(tests)
    travel = [effect.apply(test, 0.1).protocol.travel_mm for test in tests]
    assert travel == pytest.approx([3.0 * 0.95, 3.0 * 1.05])


def test_a_covariate_that_is_no_number_is_told(tmp_path, stalk):
    (tmp_path / "own.py").write_text(AGEING.replace("COVARIATES", '{"mean_mm": "stalk.age"}'))
    effect = load_effects(tmp_path / "own.py")["ageing"]
    with pytest.raises(rf.SpecificationError, match=r"ageing\.covariates = 'stalk\.age' must be"):
        effect.centred([stalk])


OWN = """
from ramiefenics import Effect, override

def blunt(test, mm):
    return override(test, [f"fixture.indenter_radius_mm={test.fixture.indenter_radius_mm + mm}"])

BLUNT = Effect("blunt", "The indenter is worn.", "the workshop", "mm", (0.0, 5.0), 1.0, blunt)
"""


def test_a_file_of_the_user_defines_effects(tmp_path, stalk):
    (tmp_path / "own.py").write_text(OWN)
    found = load_effects(tmp_path / "own.py")
    assert list(found) == ["blunt"]
    assert found["blunt"].file == tmp_path / "own.py"
    assert found["blunt"].apply(stalk, 2.0).fixture.indenter_radius_mm == 7.0


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (None, "must be a Python file"),
        ("x = 1", "must define at least one"),
        ("1 / 0", r"does not run \(ZeroDivisionError"),
        (OWN.replace("(0.0, 5.0)", "(1.0, 5.0)"), r"effect blunt\.bounds"),
        (OWN.replace("1.0, blunt", "9.0, blunt"), r"effect blunt\.typical"),
        (OWN.replace('"blunt"', '"a b"'), "must be one word"),
        (OWN.replace(", blunt)", ', blunt, {"mean": "stalk.position_mm"})'), "argument of apply"),
    ],
)
def test_bad_files_of_effects_are_told(tmp_path, text, message):
    if text is not None:
        (tmp_path / "own.py").write_text(text)
    with pytest.raises(rf.SpecificationError, match=message):
        load_effects(tmp_path / "own.py")

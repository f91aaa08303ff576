"""Effects that no suspect describes, learned as free functions in a closed-form model."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from folders import check_folder, check_print
from formula import AT_MM, FIBRE_N, STRAIN, Formula
from scipy.integrate import cumulative_trapezoid

import ramiefenics as rf
from ramiefenics.discovery.anatomy import Anatomist, Learned
from ramiefenics.discovery.curves.directions import directions_of
from ramiefenics.discovery.curves.observed import observe
from ramiefenics.discovery.curves.prediction import Predictor
from ramiefenics.discovery.places import places
from ramiefenics.discovery.search.fitting import Fitter
from ramiefenics.discovery.synthetic import Secret, make_dataset
from ramiefenics.model.laws.free_form import PULLED, STRAINS
from ramiefenics.surrogate.coordinates import numbers

pytestmark = pytest.mark.filterwarnings("ignore::ramiefenics.SpecificationWarning")

BEDDING = rf.EFFECTS["nonlinear_compliance"]
TAPER = rf.EFFECTS["taper"]


def learn(folder: Path) -> tuple[Learned, dict[str, float], rf.BendingTest]:
    """Learn, whatever the verdict; return also the specification of the first specimen."""
    dataset = rf.read_dataset(folder)
    observed, tests = observe(dataset), [record.test for record in dataset.records]
    predictor = Predictor(tests, observed, Formula())
    baseline = Fitter(dataset, observed, predictor).baseline()
    return *Anatomist(dataset, observed, predictor).learn(baseline), tests[0]


def band(learned: Learned, basis: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return mean and three standard deviations, a band that should contain the function."""
    mean, covariance = learned.coefficients
    return basis @ mean, 3.0 * np.sqrt(np.einsum("gi,ij,gj->g", basis, covariance, basis))


def test_a_machine_that_beds_in_is_learned_and_named(tmp_path: Path) -> None:
    make_dataset(tmp_path / "data", Secret(BEDDING, 0.06), 31, Formula())
    found = rf.discover(tmp_path / "data", {TAPER.name: TAPER}, runs=Formula())
    assert found.verdict == "unknown"
    anatomy = found.anatomy
    assert anatomy is not None
    assert anatomy.supported
    assert anatomy.place.name == "machine"
    assert anatomy.probability["machine"] > 0.95
    truth = BEDDING.apply(anatomy.test, 0.06).machine.deflection_mm(anatomy.place.at)
    _, low, high = anatomy.function
    assert np.mean((low <= truth) & (truth <= high)) > 0.9
    assert anatomy.shape_gain.shown
    assert anatomy.misfit_p_value > 0.001
    check_print(found, "a force-dependent deflection of machine, load cell or fixture")
    rf.write_folder(found, tmp_path / "found")
    verdict, _ = check_folder(tmp_path / "found", "verdict.json")
    assert verdict["anatomy"]["place"] == "machine"
    extended = rf.read_test(tmp_path / "found" / "extended.toml").machine
    assert extended.table_mm == pytest.approx(anatomy.extended_test().machine.table_mm)


def stiffest_half_way(test: rf.BendingTest, amount: float) -> rf.BendingTest:
    """Lower the moduli with the square of the distance from 600 mm, by a share at either end."""
    far = (test.stalk.position_mm - 600.0) / 600.0
    layers = tuple(
        replace(x, material=x.material.scaled(1.0 - amount * far**2)) for x in test.stalk.layers
    )
    return replace(test, stalk=replace(test.stalk, layers=layers))


HALF_WAY = replace(TAPER, apply=stiffest_half_way)


def relative_modulus(at_mm: np.ndarray, specimens: int) -> np.ndarray:
    """Return the modulus of stalks that have half of the largest at either end, over its mean."""
    modulus, every = (
        1.0 - 0.5 * ((x - 600.0) / 600.0) ** 2 for x in (at_mm, np.linspace(0.0, 1200.0, specimens))
    )
    return np.asarray(modulus / every.mean())


def test_a_stalk_that_is_stiffest_half_way_up_is_learned(tmp_path: Path) -> None:
    make_dataset(tmp_path, Secret(HALF_WAY, 0.5), 32, Formula(), specimens=10)
    learned, gains, test = learn(tmp_path)
    assert max(gains, key=gains.__getitem__) == "height"
    assert gains["height"] > 5.0
    middle, half = band(learned, learned.place.basis(test))
    truth = relative_modulus(learned.place.at, 10)
    assert np.all(np.abs(1.0 + middle - truth) < half + 0.01)  # splines have straight ends


@pytest.mark.slow
def test_bands_hold_a_function_that_is_learned_from_differences_between_specimens(
    tmp_path: Path,
) -> None:
    """Of eight stalks, four coefficients leave three degrees of freedom or little more.

    The scatter of the stalks may imitate another place, but seldom. Points of one band are not
    independent; over twenty data sets their share has a standard deviation of about 0.02.
    """
    shares = []
    for seed in range(900, 920):
        make_dataset(tmp_path / str(seed), Secret(HALF_WAY, 0.5), seed, Formula())
        learned, gains, test = learn(tmp_path / str(seed))
        if max(gains, key=gains.__getitem__) != "height":
            continue
        _, low, high = learned.function(test)
        truth = relative_modulus(learned.place.at, 8)
        shares.append(np.mean((low <= truth) & (truth <= high)))
    assert len(shares) >= 17
    assert np.mean(shares) > 0.9


def test_fibres_that_lose_their_stiffness_are_learned(tmp_path: Path) -> None:
    """Their tangent drops by 0.3 k in a smooth step at a strain of 0.03, unlike any law."""
    make_dataset(tmp_path, Secret(None), 33, Formula())
    lost = -0.3 / (1.0 + np.exp(-(STRAIN - 0.03) / 0.008))
    table = pd.read_csv(tmp_path / "specimens.csv")
    for path in table["curve"]:
        curve = pd.read_csv(tmp_path / path)
        change = FIBRE_N * cumulative_trapezoid(lost, STRAIN, initial=0.0)
        more = np.interp(curve["displacement_mm"], AT_MM, change)
        curve.assign(force_N=curve["force_N"] + more).to_csv(tmp_path / path, index=False)
    learned, gains, _ = learn(tmp_path)
    assert max(gains, key=gains.__getitem__) == "fibre"
    # the formula has no neutral axis: only the sum of tension and half of compression is learned
    number = len(STRAINS)
    assert [effect.name for effect in learned.place.effects[:number]] == list(PULLED)
    hats = np.array([np.interp(STRAIN, (0.0, *STRAINS), (0.0, *unit)) for unit in np.eye(number)])
    stress = cumulative_trapezoid(hats, STRAIN, initial=0.0).T
    middle, half = band(learned, np.hstack([stress, 0.5 * stress]))
    truth = cumulative_trapezoid(lost, STRAIN, initial=0.0)
    assert np.all(np.abs(middle - truth) < half + 5e-4)  # knots do not resolve the step


def test_every_coefficient_changes_its_function_only(screening: rf.BendingTest) -> None:
    """Without coefficients a specification keeps its meaning; functions follow their knots."""
    tests = [
        rf.override(screening, [f"stalk.position_mm={height}"]) for height in (0.0, 300.0, 900.0)
    ]
    found = places(tests, 100.0, 14.0)
    assert set(found) == {"machine", "fibre", "section", "height"}
    machine, height = found["machine"], found["height"]
    values = np.linspace(0.1, 0.6, len(machine.effects))
    machined = machine.apply(tests[0], values).machine
    assert machined.deflection_mm(np.array([0.0, *machined.table_N])) == pytest.approx([0, *values])
    factors = [
        height.apply(test, np.array([0.1, -0.2, 0.4])).stalk.stiffness_factor for test in tests
    ]
    assert np.mean(factors) == pytest.approx(1.0)  # a common stiffness is left to the factors
    assert np.ptp(factors) > 0.2
    for place in found.values():
        assert place.prepared(place.prepared(tests[0])) == place.prepared(tests[0])


def test_only_what_changes_the_section_needs_derivatives(screening: rf.BendingTest) -> None:
    """Factors on all moduli and errors of the machine do not, whatever rounding leaves of them."""
    heights = np.linspace(0.0, 1200.0, 8)
    tests = [rf.override(screening, [f"stalk.position_mm={height}"]) for height in heights]
    found = places(tests, 100.0, 14.0)
    effects = {effect.name: effect for place in found.values() for effect in place.effects}
    simulated = [e.name for name in ("fibre", "section") for e in found[name].effects]
    for test in tests:
        for place in found.values():
            test = place.apply(test, np.linspace(0.03, 0.11, len(place.effects)))
        directions = directions_of(effects, test)
        assert list(directions) == simulated
    for name, direction in directions.items():
        moved = effects[name].apply(test, 0.2)
        assert numbers(direction.apply(test, 0.2)) == pytest.approx(numbers(moved))

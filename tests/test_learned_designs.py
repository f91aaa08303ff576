"""Large designs whose curves are learned, for stalks with a closed-form force."""

from __future__ import annotations

import io
import math
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from test_validation import STUDY, measured

import ramiefenics as rf
from ramiefenics.calibration.calibrate import calibrate
from ramiefenics.calibration.campaign import STATED
from ramiefenics.runs import simulation
from ramiefenics.runs.curve import CurveTask, normalised
from ramiefenics.surrogate import TIME, simulations_to_learn
from ramiefenics.validation import Validation, validate

pytestmark = pytest.mark.filterwarnings("ignore::ramiefenics.SpecificationWarning")

X_MM = np.linspace(0.0, 14.0, 29)
SLOPE = 1e-5


def force_N(test: rf.BendingTest) -> np.ndarray:
    """Return a force with a maximum whose height and place depend on friction and radius."""
    stalk, fixture = test.stalk, test.fixture
    area = stalk.outer_diameter_mm**2 - stalk.void_diameter_mm**2
    mu, radius = fixture.friction.dynamic, math.log(fixture.indenter_radius_mm / 5.0)
    scale = stalk.layers[-1].material.elastic.E_Z_MPa / 1000.0
    top = area * (0.4 + mu + 0.05 * radius + mu * radius) * scale
    return top * np.sin(X_MM / (9.0 + radius) * np.pi / 2.0)


def computed(task: CurveTask) -> str:
    """Return the curve with its derivatives, for normalised moduli, as CSV."""
    test, _ = normalised(task.test)
    columns = {"displacement_mm": X_MM, "force_N": force_N(test)}
    for change in task.factors:
        ends = (force_N(change.apply(test, amount)) for amount in (-SLOPE, SLOPE))
        columns[change.name] = -np.subtract(*ends) / (2.0 * SLOPE)
    text = io.StringIO()
    pd.DataFrame(columns).to_csv(text, index=False)
    return text.getvalue()


@pytest.fixture
def simulated(
    monkeypatch: pytest.MonkeyPatch, as_result: Callable[..., rf.BendingResult]
) -> list[rf.BendingTest]:
    """List of the tests that a simulator of no cost was asked for by themselves, not as curves."""
    asked: list[rf.BendingTest] = []

    def simulate(test: rf.BendingTest, *_: object) -> rf.BendingResult:
        asked.append(test)
        return as_result(test, X_MM, force_N(test))

    monkeypatch.setattr(simulation, "simulate", simulate)
    monkeypatch.setattr(CurveTask, "compute", computed)
    return asked


def runs(folder: Path) -> rf.Runs:
    return rf.Runs(folder / "runs", ThreadPoolExecutor(2))


def validated(folder: Path, direct: bool) -> Validation:
    path = folder / "study.toml"
    text = STUDY.format(thick=measured("table8-1"), thin=measured("table8-2"))
    path.write_text(text.replace("runs = 16", "runs = 64"))
    return validate(path, runs(folder), direct=direct)


def test_a_large_validation_gives_the_same_answers_from_fewer_simulations(
    simulated: list[rf.BendingTest], tmp_path: Path
) -> None:
    learned = validated(tmp_path, direct=False)
    assert len(simulated) == 2  # both stalks at the best point
    assert learned.campaign.effort.curves == 128
    assert learned.campaign.effort.simulations < 40
    assert 0.0 < learned.campaign.effort.learned_error <= STATED
    assert f"took {learned.campaign.effort.simulations} simulations" in " ".join(learned.notes())
    direct = validated(tmp_path, direct=True)
    assert len(simulated) >= 128
    assert direct.campaign.effort.simulations == 128
    assert direct.notes() == ["All 128 force curves were simulated."]
    for name, seen in learned.observed.items():
        forces = (found.found.runs["max_force_N"] for found in (seen, direct.observed[name]))
        a, b = (values.to_numpy() for values in forces)
        # the stated error is two standard deviations
        assert np.quantile(np.abs(a / b - 1.0), 0.95) < STATED
    columns = ["low", "calibrated", "high", "prior_low", "uncalibrated", "prior_high", "fixed"]
    a, b = (found.table(found.assessments[0])[columns] for found in (learned, direct))
    assert a.to_numpy() == pytest.approx(b.to_numpy(), rel=2.0 * STATED)


FACTORS = STUDY[STUDY.index("[[factors]]") : STUDY.index("[[observations]]")]
CALIBRATION = f"""
title = "A large design"
baseline = "table8-1"
design = {{ kind = "sobol", runs = 64 }}
{FACTORS}
[[responses]]
name = "max_force_N"
target = 80.0
error = 1.0
[[responses]]
name = "displacement_at_max_mm"
"""


def test_a_large_calibration_is_confirmed_by_simulation(
    simulated: list[rf.BendingTest], tmp_path: Path
) -> None:
    path = tmp_path / "study.toml"
    path.write_text(CALIBRATION)
    found = calibrate(path, runs(tmp_path))
    assert found.fit is not None
    assert simulated == [found.fit.test]
    assert found.campaign.effort.simulations < 30
    tests = found.study.tests()
    exact = [force_N(test).max() for test in tests]
    assert found.runs["max_force_N"].to_numpy() == pytest.approx(exact, rel=2.0 * STATED)
    radius = np.array([test.fixture.indenter_radius_mm for test in tests])
    # the top of a sine; half a step of the curve at most
    assert found.runs["displacement_at_max_mm"].to_numpy() == pytest.approx(
        9.0 + np.log(radius / 5.0), abs=0.25
    )


def test_what_does_not_complete_is_simulated_by_itself(
    simulated: list[rf.BendingTest], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def breaking(task: CurveTask) -> str:
        if task.test.fixture.indenter_radius_mm < 3.0:
            raise rf.SpecificationError("fixture.indenter_radius_mm", 2.9, "must be larger")
        return computed(task)

    monkeypatch.setattr(CurveTask, "compute", breaking)
    path = tmp_path / "study.toml"
    path.write_text(CALIBRATION)
    found = calibrate(path, runs(tmp_path))
    small = [test for test in found.study.tests() if test.fixture.indenter_radius_mm < 3.0]
    assert 0 < len(small) < 20
    assert set(simulated[:-1]) == set(small)
    assert found.completed
    assert found.campaign.outcomes[0].test not in simulated


def test_what_cannot_be_learned_is_simulated(
    simulated: list[rf.BendingTest], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Forces that differ by 3 % without any pattern are not told by other forces."""

    def rough(task: CurveTask) -> str:
        curve = pd.read_csv(io.StringIO(computed(task)))
        friction = task.test.fixture.friction.dynamic
        curve["force_N"] *= 1.0 + 0.03 * math.sin(1e6 * friction)
        text = io.StringIO()
        curve.to_csv(text, index=False)
        return text.getvalue()

    with_derivatives = []

    def counted(task: CurveTask) -> str:
        with_derivatives.append(bool(task.factors))
        return rough(task)

    monkeypatch.setattr(CurveTask, "compute", counted)
    path = tmp_path / "study.toml"
    path.write_text(CALIBRATION)
    found = calibrate(path, runs(tmp_path))
    assert found.campaign.effort.learned_error == 0.0
    assert sum(with_derivatives) <= 64 / TIME + 2  # two at a time


def test_only_what_pays_is_learned(coarse: rf.BendingTest) -> None:
    def radii(number: int) -> list[rf.BendingTest]:
        values = np.linspace(2.5, 10.0, number)
        return [rf.override(coarse, [f"fixture.indenter_radius_mm={r}"]) for r in values]

    assert simulations_to_learn(radii(10)) is None
    expected = simulations_to_learn(radii(100))
    assert expected is not None
    assert expected < 40
    assert simulations_to_learn(10 * radii(10)) is None  # equal ones are simulated once
    further = [rf.override(test, ["protocol.then=[{to_mm=1}]"]) for test in radii(100)]
    assert simulations_to_learn(further) is None

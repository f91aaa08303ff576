"""Validation: predictions with known answers, and the statement of the published study."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from folders import check_folder, check_print

import ramiefenics as rf
from ramiefenics.calibration.factors import Factor, Space
from ramiefenics.calibration.misfit import Misfit, Targets
from ramiefenics.calibration.region import Region
from ramiefenics.calibration.surface import Surface
from ramiefenics.cli import main
from ramiefenics.published.tables import printed_values
from ramiefenics.runs import simulation
from ramiefenics.validation import Validation, read_validation, validate
from ramiefenics.validation.prediction import DRAWS, Prediction, condition, fix, prior
from ramiefenics.validation.strength_rule import by_strength

pytestmark = pytest.mark.filterwarnings("ignore::ramiefenics.SpecificationWarning")

STUDY = """
title = "One number calibrated"
nuisance = ["r"]
[design]
kind = "sobol"
runs = 16
[[factors]]
name = "mu"
keys = ["fixture.friction.dynamic"]
low = 0.05
high = 0.15
[[factors]]
name = "r"
keys = ["fixture.indenter_radius_mm"]
low = 2.5
high = 10.0
scale = "log"
[[observations]]
name = "thick"
baseline = "table8-1"
measured = {thick}
error = 0.05
[[observations]]
name = "thin"
baseline = "table8-2"
measured = {thin}
error = 0.5
published = 90.0
[[splits]]
title = "thin from thick"
on = ["thick"]
"""


def max_force(test: rf.BendingTest) -> float:
    """Return a force that rises with the section's area, friction, and the radius's logarithm."""
    stalk, fixture = test.stalk, test.fixture
    area = stalk.outer_diameter_mm**2 - stalk.void_diameter_mm**2
    return area * (0.4 + fixture.friction.dynamic + 0.05 * math.log(fixture.indenter_radius_mm / 5))


TRUTH = ["fixture.friction.dynamic=0.1", "fixture.indenter_radius_mm=5.0"]


def measured(name: str) -> float:
    return max_force(rf.override(rf.published_test(name), TRUTH))


@pytest.fixture
def asked(
    monkeypatch: pytest.MonkeyPatch, as_result: Callable[..., rf.BendingResult]
) -> list[rf.BendingTest]:
    """List of the tests requested from a simulator that takes no time."""
    asked: list[rf.BendingTest] = []

    def simulate(test: rf.BendingTest, *_: object) -> rf.BendingResult:
        asked.append(test)
        x = np.linspace(0.0, 14.0, 29)
        return as_result(test, x, max_force(test) * np.sin(x / 14.0 * np.pi))

    monkeypatch.setattr(simulation, "simulate", simulate)
    return asked


@pytest.fixture
def done(asked: list[rf.BendingTest], tmp_path: Path) -> Validation:
    return run(tmp_path, measured("table8-1"), measured("table8-2"))


def run(folder: Path, thick: float, thin: float, **changes: str) -> Validation:
    path, text = folder / "study.toml", STUDY.format(thick=thick, thin=thin)
    for old, new in changes.items():
        assert old in text
        text = text.replace(old, new)
    path.write_text(text)
    return validate(path, rf.Runs(folder / "runs", ThreadPoolExecutor(2)))


def plane(*slopes: float, constant: float = 0.0) -> Surface:
    """Return a surface without error, through the corners of a square."""
    points = np.array([[-1.0, -1.0], [-1.0, 1.0], [1.0, -1.0], [1.0, 1.0], [0.0, 0.0]])
    terms = ((0, 0), (1, 0), (0, 1))
    return Surface("max_force_N", ("a", "b"), terms, points, constant + points @ np.array(slopes))


def line(measured: float, error: float) -> Misfit:
    surface = plane(5.0, 0.0, constant=10.0)
    targets = Targets(("on",), np.array([measured]), np.array([[error**2]]))
    return Misfit((surface,), targets, Region(2, 1.0, math.sqrt(2.0)))


def test_predictions_are_those_of_bayes_rule() -> None:
    # a is normal with mean 0.2 and deviation 0.1, far from the ends of its flat prior; b stays flat
    weighted, met = condition(line(11.0, 0.5), prior(line(11.0, 0.5)))
    assert met
    low, median, high = Prediction(weighted, plane(8.0, 0.0, constant=20.0)).interval
    assert median == pytest.approx(21.6, abs=0.02)
    # one per cent of the width: 131072 points, of which an eighth share the weight
    assert [low, high] == pytest.approx([21.6 - 1.96 * 0.8, 21.6 + 1.96 * 0.8], abs=0.03)
    low, median, high = Prediction(weighted, plane(0.0, 3.0)).interval
    assert [low, median, high] == pytest.approx([-2.85, 0.0, 2.85], abs=0.03)
    expected = DRAWS * 0.1 * 2.0 * math.sqrt(math.pi) / 2.0  # n / E(w^2) of a normal in [-1, 1]
    assert weighted.effective == pytest.approx(expected, rel=0.05)


def test_what_is_out_of_reach_leaves_wide_intervals() -> None:
    # 10 + 5 a is at most 15, which is 5 too low: as an error of the model this leaves a almost
    # open, with deviations counted from 15 in units of hypot(5, 0.5)
    weighted, met = condition(line(20.0, 0.5), prior(line(20.0, 0.5)))
    assert not met
    low, _, high = Prediction(weighted, plane(8.0, 0.0, constant=20.0)).interval
    a = np.linspace(-1.0, 1.0, 20001)
    density = np.exp(-0.5 * ((10.0 - 5.0 * a) ** 2) / (25.0 + 0.25))
    below = np.cumsum(density) / density.sum()
    assert [low, high] == pytest.approx(
        [20.0 + 8.0 * np.interp(q, below, a) for q in (0.025, 0.975)], abs=0.05
    )


def test_an_equal_surface_predicts_what_was_measured() -> None:
    weighted, _ = condition(line(11.0, 0.5), prior(line(11.0, 0.5)))
    assert Prediction(weighted, plane(5.0, 0.0, constant=10.0)).mean == pytest.approx(
        11.0, abs=0.01
    )


def test_swing_is_from_fifth_to_fifth() -> None:
    before = prior(line(11.0, 0.5))
    assert Prediction(before, plane(8.0, 3.0)).swing(0) == pytest.approx(8.0 * 1.6, rel=0.01)
    after, _ = condition(line(11.0, 0.5), before)
    assert Prediction(after, plane(8.0, 3.0)).swing(1) == pytest.approx(3.0 * 1.6, rel=0.02)
    assert math.isnan(Prediction(after, plane(8.0, 3.0)).swing(0))  # both ends are ruled out


def test_fixed_factors_stay() -> None:
    held = fix(prior(line(11.0, 0.5)), [1], np.array([0.0, 0.25]))
    assert np.ptp(Prediction(held, plane(0.0, 4.0)).values) < 1e-12
    assert Prediction(held, plane(0.0, 4.0)).mean == pytest.approx(1.0)


def test_logarithmic_factors_have_their_middle_at_the_geometric_mean() -> None:
    space = Space((Factor("r", ("fixture.indenter_radius_mm",), 2.5, 10.0, scale="log"),))
    assert space.natural(np.array([[-1.0], [0.0], [1.0]])).ravel() == pytest.approx(
        [2.5, 5.0, 10.0]
    )
    assert space.coded(np.array([[5.0]])) == pytest.approx(0.0, abs=1e-12)
    with pytest.raises(rf.SpecificationError, match="low = 0"):
        Factor("r", ("fixture.indenter_radius_mm",), 0.0, 10.0, scale="log")


def test_strength_rule_scales_with_the_section_modulus() -> None:
    # doubling all diameters gives eight times the force; doubling the span halves it
    small, large = rf.ramie(7.0, 3.5, 0.3), rf.ramie(14.0, 7.0, 0.6)
    tests = {"small": small, "large": large, "long": rf.override(large, ["fixture.span_mm=150"])}
    found = by_strength(tests, {"small": (10.0, 1.0)})
    assert found == pytest.approx({"small": 10.0, "large": 80.0, "long": 80.0 / 1.5})
    # two measurements that disagree, the second three times more accurate
    mean = by_strength(tests, {"small": (10.0, 3.0), "large": (100.0, 8.0)})["small"]
    assert mean == pytest.approx((10.0 / 9.0 + 12.5) / (1.0 / 9.0 + 1.0))


def test_the_right_model_predicts_the_other_stalk(done: Validation) -> None:
    (assessment,) = done.assessments
    table = done.table(assessment).set_index("observation")
    assert list(table["role"]) == ["calibrated on", "predicted"]
    # friction and radius cannot be told apart, but move both forces alike
    for name in ("calibrated", "fixed", "simulated"):
        assert table.loc["thin", name] == pytest.approx(measured("table8-2"), rel=2e-3)
    assert table.loc["thin", "high"] - table.loc["thin", "low"] < 1.0
    # 2 (a + b - sqrt(0.2 a b)) of the area is the width of the 95 % interval of the sum of two
    # flat distributions of half widths a = 0.05 and b = 0.05 ln 2
    width = 2.0 * (0.05 + 0.0347 - math.sqrt(0.2 * 0.05 * 0.0347)) * (14.3**2 - 7.45**2)
    assert table.loc["thin", "prior_high"] - table.loc["thin", "prior_low"] == pytest.approx(
        width, rel=0.01
    )
    assert table["covered"].all()
    assert assessment.reached
    assert assessment.reached_fixed
    swings = done.swings(assessment).set_index("factor")
    assert swings.loc["mu", "before"] == pytest.approx(100.0 * 0.08 / 0.5, rel=0.02)
    assert abs(swings.loc["mu", "after"]) < 0.2
    scores = done.scores(assessment).set_index("predictor")
    error = 100.0 * (90.0 / measured("table8-2") - 1.0)
    assert scores.loc["published", "rms_percent"] == pytest.approx(abs(error))
    assert scores.loc["calibrated", "rms_percent"] < 0.2


def test_a_wrong_model_is_told(asked: list[rf.BendingTest], tmp_path: Path) -> None:
    found = run(tmp_path, measured("table8-1"), 1.1 * measured("table8-2"))
    table = found.table(found.assessments[0]).set_index("observation")
    assert not table.loc["thin", "covered"]
    assert table.loc["thin", "calibrated_error_percent"] == pytest.approx(-100.0 / 11.0, abs=0.3)
    assert "0 of 1 measurements agree" in " ".join(found.findings())


def test_what_the_factors_do_not_reach_is_told(asked: list[rf.BendingTest], tmp_path: Path) -> None:
    found = run(tmp_path, 1.5 * measured("table8-1"), 100.0)
    assert not found.assessments[0].reached
    assert "No values of the factors meet" in " ".join(found.findings())
    # within reach of the whole prior, but not of friction alone
    found = run(tmp_path, 1.13 * measured("table8-1"), 100.0)
    assert found.assessments[0].reached
    assert not found.assessments[0].reached_fixed


def test_nothing_is_simulated_twice(asked: list[rf.BendingTest], tmp_path: Path) -> None:
    first = run(tmp_path, measured("table8-1"), measured("table8-2"))
    assert len(asked) == 2 * (16 + 1)  # the design, and the best point, for both stalks
    again = run(tmp_path, measured("table8-1"), measured("table8-2"))
    assert len(asked) == 34
    pd.testing.assert_frame_equal(
        first.table(first.assessments[0]), again.table(again.assessments[0])
    )


def test_folder_has_tables_figures_and_report(done: Validation, tmp_path: Path) -> None:
    out = rf.write_folder(done, tmp_path / "out")
    predictions = pd.read_csv(out / "predictions.csv")
    assert predictions["observation"].tolist() == ["thick", "thin"]
    assert len(pd.read_csv(out / "runs.csv")) == 32
    factors = pd.read_csv(out / "factors.csv").set_index("factor")
    assert factors.loc["r", "nuisance"]
    assert (factors["low"] >= factors["prior_low"]).all()
    summary, page = check_folder(out)
    assert summary["simulations"] == 32
    assert set(summary["specifications"]) == {"thick", "thin"}
    assert len(page.sources) == 2
    check_print(done, "P L / 4 W", "1 of 1 measurements agree")


def test_the_shipped_study_states_what_was_published() -> None:
    study = read_validation("published")
    text = {name: value.value for name, value in printed_values().items()}
    seen = {observation.name: observation for observation in study.observations}
    for height in (19, 69, 119):
        observation = seen[f"{height} cm"]
        assert observation.measured == text[f"max_force_{height}cm_N"]
        error = text[f"max_force_sd_{height}cm_N"] / math.sqrt(text["specimens_per_position"])
        assert observation.error == pytest.approx(error, abs=6e-4)
        assert observation.baseline == f"height-{height}cm"
    for row in rf.published_table(8).itertuples():
        observation = seen[f"Table 8, {row.outer_diameter_mm} mm"]
        assert observation.measured == row.measured_force_N
        assert observation.published == row.simulated_force_N
        assert observation.error == text["max_force_sd_69cm_N"]
    assert all(len(split.on) == 1 for split in study.splits)  # calibrated at one height only


BAD = {
    "on unknown": (
        'on = ["thick"]',
        'on = ["thicker"]',
        "'thicker' must be one of 'thick', 'thin'",
    ),
    "predicts itself": (
        'on = ["thick"]',
        'on = ["thick"]\npredict = ["thick"]',
        "must not also be calibrated on",
    ),
    "nuisance unknown": ('nuisance = ["r"]', 'nuisance = ["q"]', "'q' must be one of 'mu', 'r'"),
    "no measurement": ("measured = 80.0\n", "", "must be given if there is no dataset"),
    "no error": ("error = 0.05\n", "", "must be given if and only if there is a target"),
    "twice": ('name = "thin"', 'name = "thick"', "'thick' must not occur twice"),
    "scale": ('scale = "log"', 'scale = "odd"', "scale = 'odd' must be one of"),
    "key": ('"fixture.indenter_radius_mm"', '"fixture.radius"', "'fixture.radius' must be the key"),
    "title": ('title = "thin from thick"', 'title = ""', "title = '' must be text that is not"),
    "on twice": ('on = ["thick"]', 'on = ["thick", "thick"]', "'thick' must not occur twice"),
    "a text": ('on = ["thick"]', 'on = "thick"', "on = 'thick' must be a list, on = ["),
    "a number": ("measured = 80.0", 'measured = "a"', "measured = 'a' must be a finite number"),
    "name": ('name = "thick"', "name = 3", "name = 3 must be text"),
    "few runs": ("runs = 16", "runs = 5", "must be more than the 6 terms of the quadratic model"),
    "taken": ('name = "mu"', 'name = "ending"', "'ending' must not be one of"),
    "response": ("nuisance", 'response = "force_99mm_N"\nnuisance', "within the travel of 14 mm"),
    "aliases": (
        'kind = "sobol"\nruns = 16',
        'kind = "plackett_burman"\n[[factors]]\nname = "c"\n'
        'keys = ["fixture.support_radius_mm"]\nlow = 4.0\nhigh = 6.0\n',
        "must be more than",
    ),
    "unknown field": ("published = 90.0", "publisht = 90.0", "nearest known one is 'published'"),
}


@pytest.mark.parametrize("case", BAD)
def test_bad_studies_end_with_one_sentence(
    case: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    asked: list[rf.BendingTest],
) -> None:
    old, new, sentence = BAD[case]
    text = STUDY.format(thick=80.0, thin=70.0)
    assert old in text
    (tmp_path / "bad.toml").write_text(text.replace(old, new, 1))
    out = tmp_path / "out"
    command = ["ramiefenics", "validate", str(tmp_path / "bad.toml"), "--out", str(out)]
    monkeypatch.setattr(sys, "argv", command)
    with pytest.raises(SystemExit) as stopped:
        main()
    assert stopped.value.code == 2
    told = capsys.readouterr().err
    assert sentence in told
    assert "Traceback" not in told
    assert not out.exists()
    assert not asked

"""Prediction of what tests could show, for stalks with a closed-form force and random curves."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from folders import check_folder, check_print
from formula import Formula
from typer.testing import CliRunner

import ramiefenics as rf
from ramiefenics.cli import app
from ramiefenics.discovery.curves.blocks import Blocks
from ramiefenics.discovery.curves.observed import Observed
from ramiefenics.discovery.curves.prediction import Predictor
from ramiefenics.discovery.planning.plan import planned
from ramiefenics.discovery.planning.power import Design, power, predicted_evidence, repeated
from ramiefenics.discovery.statistics.bootstrap import p_value_of_effect
from ramiefenics.discovery.statistics.fit_scatter import fit_scatter
from ramiefenics.discovery.statistics.scatter import Scatter
from ramiefenics.discovery.statistics.verdict import SIGNIFICANCE
from ramiefenics.runs import Done
from ramiefenics.runs.curve import CurveTask

NAMES = ("seating_gap", "machine_compliance", "span_error", "fixture_radius", "load_scale")
EFFECTS = {name: rf.EFFECTS[name] for name in NAMES}


@pytest.fixture(scope="module")
def plan() -> rf.Plan:
    return rf.plan(rf.published_test("table3"), None, Design(), EFFECTS, Formula())


def test_a_second_span_finds_a_smaller_error_of_the_span(plan: rf.Plan) -> None:
    alone, shorter = plan.powers["alone"], plan.powers["fixture.span_mm=70"]
    assert shorter.smallest["span_error"] < 0.5 * alone.smallest["span_error"]
    # other moduli imitate a scale of all forces on any span
    assert alone.smallest["load_scale"] > 0.2
    assert shorter.smallest["load_scale"] > 0.2
    assert plan.next_experiment in plan.powers
    assert plan.powers[plan.next_experiment].told_apart >= alone.told_apart


def test_a_plan_is_written_and_printed(plan: rf.Plan, tmp_path: Path) -> None:
    rf.write_folder(plan, tmp_path / "plan")
    numbers, _ = check_folder(tmp_path / "plan", "plan.json")
    assert set(numbers["smallest"]["alone"]) == set(NAMES)
    assert numbers["units"]["seating_gap"] == "mm"
    check_print(plan, "tells", "seating_gap")


def test_what_more_stalks_and_better_moduli_do(plan: rf.Plan) -> None:
    """The smallest effect falls at most with the square root of the number of stalks."""
    few = plan.alone.smallest
    more = rf.plan(plan.test, [], Design(stalks=32), EFFECTS, Formula()).alone.smallest
    known = rf.plan(plan.test, [], Design(fit_sd=0.02), EFFECTS, Formula()).alone.smallest
    assert not np.isfinite(few["load_scale"])  # other moduli imitate it within its bounds
    for name in ("seating_gap", "machine_compliance"):
        assert 0.49 * few[name] < more[name] <= few[name]
        assert known[name] <= few[name]
    assert known["load_scale"] < 0.1


def test_effects_without_meaning_are_left_out() -> None:
    solid = rf.override(rf.published_test("table3"), ["stalk.void_diameter_mm=0"])
    names = ("seating_gap", "eccentric_void")
    found = rf.plan(solid, [], Design(), {n: rf.EFFECTS[n] for n in names}, Formula())
    assert list(found.alone.smallest) == ["seating_gap"]


class Short(Formula):
    """Stalks whose void closes at 9 mm if the span is short; counts the curves asked for."""

    def map(self, tasks: Sequence[CurveTask]) -> list[Done[pd.DataFrame]]:
        self.asked += len(tasks)
        return super().map(tasks)

    def _curve(self, task: CurveTask) -> pd.DataFrame:
        curve = super()._curve(task)
        short = task.test.fixture.span_mm < 80.0
        return curve[curve["displacement_mm"] <= 9.0] if short else curve


def test_a_travel_that_is_not_reached_is_refused_before_effects_are_simulated() -> None:
    runs, told = Short(), r"protocol\.travel_mm = 14\.0 .* ends at 9\.00 mm"
    with pytest.raises(rf.SpecificationError, match=told):
        rf.plan(rf.published_test("table3"), [["fixture.span_mm=70"]], Design(), EFFECTS, runs)
    assert runs.asked == 2


@pytest.mark.parametrize(
    ("options", "told"),
    [
        (["--stalks", "1"], "stalks = 1 must be"),
        (["--noise", "0"], "noise = 0.0 must be a number above 0"),
        (["--also", "fixture.spam_mm=70"], "spam_mm"),
        (["--suspect", "gap"], "gap"),
    ],
)
def test_bad_plans_are_refused(options: list[str], told: str, tmp_path: Path) -> None:
    out = tmp_path / "plan"
    done = CliRunner().invoke(app, ["plan", "table3", "--out", str(out), *options])
    assert isinstance(done.exception, rf.SpecificationError)
    assert told in str(done.exception)
    assert not out.exists()


@pytest.mark.slow
@pytest.mark.parametrize("name", ["seating_gap", "machine_compliance", "span_error"])
def test_the_promised_power_is_kept(name: str) -> None:
    """An effect to be found in 95 % of data sets is found in at least 33 of 40 (binomial)."""
    design = Design(stalks=8, fit_sd=0.1, noise_length=0.04)
    one = predicted_evidence([rf.published_test("table3")], EFFECTS, design.fit_sd, Formula())
    evidence = repeated(one, [0], design.stalks)
    amplitude = power(evidence, design).smallest[name]
    true = Scatter((design.own,) * 4, design.noise, design.noise_length, design.drift)
    found = 0
    for seed in range(40):
        rng = np.random.default_rng(seed)
        drawn = evidence.blocks.curves(evidence.draw(true, 1, rng))[:, 0]
        residual = drawn + amplitude * evidence.suspects[name].signature
        measured = replace(evidence, residual=residual)
        found += p_value_of_effect(measured, fit_scatter(measured), rng) < SIGNIFICANCE
    assert found >= 33


def test_a_single_suspect_has_a_table_of_cosines_without_rows() -> None:
    one = {"seating_gap": EFFECTS["seating_gap"]}
    found = rf.plan(rf.published_test("table3"), [], Design(), one, Formula())
    table = found.tables()["cosines"].data
    assert list(table) == ["tests", "effect", "other", "cosine"]
    assert table.empty


def test_known_changes_by_finer_meshes_are_not_simulated_again() -> None:
    meshes = set()

    class Recording(Formula):
        def map(self, tasks: Sequence[CurveTask]) -> list[Done[pd.DataFrame]]:
            meshes.update(task.test.numerics.mesh for task in tasks)
            return super().map(tasks)

    test, gap = rf.published_test("table3"), {"seating_gap": EFFECTS["seating_gap"]}
    at = test.protocol.travel_mm * np.linspace(0.1, 1.0, 10)[None]
    nothing = Observed(at, np.zeros_like(at), np.ones(1), Blocks.of(["A"], at.size))
    known = Predictor([test], nothing, Formula()).mesh_changes
    shorter = [["fixture.span_mm=70"]]
    found = planned(test, shorter, Design(), gap, Recording(), known)
    assert meshes == {test.numerics.mesh}
    # the changes are interpolated between ten displacements
    expected = rf.plan(test, shorter, Design(), gap, Formula()).alone.smallest
    assert found.alone.smallest == pytest.approx(expected, rel=0.01)

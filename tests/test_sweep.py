"""Sweeps: all combinations, simulated once each, with table and figures."""

from __future__ import annotations

import sys
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from folders import check_folder, check_print

import ramiefenics as rf
from ramiefenics.cli import main
from ramiefenics.runs import simulation
from ramiefenics.sweep import values_by_key, values_of

pytestmark = pytest.mark.filterwarnings("ignore::ramiefenics.SpecificationWarning")


def with_energies(result: rf.BendingResult, work_Nmm: float = 0.0) -> rf.BendingResult:
    """Add what a real curve has: energies, here none but the indenter's work, and an open void."""
    none = ("void_force_N", "stored_energy_Nmm", "friction_work_Nmm", "dissipated_Nmm")
    work = work_Nmm * result.curve["displacement_mm"]
    curve = result.curve.assign(**dict.fromkeys(none, 0.0), indenter_work_Nmm=work)
    return replace(result, curve=curve)


@pytest.fixture
def computed(
    monkeypatch: pytest.MonkeyPatch, as_result: Callable[..., rf.BendingResult]
) -> list[rf.BendingTest]:
    """List of simulated tests; the force peaks half-way, at the ratio of radius to span."""
    asked: list[rf.BendingTest] = []

    def simulate(test: rf.BendingTest, *_: object) -> rf.BendingResult:
        asked.append(test)
        x = np.linspace(0.0, test.protocol.travel_mm, 15)
        peak = test.fixture.indenter_radius_mm / test.fixture.span_mm
        return with_energies(as_result(test, x, peak * np.sin(np.pi * x / x[-1])))

    monkeypatch.setattr(simulation, "simulate", simulate)
    return asked


def test_all_combinations_are_simulated_once(
    coarse: rf.BendingTest, computed: list[rf.BendingTest], tmp_path: Path
) -> None:
    values = {"fixture.indenter_radius_mm": (4.0, 5.0, 8.0), "fixture.span_mm": (80.0, 100.0)}
    with ThreadPoolExecutor(1) as pool:
        found = rf.sweep(coarse, values, runs=rf.Runs(tmp_path / "kept", pool))
        again = rf.sweep(coarse, values, runs=rf.Runs(tmp_path / "kept", pool))
    assert len(computed) == 6
    assert again.runs.equals(found.runs)
    radius, span = (found.runs[key] for key in values)
    assert {*zip(radius, span, strict=True)} == {(r, s) for r in (4, 5, 8) for s in (80, 100)}
    one = {"fixture.indenter_radius_mm": 8.0, "fixture.span_mm": 80.0, "displacement_mm": 1.5}
    assert found.to_xarray().sel(one) == pytest.approx(8.0 / 80.0 * np.sin(np.pi / 2.0))
    assert found.runs["max_force_N"].to_numpy() == pytest.approx((radius / span).to_numpy())
    assert found.completed
    check_print(found, "0.1 N (indenter_radius_mm = 8.0, span_mm = 80.0)")
    rf.write_folder(found, tmp_path / "found")
    check_folder(tmp_path / "found")
    assert {path.name for path in (tmp_path / "found").glob("*.png")} == {
        "curves.png",
        "max_force.png",
    }


def test_title_and_findings_name_only_what_varies(
    coarse: rf.BendingTest, computed: list[rf.BendingTest], tmp_path: Path
) -> None:
    values = {
        "fixture.indenter_radius_mm": (4.0, 5.0),
        "fixture.span_mm": (80.0,),
        "protocol.travel_mm": (12.0,),
    }
    with ThreadPoolExecutor(1) as pool:
        found = rf.sweep(coarse, values, runs=rf.Runs(tmp_path, pool))
    assert found.title == "Sweep over indenter_radius_mm, 2 runs"
    assert "N (indenter_radius_mm = 5.0)" in found.findings()[0]
    assert "max_force" in found.figures()
    assert found.to_xarray().dims == (*values, "displacement_mm")
    assert not found.runs["still_rising"].any()


def test_both_keys_share_one_legend(
    coarse: rf.BendingTest, computed: list[rf.BendingTest], tmp_path: Path
) -> None:
    values = {"fixture.indenter_radius_mm": (4.0, 5.0), "fixture.span_mm": (80.0, 100.0)}
    with ThreadPoolExecutor(1) as pool:
        found = rf.sweep(coarse, values, runs=rf.Runs(tmp_path, pool))
    (legend,) = found.plot("curves").legends
    texts = [text.get_text() for text in legend.get_texts()]
    assert texts == ["Indenter radius (mm)", "4", "5", "Span (mm)", "80", "100"]


def test_same_keys_of_two_layers_are_told_apart(
    coarse: rf.BendingTest, computed: list[rf.BendingTest], tmp_path: Path
) -> None:
    key = "stalk.layers.{}.material.elastic.E_Z_MPa"
    values = {key.format("phloem"): (1500.0, 1600.0), key.format("xylem"): (400.0, 500.0)}
    with ThreadPoolExecutor(1) as pool:
        found = rf.sweep(coarse, values, runs=rf.Runs(tmp_path, pool))
    short = [f"{layer}.material.elastic.E_Z_MPa" for layer in ("phloem", "xylem")]
    assert found.title == f"Sweep over {short[0]} and {short[1]}, 4 runs"
    assert list(found.overview())[:2] == short
    entries = [text.get_text() for text in found.plot("max_force").legends[0].get_texts()]
    assert "E Z (MPa), xylem.material.elastic" in entries
    assert found.plot("max_force").axes[0].get_xlabel().endswith("phloem.material.elastic")


def test_forces_that_still_rise_and_notes_of_runs_are_told(
    coarse: rf.BendingTest,
    as_result: Callable[..., rf.BendingResult],
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
) -> None:
    def simulate(test: rf.BendingTest, *_: object) -> rf.BendingResult:
        x, radius = np.linspace(0.0, 8.0, 15), test.fixture.indenter_radius_mm
        force = radius * (x if radius > 4.0 else np.sin(0.3 * x))
        return with_energies(as_result(test, x, force), 10.0 * radius)

    monkeypatch.setattr(simulation, "simulate", simulate)
    values = {"fixture.indenter_radius_mm": (4.0, 5.0, 6.0)}
    with ThreadPoolExecutor(1) as pool:
        found = rf.sweep(coarse, values, runs=rf.Runs(tmp_path / "runs", pool))
    assert found.runs["still_rising"].tolist() == [False, True, True]
    assert found.findings()[1].startswith("In 2 of 3 runs the force still rises at the end")
    (note,) = [text for text in found.notes() if "work differs" in text]
    assert note.startswith("indenter_radius_mm = 4.0: the indenter's work differs by ")
    assert note.endswith("(alike in all other runs)")


def test_a_key_is_given_once(coarse: rf.BendingTest, computed: list[rf.BendingTest]) -> None:
    with pytest.raises(rf.SpecificationError, match="must not be given twice; list all values"):
        values_by_key(["fixture.span_mm=80,90", "fixture.span_mm=100"])
    both = {"fixture.span_mm": (80.0, 90.0), "span_mm": (100.0,)}
    with pytest.raises(rf.SpecificationError, match=r"fixture\.span_mm is the same key"):
        rf.sweep(coarse, both)
    assert not computed


def test_amplitudes_of_effects_are_varied_too(
    coarse: rf.BendingTest, computed: list[rf.BendingTest], tmp_path: Path
) -> None:
    gap, taper = rf.EFFECTS["seating_gap"], rf.EFFECTS["taper"]
    with ThreadPoolExecutor(1) as pool:
        found = rf.sweep(
            coarse,
            {"span_mm": (80.0, 100.0)},
            [(gap, (0.0, 0.3)), (taper, (0.01,))],
            runs=rf.Runs(tmp_path, pool),
        )
    assert len(computed) == 4
    assert found.runs["seating_gap"].tolist() == [0.0, 0.3, 0.0, 0.3]
    assert {run.result.test.stalk.taper for run in found.done if run} == {0.01}
    assert found.keys == ["span_mm", "seating_gap"]
    (legend,) = found.plot("max_force").legends
    assert legend.get_texts()[0].get_text() == "Seating gap (mm)"
    with pytest.raises(rf.SpecificationError, match="must not be given twice"):
        rf.sweep(coarse, effects=[(gap, (0.1,)), (gap, (0.2,))])
    with pytest.raises(rf.SpecificationError, match="effect seating_gap = 9"):
        rf.sweep(coarse, effects=[(gap, (0.1, 9.0))])


def test_what_fails_or_ends_early_is_told(
    coarse: rf.BendingTest, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    def simulate(test: rf.BendingTest, *_: object) -> rf.BendingResult:
        raise rf.SpecificationError("stalk", 1, "must be another one")

    monkeypatch.setattr(simulation, "simulate", simulate)
    with ThreadPoolExecutor(1) as pool:
        found = rf.sweep(coarse, {"law": ("svk", "neo_hookean")}, runs=rf.Runs(tmp_path, pool))
    assert not found.completed
    assert found.findings() == ["No run has a force maximum."]
    assert found.notes()[0].startswith("law = svk: failed: stalk = 1 must be another one")
    rf.write_folder(found, tmp_path / "found")
    check_folder(tmp_path / "found")


@pytest.mark.parametrize(
    ("text", "values"),
    [
        ("a.b=2.5:15:6", (2.5, 5.0, 7.5, 10.0, 12.5, 15.0)),
        ("a=1,2", (1, 2)),
        ("a= svk , neo_hookean ", ("svk", "neo_hookean")),
        ("a=0.1:0.3:3", (0.1, 0.2, 0.3)),
    ],
)
def test_values_of(text: str, values: tuple[object, ...]) -> None:
    key, found = values_of(text)
    assert key == text.partition("=")[0]
    assert found == values


@pytest.mark.parametrize(
    ("assignment", "message"),
    [
        ("fixture.span_mm", "must be of the form key=low:high:number"),
        ("fixture.span_mm=1:2", "must be low:high:number"),
        ("fixture.span_mm=1:2:3:4", "must be low:high:number"),
        ("fixture.span_mm=1:nan:3", "must be low:high:number"),
        ("fixture.span_mm=1:2:1", "must be low:high:number"),
        ("fixture.spam_mm=1,2", "is an unknown key; the nearest known one is 'span_mm'"),
        ("fixture.span_mm=90,900", "must be below the specimen's length"),
    ],
)
def test_bad_values_end_with_one_sentence(
    assignment: str,
    message: str,
    tmp_path: Path,
    computed: list[rf.BendingTest],
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    out = tmp_path / "out"
    command = ["ramiefenics", "sweep", "height-69cm", "--set", assignment, "--out", str(out)]
    monkeypatch.setattr(sys, "argv", command)
    with pytest.raises(SystemExit) as ending:
        main()
    assert ending.value.code == 2
    error = capsys.readouterr().err.strip().splitlines()
    assert message in error[-1]
    assert not computed
    assert not out.exists()

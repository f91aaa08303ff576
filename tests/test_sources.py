"""Specifications by names, files and short keys."""

from __future__ import annotations

import warnings
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from formula import Formula
from mpi4py import MPI
from typer.testing import CliRunner

import ramiefenics as rf
from ramiefenics.cli import app
from ramiefenics.specification.files import dump_test

pytestmark = pytest.mark.filterwarnings("ignore::ramiefenics.SpecificationWarning")


class Quantity:
    """Stand-in for one of Pint's quantities, a length in metres."""

    def __init__(self, magnitude: float) -> None:
        self.magnitude = magnitude

    def to(self, unit: str) -> Quantity:
        return Quantity(self.magnitude * {"mm": 1e3, "m": 1.0}[unit])


def test_names_files_and_specifications_are_the_same(tmp_path: Path) -> None:
    test = rf.published_test("table3")
    rf.write_test(test, tmp_path / "a.toml")
    assert rf.as_test("table3") == rf.as_test(tmp_path / "a.toml") == rf.as_test(test) == test


def test_short_nested_and_full_changes_are_the_same() -> None:
    full = rf.override(
        rf.published_test("table3"),
        ["fixture.indenter_radius_mm=10", "fixture.friction.static=0.5", "numerics.mesh=fine"],
    )
    static = {"friction": {"static": 0.5}}
    assert rf.as_test("table3", mesh="fine", indenter_radius_mm=10, fixture=static) == full
    assert rf.as_test("table3", mesh="fine", indenter_radius_mm=Quantity(0.01), static=0.5) == full
    phloem = {"layers": {"phloem": {"material": {"elastic": {"E_Z_MPa": 1500.0}}}}}
    changed = rf.as_test("table3", stalk=phloem).stalk.layers[1].material.elastic
    assert changed.E_Z_MPa == 1500.0


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ({"E_Z_MPa": 3.0}, r"ambiguous.*layers\.phloem.*layers\.xylem"),
        ({"radius": 3.0}, "is not the name of any key"),
        ({"indenter_radius_mm": "thick"}, "fixture.indenter_radius_mm = 'thick' must be"),
        ({"speed_mm_per_s": Quantity(1.0)}, "must be a quantity in mm/s"),
    ],
)
def test_bad_changes_end_with_one_sentence(changes: dict[str, Any], told: str) -> None:
    with pytest.raises(rf.SpecificationError, match=told):
        rf.as_test("table3", **changes)


def test_simulate_takes_names_and_changes(coarse: rf.BendingTest) -> None:
    short = rf.override(coarse, ["protocol.travel_mm=0.5"])
    usual = rf.simulate(short, MPI.COMM_SELF)
    same = rf.simulate(coarse, MPI.COMM_SELF, travel_mm=0.5)
    assert same.test == usual.test
    assert same.curve.equals(usual.curve)


def test_the_last_part_of_a_key_is_enough_everywhere(coarse: rf.BendingTest) -> None:
    full = rf.override(coarse, {"fixture.indenter_radius_mm": 10.0, "numerics.mesh": "fine"})
    assert rf.as_test(coarse, indenter_radius_mm=10.0, mesh="fine") == full
    assert rf.override(coarse, {"indenter_radius_mm": 10.0, "mesh": "fine"}) == full
    assert rf.override(coarse, ["indenter_radius_mm=10.0", "mesh=fine"]) == full
    stiff = "material.elastic.E_Z_MPa=1500"
    assert rf.override(coarse, [f"phloem.{stiff}", "friction.static=0.6"]) == rf.override(
        coarse, [f"stalk.layers.phloem.{stiff}", "fixture.friction.static=0.6"]
    )
    options = ["--mesh", "screening", "--set", "span_mm=80"]
    told = CliRunner().invoke(app, ["specification", "table3", *options]).stdout
    assert "span_mm = 80" in told


@pytest.mark.parametrize(
    ("name", "told"),
    [
        ("E_Z_MPa", r"E_Z_MPa = 3.0 is ambiguous; .*layers\.phloem.*layers\.xylem"),
        ("indenter_radus_mm", "is not the name of any key; the nearest is 'indenter_radius_mm'"),
        ("zzz", r"zzz = 3.0 is not the name of any key\.$"),
    ],
)
def test_the_same_is_told_wherever_the_last_part_of_a_key_is_wrong(
    coarse: rf.BendingTest, name: str, told: str
) -> None:
    for refused in (
        lambda: rf.as_test(coarse, **{name: 3.0}),
        lambda: rf.override(coarse, {name: 3.0}),
        lambda: rf.override(coarse, [f"{name}=3.0"]),
        lambda: rf.sweep(coarse, {name: [3.0]}),
    ):
        with pytest.raises(rf.SpecificationError, match=told):
            refused()


def test_the_nearest_whole_key_is_told(coarse: rf.BendingTest) -> None:
    with pytest.raises(rf.SpecificationError, match=r"the nearest is 'fixture\.span_mm'"):
        rf.override(coarse, ["fixtur.span_mm=80"])


def test_studies_take_changes(coarse: rf.BendingTest, tmp_path: Path) -> None:
    values = {"indenter_radius_mm": [4.0, 5.0]}
    with ThreadPoolExecutor(1) as pool:
        swept = rf.sweep(
            coarse, values, runs=rf.Runs(tmp_path, pool), travel_mm=0.8, support_radius_mm=6.0
        )
    assert swept.test == rf.as_test(coarse, travel_mm=0.8, support_radius_mm=6.0)
    assert swept.runs["indenter_radius_mm"].tolist() == [4.0, 5.0]
    assert swept.runs["max_force_N"].is_unique
    effects = {"span_error": rf.EFFECTS["span_error"]}
    plan = rf.plan("table3", [], None, effects, Formula(), support_radius_mm=6.0)
    assert plan.test.fixture.support_radius_mm == 6.0
    curve = rf.sensitivities(coarse, {}, MPI.COMM_SELF, travel_mm=0.2).curve
    assert curve["displacement_mm"].iloc[-1] == 0.2


def test_a_specification_is_written_by_name_and_with_changes(tmp_path: Path) -> None:
    rf.write_test("table3", tmp_path / "a.toml", mesh="fine", span_mm=80)
    assert rf.read_test(tmp_path / "a.toml") == rf.as_test("table3", mesh="fine", span_mm=80)


def test_a_warning_names_the_line_that_led_to_it(coarse: rf.BendingTest, tmp_path: Path) -> None:
    file = tmp_path / "a.toml"
    file.write_text(dump_test(coarse).replace("static = 0.59\n", ""))
    elastic = rf.Elastic(40.0, 2000.0, 0.3, 0.01, 100.0)
    for doubtful in (
        lambda: rf.as_test("table3", mesh="fine"),
        lambda: rf.as_test(file),
        lambda: rf.read_test(file),
        lambda: rf.write_test("table3", tmp_path / "b.toml"),
        lambda: replace(elastic, G_XY_MPa=40.0),
    ):
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            doubtful()
        assert caught
        assert {warning.filename for warning in caught} == {__file__}

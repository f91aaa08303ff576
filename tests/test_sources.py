"""Specifications by names, files and short keys."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from mpi4py import MPI

import ramiefenics as rf

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

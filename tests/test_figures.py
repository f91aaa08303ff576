"""Figures of results, compared with pictures; `pytest --mpl-generate-path` makes new ones."""

from __future__ import annotations

import functools
from collections.abc import Callable

import numpy as np
import pytest
from conftest import Simulate
from formula import Formula
from matplotlib.figure import Figure

import ramiefenics as rf
from ramiefenics.discovery.synthetic import Secret, make_dataset

TRAVEL = np.linspace(0.0, 14.0, 29)

# Differences from the reference (rms of 8-bit colours). Curves: 6 without the ring at the maximum,
# 24 without the text, 42 with forces larger by 1.2 %. Sections: 9 without the indenter's line or
# with another title. Stalks: 11 with cylinders of 4.5 mm instead of 5 mm or 1 mm off, 15 without
# one of them. Only different rendering of letters and edges should stay below 5.
pictured = functools.partial(
    pytest.mark.mpl_image_compare, style="default", savefig_kwargs={"dpi": 50}, tolerance=5
)


@pictured()
def test_curve_with_a_maximum(
    screening: rf.BendingTest, as_result: Callable[..., rf.BendingResult]
) -> Figure:
    return rf.curve_figure(as_result(screening, TRAVEL, 84.0 * np.sin(np.pi * TRAVEL / 20.0)))


@pictured()
def test_curve_that_ends_before(
    screening: rf.BendingTest, as_result: Callable[..., rf.BendingResult]
) -> Figure:
    half = TRAVEL[:15]
    return rf.curve_figure(as_result(screening, half, 84.0 * np.sin(np.pi * half / 20.0)))


FIXTURES = {
    "four_point": ["fixture.inner_span_mm=40"],
    "off_centre": ["fixture.indenter_offset_mm=25", "numerics.domain=half"],
    "plates": [
        *("fixture.span_mm=0", "fixture.indenter_radius_mm=inf", "fixture.support_radius_mm=inf"),
        *("stalk.length_mm=20", "protocol.travel_mm=1"),
    ],
}


@pytest.fixture(params=FIXTURES)
def pressed(
    request: pytest.FixtureRequest, coarse: rf.BendingTest, simulated: Simulate
) -> rf.BendingResult:
    """A stalk in a fixture other than three-point bending; its numbers are tested elsewhere."""
    return simulated(rf.override(coarse, FIXTURES[request.param]))


@pictured()
def test_section_under_the_indenter(pressed: rf.BendingResult) -> Figure:
    return rf.section_figure(pressed)


@pictured()
def test_stalk_between_its_cylinders(pressed: rf.BendingResult) -> Figure:
    return rf.deformed_figure(pressed)


@pytest.fixture(scope="module")
def found(tmp_path_factory: pytest.TempPathFactory) -> rf.Discovery:
    """Discovery of a gap in stalks with a closed-form force; its numbers are tested elsewhere."""
    folder = tmp_path_factory.mktemp("gap") / "data"
    make_dataset(folder, Secret(rf.EFFECTS["seating_gap"], 0.5), 22, Formula())
    tried = {name: rf.EFFECTS[name] for name in ("machine_compliance", "seating_gap")}
    return rf.discover(folder, tried, runs=Formula())


@pictured()
@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::ramiefenics.SpecificationWarning")
@pytest.mark.parametrize("name", ["residual", "suspects", "sets", "alike", "gain", "left_out"])
def test_what_is_wrong(found: rf.Discovery, name: str) -> Figure:
    return found.figures()[name].draw()

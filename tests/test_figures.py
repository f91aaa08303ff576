"""Figures of results against reference pictures; `pytest --mpl-generate-path` makes new ones."""

from __future__ import annotations

import functools
from collections.abc import Callable

import numpy as np
import pytest
from matplotlib.figure import Figure

import ramiefenics as rf

TRAVEL = np.linspace(0.0, 14.0, 29)

# Differences (rms of 8-bit colours): without the ring at the maximum 6, without the text 24, with
# forces larger by 1.2 % 42. Nothing but another rendering of letters is to be below 5.
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

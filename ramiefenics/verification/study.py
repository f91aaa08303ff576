"""Result of a verification study: claims with their limits, a table, a plot."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

Array = NDArray[np.floating[Any]]

DATA = Path(__file__).parent / "data"
"""Folder with results of other codes."""


@dataclass(frozen=True)
class Check:
    """A claim that either holds or fails.

    Attributes
    ----------
    what
        Claim.
    value
        Value that was found.
    low, high
        Limits between which the value must lie.
    why
        Reason for these limits.
    """

    what: str
    value: float
    low: float
    high: float
    why: str

    @property
    def passed(self) -> bool:
        """Whether the claim holds."""
        return self.low <= self.value <= self.high

    @property
    def limits(self) -> str:
        """The limits in words."""
        if math.isinf(self.low):
            return f"at most {self.high:.4g}"
        if math.isinf(self.high):
            return f"at least {self.low:.4g}"
        return f"{self.low:.6g} to {self.high:.6g}"


def near(what: str, value: float, expected: float, share: float, why: str) -> Check:
    """Return a check that a value differs from an expected one by at most a share of it."""
    width = share * abs(expected)
    return Check(what, value, expected - width, expected + width, why)


def at_most(what: str, value: float, high: float, why: str) -> Check:
    """Return a check that a value is not above a limit."""
    return Check(what, value, -math.inf, high, why)


def at_least(what: str, value: float, low: float, why: str) -> Check:
    """Return a check that a value is not below a limit."""
    return Check(what, value, low, math.inf, why)


@dataclass(frozen=True)
class Series:
    """One series of a plot.

    Attributes
    ----------
    label
        Label in the legend.
    x, y
        Coordinates, shape (n,).
    points
        Whether to draw markers only; otherwise a line is drawn.
    slope
        Slope that theory gives in a logarithmic plot; a line of it is drawn through the last point.
    """

    label: str
    x: Sequence[float] | Array | pd.Series[Any]
    y: Sequence[float] | Array | pd.Series[Any]
    points: bool = False
    slope: float | None = None


@dataclass(frozen=True)
class Plot:
    """Contents of a plot.

    Attributes
    ----------
    x_label, y_label
        Labels of the axes, with units.
    series
        Series to draw.
    log
        Whether both axes are logarithmic.
    note
        Text above the plot.
    """

    x_label: str
    y_label: str
    series: tuple[Series, ...]
    log: bool = False
    note: str = ""


@dataclass(frozen=True)
class Study:
    """A finished study.

    Attributes
    ----------
    title
        Heading.
    text
        The problem, its solution and their sources, in Markdown.
    checks
        Claims of the study.
    table
        Numbers, one row per case; column names include the unit.
    plot
        Plot, if the study has one.
    """

    title: str
    text: str
    checks: tuple[Check, ...]
    table: pd.DataFrame = field(default_factory=pd.DataFrame)
    plot: Plot | None = None


def observed_orders(sizes: Sequence[float], errors: Sequence[float]) -> list[float]:
    """Return the observed orders of convergence between successive sizes, shape (n - 1,)."""
    ratios = np.log(np.asarray(errors[:-1]) / np.asarray(errors[1:]))
    return list(ratios / np.log(np.asarray(sizes[:-1]) / np.asarray(sizes[1:])))

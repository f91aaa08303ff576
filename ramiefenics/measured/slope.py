"""Initial slope of a measured curve, and the linear part in which it is determined."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.stats import theilslopes

from ramiefenics.measured.noise import Array, level

BINS = 60
"""Number of equidistant displacements to which the rise of a curve is reduced."""

UP_TO = 0.95
"""Share of the peak force at which the rise ends, as a plateau may follow."""

LEAST_RISE = 0.2
"""Least rise of the force within a window, as a share of the peak force."""

LEAST_POINTS = 8
"""Least number of points in a window: two for the slope of each quarter."""

AGREEMENT = 0.1
"""Largest relative difference of slopes that count as equal."""

MOST_POINTS = 400
"""Most points that are used within a window; the number of pairs grows with its square."""


@dataclass(frozen=True)
class InitialSlope:
    """A straight line through the first linear part of a curve.

    Attributes
    ----------
    N_per_mm, low_N_per_mm, high_N_per_mm
        Slope and the ends of its 95 % interval, which is too narrow if noise persists over many
        rows.
    from_mm, to_mm
        Ends of the window.
    zero_mm
        Displacement at which the line has no force.
    stable
        Whether the slopes at the window's ends agree with its own. If not, the curve has no linear
        part of the required size, and this is the steep window in which the slopes differ least.
    """

    N_per_mm: float
    low_N_per_mm: float
    high_N_per_mm: float
    from_mm: float
    to_mm: float
    zero_mm: float
    stable: bool


def initial_slope(curve: pd.DataFrame) -> InitialSlope:
    """Fit a line to the first linear part of a curve.

    The rise up to 95 % of the peak is reduced to 60 equidistant displacements. Candidates are all
    windows of at least 8 of them in which the force rises by at least a fifth of its peak, and
    whose least-squares slope is within 10 % of the steepest: this excludes the toe before and the
    softened part after. The longest candidate is taken whose first and last quarters have the same
    slope as the whole, within 10 %. The line in it is that of Theil (1950) and Sen (1968), the
    median of slopes between pairs of points, which tolerates up to 29 % of outliers. Moving a
    window along the record follows ASTM E3076; the criteria are our own.

    Parameters
    ----------
    curve
        ``displacement_mm``, ascending, and ``force_N``, with a peak above 0 N.

    Returns
    -------
    InitialSlope
        Line and window; the slopes are NaN if the record begins near its peak.
    """
    travel, force = curve["displacement_mm"].to_numpy(), curve["force_N"].to_numpy()
    rising = travel[: int(np.argmax(force >= UP_TO * force.max())) + 1]
    if rising[-1] <= rising[0]:  # the record begins near its peak
        start = float(rising[0])
        return InitialSlope(math.nan, math.nan, math.nan, start, start, start, stable=False)
    at, forces = _reduced(curve, float(rising[0]), float(rising[-1]))
    first, last, stable = _window(at, forces, LEAST_RISE * float(force.max()))
    inside = np.flatnonzero((travel >= at[first]) & (travel <= at[last]))
    x, y = travel[inside], force[inside]
    if len(inside) > MOST_POINTS:
        chosen = np.linspace(0, len(inside) - 1, MOST_POINTS).round().astype(int)
        x, y = x[chosen], y[chosen]
    elif len(inside) < 6:
        x, y = at[first : last + 1], forces[first : last + 1]
    slope, intercept, low, high = (float(value) for value in theilslopes(y, x, 0.95))
    zero = -intercept / slope if slope > 0.0 else float(x[0])
    return InitialSlope(slope, low, high, float(at[first]), float(at[last]), zero, stable)


def _reduced(curve: pd.DataFrame, start: float, end: float) -> tuple[Array, Array]:
    at: Array = np.asarray(np.linspace(start, end, BINS), dtype=np.float64)
    half = (end - start) / (BINS - 1) / 2.0
    return at, np.array([level(curve, float(d), half) for d in at])


def _window(at: Array, force: Array, rise: float) -> tuple[int, int, bool]:
    """Return the first and last index of the window, and whether it is stable."""
    sums = np.cumsum([at * 0.0 + 1.0, at, force, at * at, at * force], axis=1)
    sums = np.concatenate([np.zeros((5, 1)), sums], axis=1)
    first, last = np.triu_indices(len(at), LEAST_POINTS - 1)
    quarter = (last + 1 - first) // 4
    whole = _slopes(sums, first, last + 1)
    ends = _slopes(sums, first, first + quarter), _slopes(sums, last + 1 - quarter, last + 1)
    differ = np.max(np.abs(np.array(ends) - whole), axis=0) / np.maximum(whole, 1e-12)
    wide = (whole * (at[last] - at[first]) >= rise) & (whole > 0.0)
    if not wide.any():  # no window has enough of the rise, for instance if the peak comes at once
        return 0, len(at) - 1, False
    steep = wide & (whole >= (1.0 - AGREEMENT) * whole[wide].max())
    stable = steep & (differ <= AGREEMENT)
    if not stable.any():
        least = int(np.argmin(np.where(steep, differ, np.inf)))
        return int(first[least]), int(last[least]), False
    longest = int(np.argmax(np.where(stable, last - first, -1)))
    return int(first[longest]), int(last[longest]), True


def _slopes(sums: Array, first: NDArray[np.intp], end: NDArray[np.intp]) -> Array:
    """Return least-squares slopes of runs of points from their cumulative sums."""
    n, x, y, xx, xy = sums[:, end] - sums[:, first]
    return np.asarray((n * xy - x * y) / np.maximum(n * xx - x * x, 1e-300))

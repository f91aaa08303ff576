"""Noise of measured curves, and forces without it."""

from __future__ import annotations

import math

import numpy as np
import pandas as pd
from numpy.typing import NDArray

Array = NDArray[np.float64]


def level(curve: pd.DataFrame, at_mm: float, half_mm: float) -> float:
    """Return the force at a displacement, N, from a straight line through the points around it.

    If there are few such points, the curve is interpolated.

    Parameters
    ----------
    curve
        ``displacement_mm``, ascending, and ``force_N``.
    at_mm
        Displacement.
    half_mm
        Greatest distance of these points, mm.
    """
    travel, force = curve["displacement_mm"].to_numpy(), curve["force_N"].to_numpy()
    near = np.abs(travel - at_mm) <= half_mm
    if near.sum() >= 4 and np.ptp(travel[near]) > half_mm / 2.0:
        return float(np.polynomial.Polynomial.fit(travel[near] - at_mm, force[near], 1)(0.0))
    return float(np.interp(at_mm, travel, force))


def noise(curve: pd.DataFrame) -> float:
    """Estimate the standard deviation of a curve's noise from row to row, N.

    Every point is compared with the straight line between its neighbours (Gasser, Sroka and
    Jennen-Steinmetz 1986, Eq. 2.3), which needs no model of the curve. The median is used in place
    of the mean square (the standard deviation of Gaussian noise is 1.4826 times its median
    deviation), so that cracks of the specimen have no influence. Noise that persists over many
    rows, as in a filtered signal, is not seen; the estimate is then a lower bound.

    Parameters
    ----------
    curve
        ``displacement_mm``, ascending, and ``force_N``.

    Returns
    -------
    float
        Standard deviation, N; NaN for fewer than three rows.
    """
    travel, force = curve["displacement_mm"].to_numpy(), curve["force_N"].to_numpy()
    if np.median(np.diff(travel)) == 0.0:  # displacement recorded less often than the force
        travel = np.arange(len(travel), dtype=np.float64)
    left, right = np.diff(travel)[:-1], np.diff(travel)[1:]
    told = (left > 0.0) & (right > 0.0)
    if not told.any():
        return math.nan
    before = right[told] / (left[told] + right[told])
    middle = force[1:-1][told] - before * force[:-2][told] - (1.0 - before) * force[2:][told]
    scaled = middle / np.sqrt(1.0 + before**2 + (1.0 - before) ** 2)
    return 1.4826 * float(np.median(np.abs(scaled)))

"""Curves without their noise, and the noise without the curve."""

from __future__ import annotations

import math

import numpy as np
import pandas as pd
from numpy.typing import NDArray

Array = NDArray[np.float64]


def level(curve: pd.DataFrame, at_mm: float, half_mm: float) -> float:
    """Return the force at a displacement, N, by a straight line through the points around it.

    Where these are few, the curve is interpolated.

    Parameters
    ----------
    curve
        ``displacement_mm``, ascending, and ``force_N``.
    at_mm
        Displacement.
    half_mm
        Points count that are as near as this.
    """
    travel, force = curve["displacement_mm"].to_numpy(), curve["force_N"].to_numpy()
    near = np.abs(travel - at_mm) <= half_mm
    if near.sum() >= 4 and np.ptp(travel[near]) > half_mm / 2.0:
        return float(np.polynomial.Polynomial.fit(travel[near] - at_mm, force[near], 1)(0.0))
    return float(np.interp(at_mm, travel, force))


def noise(curve: pd.DataFrame) -> float:
    """Estimate the standard deviation of a curve's noise from row to row, N.

    Every point is compared with the straight line between its neighbours (Gasser, Sroka and
    Jennen-Steinmetz 1986, Eq. 2.3), which needs no model of the curve. The median in place of the
    mean square (1.4826 times the median deviation of Gaussian noise is its standard deviation)
    leaves out where the specimen cracks. Noise that stays the same over many rows, as that of a
    filtered signal, is not seen: it is a lower bound then.

    Parameters
    ----------
    curve
        ``displacement_mm``, ascending, and ``force_N``.

    Returns
    -------
    float
        N; NaN of fewer than three rows.
    """
    travel, force = curve["displacement_mm"].to_numpy(), curve["force_N"].to_numpy()
    if np.median(np.diff(travel)) == 0.0:  # recorded in steps longer than a row
        travel = np.arange(len(travel), dtype=np.float64)
    left, right = np.diff(travel)[:-1], np.diff(travel)[1:]
    told = (left > 0.0) & (right > 0.0)
    if not told.any():
        return math.nan
    before = right[told] / (left[told] + right[told])
    middle = force[1:-1][told] - before * force[:-2][told] - (1.0 - before) * force[2:][told]
    scaled = middle / np.sqrt(1.0 + before**2 + (1.0 - before) ** 2)
    return 1.4826 * float(np.median(np.abs(scaled)))

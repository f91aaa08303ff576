"""Maximum, plateau and slope of a force curve."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

PLATEAU = 0.99
"""Share of the largest force above which a curve is on its plateau."""

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Peak:
    """The largest force of a curve.

    Attributes
    ----------
    force_N, displacement_mm
        The largest force, and the displacement at which it occurs.
    inside
        Whether the force falls again after it; otherwise it is at the end of the curve.
    plateau_mm
        First and last displacement around it at which the force is at least `PLATEAU` times the
        largest. A flat maximum may be anywhere between them.
    step_error_N
        Largest error of linear interpolation between the steps on the plateau, estimated from the
        curvature. Where a jump ends the rise, it is at least the further rise that was possible
        within that step. Steps that are too long make it large.
    """

    force_N: float
    displacement_mm: float
    inside: bool
    plateau_mm: tuple[float, float]
    step_error_N: float


def find_peak(displacement_mm: Array, force_N: Array, jumps_mm: Sequence[float] = ()) -> Peak:
    """Find the maximum of a curve by the parabola through the highest point and its neighbours.

    Parameters
    ----------
    displacement_mm, force_N
        Displacement and force at every step, in ascending order of displacement, shape (n,).
    jumps_mm
        Displacements at the ends of the steps that contain a jump. Next to a jump the highest point
        is the maximum, because a parabola cannot describe both sides of it.
    """
    x, f = np.asarray(displacement_mm, dtype=float), np.asarray(force_N, dtype=float)
    top, jumped = int(f.argmax()), np.isin(x, jumps_mm)
    beside = jumped[top : top + 2].any()
    if beside or not 0 < top < len(f) - 1:
        highest, at = float(f[top]), float(x[top])
    else:
        left, right = np.diff(f[top - 1 : top + 2]) / np.diff(x[top - 1 : top + 2])
        curvature = 2.0 * (right - left) / (x[top + 1] - x[top - 1])
        slope = left + curvature * (x[top] - x[top - 1]) / 2.0
        move = -slope / curvature if curvature < 0.0 else 0.0
        highest, at = float(f[top] + slope * move / 2.0), float(x[top] + move)
    level = PLATEAU * highest
    ends = _crossing(x[top::-1], f[top::-1], level), _crossing(x[top:], f[top:], level)
    return Peak(highest, at, top < len(f) - 1, ends, _straight_error(x, f, jumped, ends))


def _crossing(x: Array, f: Array, level: float) -> float:
    """Return where a curve first falls below a level, or where it ends."""
    below = np.flatnonzero(f < level)
    if len(below) == 0 or below[0] == 0:
        return float(x[-1] if len(below) == 0 else x[0])
    last = int(below[0])
    share = (f[last - 1] - level) / (f[last - 1] - f[last])
    return float(x[last - 1] + share * (x[last] - x[last - 1]))


def _straight_error(
    x: Array, f: Array, jumped: NDArray[np.bool_], plateau_mm: tuple[float, float]
) -> float:
    """Return the largest error of linear interpolation on a plateau, or near the highest point.

    At a point between two steps it is ``length^2 P'' / 8``, with the length of the longer one and
    the second derivative of the force P. Next to a jump it is as described in `Peak`.
    """
    if len(f) < 3:
        return float("nan")
    top, steps = int(f.argmax()), np.diff(x)
    slopes = np.diff(f) / steps
    bends = np.abs(np.diff(slopes)) * 2.0 / (steps[1:] + steps[:-1])
    errors = bends * np.maximum(steps[1:], steps[:-1]) ** 2 / 8.0
    errors[jumped[1:-1] | jumped[2:]] = 0.0
    on_it = (plateau_mm[0] <= x[1:-1]) & (x[1:-1] <= plateau_mm[1])
    on_it[min(max(top, 1), len(f) - 2) - 1] = True
    rise = slopes[top - 1] * steps[top] if 0 < top < len(steps) and jumped[top + 1] else 0.0
    return float(max(errors[on_it].max(), rise))


def secant_slope(displacement_mm: pd.Series[float], force_N: pd.Series[float]) -> float:
    """Return the secant stiffness between 10 and 40 % of the largest force, N/mm.

    It is NaN if the curve does not begin below 10 %.
    """
    peak = int(force_N.to_numpy().argmax())
    force, travel = force_N.iloc[: peak + 1].tolist(), displacement_mm.iloc[: peak + 1].tolist()
    low, high = 0.1 * force[-1], 0.4 * force[-1]
    ends = [_travel_at(force, travel, level) for level in (low, high)]
    return (high - low) / (ends[1] - ends[0]) if ends[1] > ends[0] else float("nan")


def _travel_at(force: list[float], travel: list[float], level: float) -> float:
    """Return the travel at which the force first reaches a level, by linear interpolation.

    It is NaN if the force begins at that level or above.
    """
    if force[0] >= level:
        return float("nan")
    for i in range(1, len(force)):
        if force[i] >= level:
            share = (level - force[i - 1]) / (force[i] - force[i - 1])
            return travel[i - 1] + share * (travel[i] - travel[i - 1])
    return float("nan")

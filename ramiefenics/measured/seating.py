"""Start of a measured curve: gap, toe and preload."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ramiefenics.measured.noise import Array, noise
from ramiefenics.measured.records import LEAST_ROWS
from ramiefenics.measured.slope import initial_slope
from ramiefenics.specification import SpecificationError
from ramiefenics.specification.checks import check_choice, check_number

ZEROS = ("machine", "threshold", "toe")

NOISE_FACTOR = 5.0
"""Largest force that may be noise, over the standard deviation of the noise."""

ROUNDS, POINTS = 3, 21
"""Iterations in the search for a simulated curve's toe, and points on its straight part."""


@dataclass(frozen=True)
class Seating:
    """Where displacement begins.

    Attributes
    ----------
    zero
        ``machine``: at the zero of the machine. ``threshold``: at contact, where the force exceeds
        `threshold_N` for the last time on its way to the peak. ``toe``: where the straight line
        through the first linear part (`initial_slope`) has no force, which is the toe compensation
        of ASTM D790, annex A1; the displacement that a preload took then counts as well.
    threshold_N
        Force at contact; by default five times the curve's noise.
    preload_N
        Force at which the machine's load cell was zeroed, which is added to all forces; 0 if the
        record includes the preload.
    """

    zero: str = "machine"
    threshold_N: float | None = None
    preload_N: float = 0.0

    def __post_init__(self) -> None:
        """Check the choice, and the signs of the forces."""
        check_choice(self, "zero", ZEROS)
        check_number(self, "preload_N", at_least=0.0, unit="N")
        if self.threshold_N is None:
            return
        check_number(self, "threshold_N", above=0.0, unit="N")
        if self.zero != "threshold":
            raise SpecificationError(
                "threshold_N", self.threshold_N, 'must be left out unless zero = "threshold"'
            )


def seat(curve: pd.DataFrame, seating: Seating) -> pd.DataFrame:
    """Return a curve whose displacement begins where `seating` says, without earlier rows.

    Parameters
    ----------
    curve
        ``displacement_mm``, ascending, and ``force_N``.
    seating
        Choice of where displacement begins.

    Raises
    ------
    SpecificationError
        If the force never passes the threshold, the toe is too far before the record, or too few
        rows are left.
    """
    if seating.preload_N > 0.0:
        curve = curve.assign(force_N=curve["force_N"] + seating.preload_N)
    if seating.zero == "machine":
        return curve
    at = _toe(curve) if seating.zero == "toe" else _contact(curve, seating)
    moved = curve.assign(displacement_mm=curve["displacement_mm"] - at)
    moved = moved[moved["displacement_mm"] >= 0.0].reset_index(drop=True)
    if len(moved) < LEAST_ROWS:
        allowed = f"must leave at least {LEAST_ROWS} rows of the curve, but leaves {len(moved)}"
        raise SpecificationError("seating.zero", seating.zero, allowed)
    return moved


def straight_part(curve: pd.DataFrame, seating: Seating) -> tuple[float, float] | None:
    """Return where a seated curve's straight part begins and ends, mm; None if the toe is kept.

    Parameters
    ----------
    curve, seating
        As for `seat`.
    """
    if seating.zero != "toe":
        return None
    found = initial_slope(curve.assign(force_N=curve["force_N"] + seating.preload_N))
    return found.from_mm - found.zero_mm, found.to_mm - found.zero_mm


def toe_mm(
    force_N: Callable[[Array], NDArray[Any]], straight_mm: tuple[float, float] | None
) -> float:
    """Return the length of another curve's toe, mm, for zeroing it like a seated curve.

    The toe ends where the least-squares line through the part that corresponds to the seated
    curve's straight part has no force. It depends as smoothly on parameters as the forces do.

    Parameters
    ----------
    force_N
        Function from displacements, mm, to forces, N.
    straight_mm
        Ends of the seated curve's straight part; None if its toe is kept.
    """
    if straight_mm is None:
        return 0.0
    toe = 0.0
    for _ in range(ROUNDS):
        at = max(toe, 0.0) + np.linspace(*straight_mm, POINTS)  # nothing is touched before
        slope, force = np.polyfit(at - at.mean(), force_N(at), 1)
        if not slope > 0.0:
            allowed = "must leave simulated curves that rise where the measured ones are straight"
            raise SpecificationError("seating.zero", "toe", allowed)
        toe = float(at.mean() - force / slope)
    return toe


def _toe(curve: pd.DataFrame) -> float:
    found = initial_slope(curve)
    if not found.N_per_mm > 0.0:
        allowed = "needs a curve that rises from its start"
        raise SpecificationError("seating.zero", "toe", allowed)
    before = float(curve["displacement_mm"].iloc[0]) - found.zero_mm
    if before > found.to_mm - found.from_mm:
        allowed = (
            "must not precede the record by more than the length of its straight part "
            f"({found.to_mm - found.from_mm:.3g} mm), but does by {before:.3g} mm: the record "
            "begins too late"
        )
        raise SpecificationError("seating.zero", "toe", allowed)
    return found.zero_mm


def _contact(curve: pd.DataFrame, seating: Seating) -> float:
    travel, force = curve["displacement_mm"].to_numpy(), curve["force_N"].to_numpy()
    threshold = NOISE_FACTOR * noise(curve)
    if seating.threshold_N is not None:
        threshold = seating.threshold_N
    peak = int(force.argmax())
    if not force[peak] > threshold:
        allowed = f"must be below the largest force, {force[peak]:.3g} N"
        raise SpecificationError("seating.threshold_N", round(threshold, 6), allowed)
    below = np.flatnonzero(force[:peak] <= threshold)
    if not len(below):
        allowed = (
            f"must be at least the force of the first row, {force[0]:.3g} N, for contact to be "
            'found; zero = "toe" adds the displacement that a preload caused'
        )
        raise SpecificationError("seating.threshold_N", round(threshold, 6), allowed)
    i = int(below[-1])
    share = (threshold - force[i]) / (force[i + 1] - force[i])
    return float(travel[i] + share * (travel[i + 1] - travel[i]))

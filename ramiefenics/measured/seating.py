"""Where a measured curve begins: gap, toe and preload."""

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
"""Times the standard deviation of the noise is a force that is none."""

ROUNDS, POINTS = 3, 21
"""Of the search for a simulated curve's toe; on its straight part."""


@dataclass(frozen=True)
class Seating:
    """Where displacement begins.

    Attributes
    ----------
    zero
        ``machine``: where the machine has it. ``threshold``: at contact, where the force passes
        `threshold_N` for good on its way to the peak. ``toe``: where the straight line through
        the first linear part (`initial_slope`) has no force, which is the toe compensation of
        ASTM D790, annex A1; a preload then counts with the displacement that it took.
    threshold_N
        Force of contact; by default five times the curve's noise.
    preload_N
        Force at which the machine's load cell was zeroed, to be added to all forces; 0 if the
        preload is in the record.
    """

    zero: str = "machine"
    threshold_N: float | None = None
    preload_N: float = 0.0

    def __post_init__(self) -> None:
        """Check the choice and that forces are positive."""
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
    """Return a curve whose displacement begins where `seating` says; rows before are left out.

    Parameters
    ----------
    curve
        ``displacement_mm``, ascending, and ``force_N``.
    seating
        How.

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
    """Return where a seated curve's straight part begins and ends, mm, if its toe is left out.

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
    """Return how far the toe of another curve reaches, that is to be read as a seated one.

    By the least-squares line through what corresponds to the seated curve's straight part. The
    result is as smooth in the forces as these are.

    Parameters
    ----------
    force_N
        From displacements, mm, to forces.
    straight_mm
        Of the seated curve; None if its toe is there.
    """
    if straight_mm is None:
        return 0.0
    toe = 0.0
    for _ in range(ROUNDS):
        at = max(toe, 0.0) + np.linspace(*straight_mm, POINTS)  # before, nothing is touched
        slope, force = np.polyfit(at - at.mean(), force_N(at), 1)
        if not slope > 0.0:
            allowed = "must leave simulated curves that rise where the measured ones are straight"
            raise SpecificationError("seating.zero", "toe", allowed)
        toe = float(at.mean() - force / slope)
    return toe


def _toe(curve: pd.DataFrame) -> float:
    found = initial_slope(curve)
    if not found.N_per_mm > 0.0:
        allowed = "must have a curve that rises from its start on"
        raise SpecificationError("seating.zero", "toe", allowed)
    before = float(curve["displacement_mm"].iloc[0]) - found.zero_mm
    if before > found.to_mm - found.from_mm:
        allowed = (
            f"must be no farther before the record than its straight part is long, but is "
            f"{before:.3g} mm, and that {found.to_mm - found.from_mm:.3g} mm: it begins too late"
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
            'seen; zero = "toe" counts the displacement that a preload took'
        )
        raise SpecificationError("seating.threshold_N", round(threshold, 6), allowed)
    i = int(below[-1])
    share = (threshold - force[i]) / (force[i + 1] - force[i])
    return float(travel[i] + share * (travel[i + 1] - travel[i]))

"""Measured curves reduced to a few points, and predicted curves read in the same way."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass

import numpy as np
import pandas as pd
from scipy.interpolate import Akima1DInterpolator

from ramiefenics.discovery.curves.blocks import Array, Blocks, Integers
from ramiefenics.measured import Dataset
from ramiefenics.measured.noise import level
from ramiefenics.measured.seating import toe_mm
from ramiefenics.specification import BendingTest, SpecificationError

POINTS_OF_A_LINE = 21
"""Number of points of a predicted curve around each displacement to which a line is fitted."""

FURTHER = 1.05
"""Factor by which simulations are lengthened, once or several times, if displacement is recorded
too small; in such steps, so that a small change of its scale needs no new ones."""


@dataclass(frozen=True)
class Observed:
    """Measured curves, reduced to a few points.

    Attributes
    ----------
    at_mm
        Displacements of each of r curves, shape (r, m).
    force_N
        Measured forces at these, shape (r, m).
    peak_N
        Largest measured force of each curve, to which its noise refers, shape (r,).
    blocks
        Which curves belong to the same specimen.
    straight_mm
        Straight part of each curve by which its displacement was zeroed, see `Record`; None, the
        default, where no displacement was zeroed in this way.
    turn_N
        Force at the end of the loading before each curve of unloading, shape (r,); NaN for curves
        of loading. None, the default, where no such force is known.
    """

    at_mm: Array
    force_N: Array
    peak_N: Array
    blocks: Blocks
    straight_mm: tuple[tuple[float, float] | None, ...] | None = None
    turn_N: Array | None = None

    def of(self, rows: Integers) -> Observed:
        """Return some of the curves."""
        blocks = Blocks(self.blocks.specimen[rows], self.blocks.place[rows], self.blocks.points)
        straight = None if self.straight_mm is None else tuple(self.straight_mm[i] for i in rows)
        turn = None if self.turn_N is None else self.turn_N[rows]
        return Observed(
            self.at_mm[rows], self.force_N[rows], self.peak_N[rows], blocks, straight, turn
        )


def observe(dataset: Dataset) -> Observed:
    """Reduce measured curves by a straight line through the points around each displacement.

    Raises
    ------
    SpecificationError
        If a curve begins after the first displacement.
    """
    dataset.check_starts()
    records = dataset.records
    at = np.array([record.at_mm for record in records])
    force = np.array(
        [[level(r.curve, d, _half(own)) for d in own] for r, own in zip(records, at, strict=True)]
    )
    blocks = Blocks.of([record.specimen for record in records], at.shape[1])
    straight = tuple(record.straight_mm for record in records)
    turn = np.full(len(records), np.nan)
    for row in range(1, len(records)):
        if records[row].test.protocol.then:  # it follows its loading
            turn[row] = records[row - 1].curve["force_N"].iloc[-1]
    return Observed(at, force, force.max(axis=1), blocks, straight, turn)


def _half(at_mm: Array) -> float:
    """Return the distance from a displacement up to which points of a curve count, mm."""
    return float(at_mm[1] - at_mm[0]) / 2.0


def read(
    test: BendingTest,
    curve: pd.DataFrame,
    at_mm: Array,
    straight_mm: tuple[float, float] | None = None,
) -> Array:
    """Read the recorded force off a simulated curve as off a measured one, N, shape (m,).

    A straight line is fitted to the points around each displacement; at a kink, such as the end of
    a gap, it does not give the curve's own value. Where the measured displacement begins behind a
    toe (`straight_mm`), so does the simulated one.
    """
    toe = toe_mm(lambda at: recorded(test, curve, at), straight_mm)
    offsets = _half(at_mm) * np.linspace(-1.0, 1.0, POINTS_OF_A_LINE)
    inside = at_mm[:, None] + offsets <= at_mm[-1] + 1e-9
    number = inside.sum(axis=1, keepdims=True)
    middle = (inside * offsets).sum(axis=1, keepdims=True) / number
    around = inside * (offsets - middle)
    weights = inside / number - middle * around / (around**2).sum(axis=1, keepdims=True)
    points = np.minimum(at_mm[:, None] + offsets, at_mm[-1])
    forces = recorded(test, curve, toe + points.ravel()).reshape(points.shape)
    return np.asarray((weights * forces).sum(axis=1))


def far_enough(test: BendingTest, displacement_mm: float) -> BendingTest:
    """Return a test whose travel is long enough for a recorded displacement, mm, to be reached.

    Deflections of the machine, which only add to it, do not count.
    """
    reached = test.machine.displacement_scale * test.protocol.travel_mm
    steps = math.ceil(math.log(displacement_mm / reached) / math.log(FURTHER) - 1e-9)
    if steps <= 0:
        return test
    travel = FURTHER**steps * test.protocol.travel_mm
    protocol = dataclasses.replace(test.protocol, travel_mm=travel, save_every_mm=travel)
    return dataclasses.replace(test, protocol=protocol)


def recorded(test: BendingTest, curve: pd.DataFrame, at_mm: Array) -> Array:
    """Return the recorded force at recorded displacements, N.

    Where only a displacement recorded too small keeps the simulated curve from reaching these, it
    is continued straight on, see `far_enough`.

    Raises
    ------
    SpecificationError
        If the simulated curve ends before these displacements, or if the recorded displacement
        decreases because a compliant machine springs back by more than the indenter advances.
    """
    travel, pressed = curve["displacement_mm"].to_numpy(), curve["force_N"].to_numpy()
    displacement, force = test.machine.recorded(travel, pressed)
    if np.any(np.diff(displacement) <= 0.0):
        names = ("compliance_mm_per_N", "bedding_compliance_mm_per_N")
        worst = max(names, key=lambda name: getattr(test.machine, name))
        allowed = "must be low enough for the recorded displacement to increase throughout"
        raise SpecificationError(f"machine.{worst}", getattr(test.machine, worst), allowed)
    short = at_mm[-1] - displacement[-1]
    if short > 1e-9 and test.machine.displacement_scale < 1.0 and travel[-1] > at_mm[-1] - 1e-9:
        slope = np.diff(force)[-1] / np.diff(displacement)[-1]
        displacement = np.append(displacement, at_mm[-1])
        force = np.append(force, force[-1] + slope * short)
    elif short > 1e-9:
        allowed = f"must be reached, but the simulation ends at {displacement[-1]:.2f} mm"
        raise SpecificationError("displacement_mm", float(at_mm[-1]), allowed)
    inside = np.minimum(at_mm, displacement[-1])
    found = Akima1DInterpolator(displacement, force)(inside)
    return np.where(at_mm <= displacement[0], force[0], found)

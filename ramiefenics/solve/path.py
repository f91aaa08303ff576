"""Path of the drive, leg by leg, as the stepper follows it."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

from ramiefenics.specification import Protocol, Stepping
from ramiefenics.specification.protocol import Leg

FIRST_SHARE, SHORTEST_SHARE, LONGEST_SHARE = 1e-2, 1e-4, 0.2
"""First, shortest and longest step of a hold, as shares of its duration."""

LEAST_REST = 0.25
"""Least share of a step that may remain before fields are saved. If less would remain, the step and
the remainder are divided into two equal steps."""

LONGEST_CUT = 1e-2
"""Upper bound on the shortest step, as a share of the whole path. It lets the steps of short tests
become shorter than the minimum in the settings, which is meant for long tests."""


@dataclass(frozen=True)
class PathSegment:
    """Leg of the path, with a coordinate along it.

    The coordinate is the distance travelled since the start of the leg or, in a hold, the time.

    Attributes
    ----------
    leg
        Ends and duration of the leg.
    start_s
        Time at its start.
    save_every_mm
        Fields are saved at multiples of this travel.
    first, shortest, longest
        Lengths of the first, the shortest and the longest step, mm, or in a hold s.
    is_first, is_last
        Whether it is the first leg, and whether it is the last.
    """

    leg: Leg
    start_s: float
    save_every_mm: float
    first: float
    shortest: float
    longest: float
    is_first: bool
    is_last: bool

    @property
    def holds(self) -> bool:
        """Whether the drive stays where it is."""
        return self.leg.from_mm == self.leg.to_mm

    @property
    def direction(self) -> float:
        """Sign of the travel; 0 in a hold."""
        return 0.0 if self.holds else math.copysign(1.0, self.leg.to_mm - self.leg.from_mm)

    @property
    def length(self) -> float:
        """Coordinate at the end of the leg, mm, or in a hold s."""
        leg = self.leg
        return leg.duration_s if self.holds else abs(leg.to_mm - leg.from_mm)

    def travel_mm(self, at: float) -> float:
        """Return the travel of the drive at a coordinate."""
        return self.leg.from_mm + self.direction * at

    def duration_s(self, length: float) -> float:
        """Return the time that a part of the leg takes, given its length."""
        return self.leg.duration_s * (length / self.length)

    def next_stop(self, at: float) -> float:
        """Return the next coordinate at which fields are saved."""
        if self.holds:
            return self.length
        travel, every = self.travel_mm(at), self.save_every_mm
        if self.direction > 0.0:
            stop = min((int(travel / every + 1e-9) + 1) * every, self.leg.to_mm)
        else:
            stop = max((math.ceil(travel / every - 1e-9) - 1) * every, self.leg.to_mm)
        return self.direction * (stop - self.leg.from_mm)

    def next_step(self, at: float, increment: float) -> tuple[float, bool]:
        """Return where a step ends, and whether fields are saved there.

        A step ends at a multiple of the longest step, of its half, of its quarter, and so on. Tests
        that hardly differ then take the same steps, so that errors of the steps do not add to their
        differences.

        Parameters
        ----------
        at
            Coordinate at which the step begins.
        increment
            Greatest length of the step, unless that is less than the shortest.
        """
        wanted, most = (math.log2(self.longest / each) for each in (increment, self.shortest))
        halvings = max(min(math.ceil(wanted - 1e-9), math.floor(most + 1e-9)), 0)
        length = self.longest / 2.0**halvings
        stop = self.next_stop(at)
        if stop - at <= (1.0 + 1e-6) * length:
            return stop, True
        target = (math.floor(at / length + 1e-6) + 1) * length
        return (at + stop) / 2.0 if stop - target < LEAST_REST * length else target, False


def segments(protocol: Protocol, settings: Stepping) -> Iterator[PathSegment]:
    """Yield the legs of a path with the data that the stepper needs."""
    start_s, legs = 0.0, protocol.legs
    for number, leg in enumerate(legs):
        shortest = min(settings.min_step_mm, LONGEST_CUT * protocol.length_mm)
        longest = settings.max_step_mm
        first = settings.first_step_mm
        if leg.from_mm == leg.to_mm:
            shares = FIRST_SHARE, SHORTEST_SHARE, LONGEST_SHARE
            first, shortest, longest = (share * leg.duration_s for share in shares)
        yield PathSegment(
            leg,
            start_s,
            protocol.save_every_mm,
            first,
            shortest,
            longest,
            is_first=number == 0,
            is_last=number == len(legs) - 1,
        )
        start_s += leg.duration_s

"""Loading protocol: the path of the indenter, and how often full fields are saved."""

from __future__ import annotations

from dataclasses import dataclass

from ramiefenics.specification.checks import check_number
from ramiefenics.specification.errors import SpecificationError


@dataclass(frozen=True)
class Target:
    """Next action of the drive: a move to a travel, or a hold.

    Attributes
    ----------
    to_mm
        Travel to move to, up or down; 0 is the travel at first touch.
    speed_mm_per_s
        Speed of the move; that of the protocol if left out.
    hold_s
        Duration of a hold, in place of a move.
    """

    to_mm: float | None = None
    speed_mm_per_s: float | None = None
    hold_s: float | None = None

    def __post_init__(self) -> None:
        """Check that the target is either a move or a hold."""
        if (self.to_mm is None) == (self.hold_s is None):
            stated = {"to_mm": self.to_mm, "hold_s": self.hold_s}
            raise SpecificationError("", stated, "must have either to_mm or hold_s")
        if self.to_mm is not None:
            check_number(self, "to_mm", at_least=0.0, unit="mm")
        else:
            check_number(self, "hold_s", above=0.0, unit="s")
        if self.speed_mm_per_s is not None:
            check_number(self, "speed_mm_per_s", above=0.0, unit="mm/s")
            if self.to_mm is None:
                allowed = "must be left out for a hold"
                raise SpecificationError("speed_mm_per_s", self.speed_mm_per_s, allowed)


MOST_STATES = 1000
"""Largest number of states whose fields are saved: gigabytes on a fine mesh."""


@dataclass(frozen=True)
class Leg:
    """A part of the path at constant speed.

    Attributes
    ----------
    from_mm
        Travel at the start.
    to_mm
        Travel at the end; in a hold that at the start.
    duration_s
        Duration.
    """

    from_mm: float
    to_mm: float
    duration_s: float


@dataclass(frozen=True)
class Protocol:
    """Path of the indenter, and how often full fields are saved.

    Attributes
    ----------
    travel_mm
        Travel of the indenter along -Y, from first touch.
    save_every_mm
        Fields are saved at multiples of this travel and at the end of every leg of the path.
    speed_mm_per_s
        Speed of the indenter, for rate-dependent materials; the published study
        does not state its speed.
    then
        What follows the first loading, in order: unloading, holds, reloading.
    """

    travel_mm: float = 14.0
    save_every_mm: float = 2.0
    speed_mm_per_s: float = 1.0
    then: tuple[Target, ...] = ()

    def __post_init__(self) -> None:
        """Check that values are positive, and that every move changes the travel."""
        check_number(self, "travel_mm", above=0.0, unit="mm")
        check_number(self, "save_every_mm", above=0.0, unit="mm")
        check_number(self, "speed_mm_per_s", above=0.0, unit="mm/s")
        object.__setattr__(self, "then", tuple(self.then))
        at = self.travel_mm
        for number, target in enumerate(self.then):
            if target.to_mm == at:
                allowed = "must differ from the travel before it; to stay there, use hold_s"
                raise SpecificationError(f"then.{number}.to_mm", target.to_mm, allowed)
            at = at if target.to_mm is None else target.to_mm
        least = self.length_mm / MOST_STATES
        if self.save_every_mm < least:
            allowed = f"must be at least {least:.3g} mm: at most {MOST_STATES} states are saved"
            raise SpecificationError("save_every_mm", self.save_every_mm, allowed)

    @property
    def length_mm(self) -> float:
        """Length of the whole path, there and back."""
        return sum(abs(leg.to_mm - leg.from_mm) for leg in self.legs)

    @property
    def legs(self) -> tuple[Leg, ...]:
        """Legs of the path, including the first loading."""
        legs = [Leg(0.0, self.travel_mm, self.travel_mm / self.speed_mm_per_s)]
        for target in self.then:
            at = legs[-1].to_mm
            if target.to_mm is None:
                legs.append(Leg(at, at, target.hold_s or 0.0))
            else:
                speed = target.speed_mm_per_s or self.speed_mm_per_s
                legs.append(Leg(at, target.to_mm, abs(target.to_mm - at) / speed))
        return tuple(legs)

    @property
    def unloads(self) -> bool:
        """Whether the indenter moves back at any time."""
        return any(leg.to_mm < leg.from_mm for leg in self.legs)

    def check_loading_only(self, what: str) -> None:
        """Check that nothing follows the first loading, for methods that are limited to it.

        Parameters
        ----------
        what
            Name of the method in the message, in the plural.

        Raises
        ------
        SpecificationError
            If anything follows.
        """
        if self.then:
            allowed = f"must be left out: {what} follow the first loading only"
            raise SpecificationError("protocol.then", f"{len(self.then)} targets", allowed)

    @property
    def duration_s(self) -> float:
        """Duration of the whole path."""
        return sum(leg.duration_s for leg in self.legs)

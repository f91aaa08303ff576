"""What the drive does: the path of the indenter, and how often full fields are kept."""

from __future__ import annotations

from dataclasses import dataclass

from ramiefenics.specification.checks import check_number
from ramiefenics.specification.errors import SpecificationError


@dataclass(frozen=True)
class Target:
    """What the drive does next: it goes to a travel, or stays where it is.

    Attributes
    ----------
    to_mm
        Travel to go to, up or down; 0 is where it touched first.
    speed_mm_per_s
        Speed on the way there; that of the protocol if left out.
    hold_s
        Time to stay, instead.
    """

    to_mm: float | None = None
    speed_mm_per_s: float | None = None
    hold_s: float | None = None

    def __post_init__(self) -> None:
        """Check that it is one of the two."""
        if (self.to_mm is None) == (self.hold_s is None):
            stated = {"to_mm": self.to_mm, "hold_s": self.hold_s}
            raise SpecificationError("", stated, "must have one of to_mm and hold_s")
        if self.to_mm is not None:
            check_number(self, "to_mm", at_least=0.0, unit="mm")
        else:
            check_number(self, "hold_s", above=0.0, unit="s")
        if self.speed_mm_per_s is not None:
            check_number(self, "speed_mm_per_s", above=0.0, unit="mm/s")
            if self.to_mm is None:
                allowed = "must be left out of a hold"
                raise SpecificationError("speed_mm_per_s", self.speed_mm_per_s, allowed)


MOST_STATES = 1000
"""Whose fields are saved: gigabytes, on a fine mesh."""


@dataclass(frozen=True)
class Leg:
    """A part of the path, at one speed.

    Attributes
    ----------
    from_mm, to_mm
        Travel at its ends; equal in a hold.
    duration_s
        Time it takes.
    """

    from_mm: float
    to_mm: float
    duration_s: float


@dataclass(frozen=True)
class Protocol:
    """What the indenter does, and how often full fields are kept.

    Attributes
    ----------
    travel_mm
        Travel of the indenter along -Y, from first touch.
    save_every_mm
        Fields are saved at multiples of this travel and at the end of every leg of the path.
    speed_mm_per_s
        Speed of the indenter, for materials that feel it; the study does not print its own.
    then
        What follows the first loading, one after the other: unloading, holding, loading again.
    """

    travel_mm: float = 14.0
    save_every_mm: float = 2.0
    speed_mm_per_s: float = 1.0
    then: tuple[Target, ...] = ()

    def __post_init__(self) -> None:
        """Check that all are positive, and that every target is another one."""
        check_number(self, "travel_mm", above=0.0, unit="mm")
        check_number(self, "save_every_mm", above=0.0, unit="mm")
        check_number(self, "speed_mm_per_s", above=0.0, unit="mm/s")
        object.__setattr__(self, "then", tuple(self.then))
        at = self.travel_mm
        for number, target in enumerate(self.then):
            if target.to_mm == at:
                allowed = "must differ from the travel before it; to stay, hold_s"
                raise SpecificationError(f"then.{number}.to_mm", target.to_mm, allowed)
            at = at if target.to_mm is None else target.to_mm
        least = self.length_mm / MOST_STATES
        if self.save_every_mm < least:
            allowed = f"must be at least {least:.3g} mm: at most {MOST_STATES} states are saved"
            raise SpecificationError("save_every_mm", self.save_every_mm, allowed)

    @property
    def length_mm(self) -> float:
        """What the indenter goes, there and back."""
        return sum(abs(leg.to_mm - leg.from_mm) for leg in self.legs)

    @property
    def legs(self) -> tuple[Leg, ...]:
        """The path, the first loading included."""
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
        """Whether the indenter goes back at some time."""
        return any(leg.to_mm < leg.from_mm for leg in self.legs)

    def check_loading_only(self, what: str) -> None:
        """Check that nothing follows the first loading, where that is all that can be followed.

        Raises
        ------
        SpecificationError
            If something does.
        """
        if self.then:
            allowed = f"must be left out: {what} follow the first loading only"
            raise SpecificationError("protocol.then", f"{len(self.then)} targets", allowed)

    @property
    def duration_s(self) -> float:
        """Time that the whole path takes."""
        return sum(leg.duration_s for leg in self.legs)

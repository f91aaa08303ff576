"""Fixtures whose cylinders are stated one by one."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass, field

from ramiefenics.specification.checks import check_instance
from ramiefenics.specification.cylinder import Arrangement, Cylinder
from ramiefenics.specification.errors import SpecificationError
from ramiefenics.specification.friction import Friction


@dataclass(frozen=True)
class GeneralFixture(Arrangement):
    """Any rigid cylinders and plates; those that move press the stalk against the fixed ones.

    Attributes
    ----------
    cylinders
        Cylinders and plates that touch the stalk; those at Z < 0 are sorted behind the others.
        Contact and section are reported for the indenter, the first that moves, and for the
        support, the first that is fixed.
    friction
        Friction, the same on all cylinders and plates.
    """

    cylinders: tuple[Cylinder, ...]
    friction: Friction = field(default_factory=Friction)

    def __post_init__(self) -> None:
        """Check that the stalk is pressed against something, and that there is room to do so."""
        check_instance(self, "friction", Friction)
        object.__setattr__(
            self, "cylinders", tuple(sorted(self.cylinders, key=lambda c: c.z_mm < 0.0))
        )
        names = [cylinder.name for cylinder in self.cylinders]
        for name in names:
            if names.count(name) > 1:
                raise SpecificationError("cylinders", name, "must not name a cylinder twice")
        if not any(cylinder.moves for cylinder in self.cylinders):
            raise SpecificationError("cylinders", names, "must include a moving cylinder")
        self._check_support(names)
        for one, other in itertools.combinations(self.cylinders, 2):
            _check_room(one, other)

    def check_length(self, length_mm: float) -> None:
        """Check that all cylinders are within the length of a specimen.

        Raises
        ------
        SpecificationError
            If one is beyond the specimen's end.
        """
        for cylinder in self.cylinders:
            if abs(cylinder.z_mm) >= length_mm / 2.0:
                allowed = f"must be within {length_mm / 2.0:g} mm of midspan, where the stalk ends"
                raise _at(cylinder, allowed)

    def _check_support(self, names: list[str]) -> None:
        """Check that the forces on the stalk can be in equilibrium.

        They can if the ranges of Z covered by the cylinders above and by those below have a point
        in common: both resultants may then pass through it.
        """
        ranges = []
        for side in ("above", "below"):
            there = [cylinder for cylinder in self.cylinders if cylinder.side == side]
            flat = any(cylinder.flat for cylinder in there)
            at = [-math.inf, math.inf] if flat else [cylinder.z_mm for cylinder in there]
            ranges.append((min(at, default=math.inf), max(at, default=-math.inf)))
        if max(low for low, _ in ranges) > min(high for _, high in ranges):
            allowed = "must hold the stalk: the ranges of Z above and below it must overlap"
            raise SpecificationError("cylinders", names, allowed)


def _check_room(one: Cylinder, other: Cylinder) -> None:
    """Check that two cylinders do not overlap, and do not collide when one moves."""
    apart, radii = abs(one.z_mm - other.z_mm), one.radius_mm + other.radius_mm
    if one.side == other.side:
        if one.flat or other.flat:
            plate, beside = (one, other) if one.flat else (other, one)
            allowed = f"must be on the opposite side of the stalk from the plate {plate.name}"
            raise SpecificationError(f"cylinders.{beside.name}.side", beside.side, allowed)
        least = 2.0 * math.sqrt(one.radius_mm * other.radius_mm)  # both touch a common line
        if apart <= least:
            raise _at(other, f"must be more than {least:g} mm from {one.name}, or they overlap")
    elif (one.moves or other.moves) and math.isfinite(radii) and 0.0 < apart <= radii:
        allowed = f"must be more than {radii:g} mm from {one.name}, or directly opposite"
        raise _at(other, f"{allowed}, or the moving cylinder cannot pass")


def _at(cylinder: Cylinder, allowed: str) -> SpecificationError:
    return SpecificationError(f"cylinders.{cylinder.name}.z_mm", cylinder.z_mm, allowed)

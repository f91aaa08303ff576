"""Rigid cylinders and plates, and the properties of any arrangement of them."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

from ramiefenics.specification.checks import check_choice, check_number
from ramiefenics.specification.errors import SpecificationError


@dataclass(frozen=True)
class Cylinder:
    """A rigid cylinder across the stalk, with its axis along X; it touches the stalk at the start.

    Attributes
    ----------
    name
        Unique name, one word.
    side
        Side of the stalk on which the cylinder is: ``above`` or ``below``.
    moves
        Whether the cylinder is driven, along -Y; otherwise it is fixed.
    z_mm
        Z of the axis.
    radius_mm
        Radius; infinite for a flat plate.
    """

    name: str
    side: str
    moves: bool
    z_mm: float
    radius_mm: float

    def __post_init__(self) -> None:
        """Check each value, and that a moving cylinder presses the stalk."""
        if not isinstance(self.name, str) or not self.name.isidentifier():
            allowed = "must be one word of letters, digits and underscores"
            raise SpecificationError("name", self.name, allowed)
        check_choice(self, "side", ("above", "below"))
        check_choice(self, "moves", (True, False))
        check_number(self, "z_mm", unit="mm")
        if self.radius_mm != math.inf:
            check_number(self, "radius_mm", above=0.0, unit="mm")
        if self.moves and self.side == "below":
            allowed = "must be 'above' for a moving cylinder, as it moves down"
            raise SpecificationError("side", self.side, allowed)

    @property
    def flat(self) -> bool:
        """Whether it is a plate."""
        return math.isinf(self.radius_mm)

    @property
    def up(self) -> float:
        """Direction along Y from the stalk to the cylinder, 1 if it is above, -1 if below."""
        return 1.0 if self.side == "above" else -1.0


class BeamSpans(NamedTuple):
    """Distances between the axes in three- or four-point bending.

    Attributes
    ----------
    supports_mm
        Distance between the supports.
    indenters_mm
        Distance between the indenters; 0 for a single one.
    """

    supports_mm: float
    indenters_mm: float

    @property
    def arm_mm(self) -> float:
        """Distance between a support and the indenter next to it."""
        return (self.supports_mm - self.indenters_mm) / 2.0


class Arrangement:
    """An arrangement of rigid cylinders and plates, the base class of fixtures."""

    if TYPE_CHECKING:  # a property of one subclass, a field of the other

        @property
        def cylinders(self) -> tuple[Cylinder, ...]: ...  # noqa: D102

    @property
    def indenter(self) -> Cylinder:
        """The first cylinder that moves."""
        return next(cylinder for cylinder in self.cylinders if cylinder.moves)

    @property
    def support(self) -> Cylinder:
        """The first cylinder that does not move."""
        return next(cylinder for cylinder in self.cylinders if not cylinder.moves)

    @property
    def symmetric(self) -> bool:
        """Whether the arrangement is its own mirror image in the plane Z = 0."""
        placed = {(c.side, c.moves, c.z_mm, c.radius_mm) for c in self.cylinders}
        return placed == {(side, moves, -z, radius) for side, moves, z, radius in placed}

    @property
    def off_centre(self) -> bool:
        """Whether the axes, whatever the radii, are not symmetric about the plane Z = 0."""
        placed = {(c.side, c.moves, c.z_mm) for c in self.cylinders}
        return placed != {(side, moves, -z) for side, moves, z in placed}

    @property
    def beam_mm(self) -> BeamSpans | None:
        """Distances between the axes in three- or four-point bending; None for any other test.

        These tests have two fixed cylinders below, and one or two moving cylinders above and
        between them, at equal distances from midspan. Radii do not matter to a beam.
        """
        fixed = sorted(c.z_mm for c in self.cylinders if not c.moves)
        moving = sorted(c.z_mm for c in self.cylinders if c.moves)
        clamped = any(c.up > 0.0 for c in self.cylinders if not c.moves)
        if clamped or len(fixed) != 2 or len(moving) > 2:
            return None
        if fixed[0] != -fixed[1] or moving[0] != -moving[-1] or moving[-1] >= fixed[1]:
            return None
        return BeamSpans(2.0 * fixed[1], 2.0 * moving[-1])

    def check_beam(self, what: str) -> BeamSpans:
        """Return the distances in three- or four-point bending, or refuse another arrangement.

        Parameters
        ----------
        what
            Subject and verb of the message: what is limited to these tests.

        Raises
        ------
        SpecificationError
            If the arrangement is another one.
        """
        if self.beam_mm is None:
            placed = ", ".join(f"{c.name} {c.side} at {c.z_mm:g} mm" for c in self.cylinders)
            allowed = f"must be that of three- or four-point bending, to which {what} limited"
            raise SpecificationError("fixture", placed, allowed)
        return self.beam_mm

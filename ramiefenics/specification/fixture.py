"""What presses the stalk: rigid cylinders and plates, some fixed, some moving, and friction.

A fixture is the tuple `Fixture.cylinders`, and nothing but that tuple is read by mesh, contact and
results: a new arrangement is made there.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass, field

from ramiefenics.specification.checks import check_instance, check_number
from ramiefenics.specification.errors import SpecificationError


@dataclass(frozen=True)
class Friction:
    """Coulomb friction between stalk and fixture.

    Attributes
    ----------
    static, dynamic
        Coefficients at rest and in sliding. The defaults are ramie's on steel; a file that
        leaves them out is told so.
    weakening_mm
        Length that a point slides while its coefficient loses all but 1/e of what the static one
        exceeds the dynamic one by. Nobody has measured it: an assumption.
    """

    static: float = 0.59
    dynamic: float = 0.12
    weakening_mm: float = 0.02

    def __post_init__(self) -> None:
        """Check that 0 <= dynamic <= static, and the length."""
        check_number(self, "static", at_least=0.0)
        check_number(self, "dynamic", at_least=0.0)
        if self.dynamic > self.static:
            raise SpecificationError(
                "dynamic", self.dynamic, f"must be at most the static coefficient {self.static:g}"
            )
        check_number(self, "weakening_mm", above=0.0, unit="mm")


@dataclass(frozen=True)
class Cylinder:
    """A rigid cylinder across the stalk, its axis along X, which touches the stalk at the start.

    Attributes
    ----------
    name
        A name of its own.
    side
        Where it is: ``above`` the stalk or ``below`` it.
    moves
        Whether it is driven, along -Y; the others are fixed.
    z_mm
        Place of its axis.
    radius_mm
        Radius; of a flat plate, infinite.
    """

    name: str
    side: str
    moves: bool
    z_mm: float
    radius_mm: float

    @property
    def flat(self) -> bool:
        """Whether it is a plate."""
        return math.isinf(self.radius_mm)

    @property
    def up(self) -> float:
        """Direction along Y from the stalk to it, 1 above and -1 below."""
        return 1.0 if self.side == "above" else -1.0


@dataclass(frozen=True)
class Fixture:
    """Indenters above the stalk, which move, and supports below, which do not.

    Three-point bending by default. With `inner_span_mm` there are two indenters, for four-point
    bending; with `span_mm` = 0 a single support is under a single indenter. A radius may be
    infinite there: a plate. A ring cut from a stalk is crushed between two of them.

    Attributes
    ----------
    span_mm
        Distance of the supports' axes, on either side of Z = 0; 0 for a single support.
    indenter_radius_mm, support_radius_mm
        Radii. The paper does not publish them: 5 mm is an assumption.
    friction
        The same on all cylinders.
    inner_span_mm
        Distance of the axes of two indenters; 0 for a single one.
    indenter_offset_mm
        Z of the indenter, or of the middle between two.
    other_support_radius_mm
        Radius of the support at Z < 0; that of the other one if left out.
    """

    span_mm: float = 100.0
    indenter_radius_mm: float = 5.0
    support_radius_mm: float = 5.0
    friction: Friction = field(default_factory=Friction)
    inner_span_mm: float = 0.0
    indenter_offset_mm: float = 0.0
    other_support_radius_mm: float | None = None

    def __post_init__(self) -> None:
        """Check signs, that indenters pass between the supports, and that plates are alone."""
        check_number(self, "span_mm", at_least=0.0, unit="mm")
        check_number(self, "inner_span_mm", at_least=0.0, unit="mm")
        check_number(self, "indenter_offset_mm", unit="mm")
        for name in ("indenter_radius_mm", "support_radius_mm", "other_support_radius_mm"):
            if getattr(self, name) not in (None, math.inf):
                check_number(self, name, above=0.0, unit="mm")
        check_instance(self, "friction", Friction)
        if self.span_mm == 0.0:
            self._check_single()
        else:
            self._check_passage()

    @property
    def cylinders(self) -> tuple[Cylinder, ...]:
        """What touches the stalk; of those that move, and of those that do not, at Z >= 0 first."""
        other_radius = self.other_support_radius_mm
        if other_radius is None:
            other_radius = self.support_radius_mm
        half, inner, at = self.span_mm / 2.0, self.inner_span_mm / 2.0, self.indenter_offset_mm
        radius = self.indenter_radius_mm
        cylinders = [
            Cylinder("indenter", "above", True, at + inner, radius),
            Cylinder("other_indenter", "above", True, at - inner, radius),
            Cylinder("support", "below", False, half, self.support_radius_mm),
            Cylinder("other_support", "below", False, -half, other_radius),
        ]
        absent = {"other_indenter": inner == 0.0, "other_support": half == 0.0}
        return tuple(c for c in cylinders if not absent.get(c.name, False))

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
        """Whether it is its own mirror image in the plane Z = 0."""
        placed = {(c.side, c.z_mm, c.radius_mm) for c in self.cylinders}
        return placed == {(side, -z, radius) for side, z, radius in placed}

    @property
    def three_point(self) -> bool:
        """Whether one indenter is in the middle between two equal supports."""
        return self.symmetric and self.span_mm > 0.0 and self.inner_span_mm == 0.0

    def _check_single(self) -> None:
        """Check that a single support is under a single indenter."""
        for name, free in (
            ("inner_span_mm", 0.0),
            ("indenter_offset_mm", 0.0),
            ("other_support_radius_mm", None),
        ):
            value = getattr(self, name)
            if value != free:
                allowed = "must be left out where span_mm = 0, the single support of one indenter"
                raise SpecificationError(name, value, allowed)

    def _check_passage(self) -> None:
        """Check that there is room for every indenter between the supports, and between them."""
        for name in ("indenter_radius_mm", "support_radius_mm", "other_support_radius_mm"):
            if getattr(self, name) == math.inf:
                allowed = "must be finite unless span_mm = 0: two plates, or a plate and a cylinder"
                raise SpecificationError(name, math.inf, allowed)
        pairs = itertools.product(self.cylinders, repeat=2)
        least = max(
            2.0 * (one.radius_mm + other.radius_mm + math.copysign(one.z_mm, one.z_mm * other.z_mm))
            for one, other in pairs
            if one.moves and not other.moves
        )
        if self.span_mm <= least:
            allowed = f"must be above {least:g} mm, or the indenter does not pass the supports"
            raise SpecificationError("span_mm", self.span_mm, allowed)
        if 0.0 < self.inner_span_mm <= 2.0 * self.indenter_radius_mm:
            allowed = f"must be above {2.0 * self.indenter_radius_mm:g} mm, or 0 for one indenter"
            raise SpecificationError("inner_span_mm", self.inner_span_mm, allowed)

"""Fixtures: rigid cylinders and plates, some fixed and some moving, and their friction.

Mesh, contact and results read the tuple `cylinders` and nothing else. `Fixture` derives it from a
few lengths, for the usual tests; a `GeneralFixture` states it.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass, field

from ramiefenics.specification.checks import check_instance, check_number
from ramiefenics.specification.cylinder import Arrangement, Cylinder
from ramiefenics.specification.errors import SpecificationError
from ramiefenics.specification.friction import Friction


@dataclass(frozen=True)
class Fixture(Arrangement):
    """Moving indenters above the stalk, and fixed supports below it.

    Three-point bending by default. With `inner_span_mm` there are two indenters, for four-point
    bending. With `span_mm` = 0 there is a single support under a single indenter. Their radii may
    then be infinite, which makes them plates: a ring cut from a stalk is crushed between two.

    Attributes
    ----------
    span_mm
        Distance between the axes of the supports, which lie on either side of Z = 0; 0 for a single
        support.
    indenter_radius_mm
        Radius of the indenter, or of each of two. The published study does not state it: 5 mm is an
        assumption.
    support_radius_mm
        Radius of the supports. The published study does not state it: 5 mm is an assumption.
    friction
        Friction, the same on all cylinders.
    inner_span_mm
        Distance between the axes of two indenters; 0 for a single one.
    indenter_offset_mm
        Z of the indenter, or of the middle between two.
    other_support_radius_mm
        Radius of the support at Z < 0; that of the other support if left out.
    """

    span_mm: float = 100.0
    indenter_radius_mm: float = 5.0
    support_radius_mm: float = 5.0
    friction: Friction = field(default_factory=Friction)
    inner_span_mm: float = 0.0
    indenter_offset_mm: float = 0.0
    other_support_radius_mm: float | None = None

    def __post_init__(self) -> None:
        """Check signs, that indenters pass between supports, and that plates have no span."""
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
        """Cylinders that touch the stalk, first moving, then fixed ones, each by descending Z."""
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

    def check_length(self, length_mm: float) -> None:
        """Check that a specimen is long enough to lie on its supports.

        Raises
        ------
        SpecificationError
            If it is too short.
        """
        if self.span_mm >= length_mm:
            allowed = f"must be below the specimen's length {length_mm:g} mm"
            raise SpecificationError("span_mm", self.span_mm, allowed)

    def _check_single(self) -> None:
        """Check that a single support is under a single indenter."""
        for name, free in (
            ("inner_span_mm", 0.0),
            ("indenter_offset_mm", 0.0),
            ("other_support_radius_mm", None),
        ):
            value = getattr(self, name)
            if value != free:
                allowed = (
                    "must be left out if span_mm = 0, that is, for a single support under a single "
                    "indenter"
                )
                raise SpecificationError(name, value, allowed)

    def _check_passage(self) -> None:
        """Check that every indenter fits between the supports, and that two fit side by side."""
        for name in ("indenter_radius_mm", "support_radius_mm", "other_support_radius_mm"):
            if getattr(self, name) == math.inf:
                allowed = (
                    "must be finite unless span_mm = 0, that is, for two plates, or a plate and a "
                    "cylinder"
                )
                raise SpecificationError(name, math.inf, allowed)
        pairs = itertools.product(self.cylinders, repeat=2)
        least = max(
            2.0 * (one.radius_mm + other.radius_mm + math.copysign(one.z_mm, one.z_mm * other.z_mm))
            for one, other in pairs
            if one.moves and not other.moves
        )
        if self.span_mm <= least:
            allowed = f"must be above {least:g} mm, or the indenter cannot pass the supports"
            raise SpecificationError("span_mm", self.span_mm, allowed)
        if 0.0 < self.inner_span_mm <= 2.0 * self.indenter_radius_mm:
            allowed = f"must be above {2.0 * self.indenter_radius_mm:g} mm, or 0 for one indenter"
            raise SpecificationError("inner_span_mm", self.inner_span_mm, allowed)

"""The three-point bending fixture, what the indenter does, what the machine makes of it."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from ramiefenics.specification.checks import check_instance, check_number
from ramiefenics.specification.errors import SpecificationError


@dataclass(frozen=True)
class Friction:
    """Coulomb friction between stalk and fixture.

    Attributes
    ----------
    static, dynamic
        Coefficients at rest and in sliding. The defaults are ramie's on steel, Tables 1 and 7 of
        the study that `ramiefenics.specification.citation` names; a file that leaves them out is
        told so.
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
class Fixture:
    """Rigid cylinders across the stalk (axes along X): an indenter above, two supports below.

    Attributes
    ----------
    span_mm
        Distance of the supports' axes; the indenter is at its middle, Z = 0.
    indenter_radius_mm, support_radius_mm
        Radii. The paper does not publish them: 5 mm is an assumption.
    friction
        The same on all three cylinders.
    """

    span_mm: float = 100.0
    indenter_radius_mm: float = 5.0
    support_radius_mm: float = 5.0
    friction: Friction = field(default_factory=Friction)

    def __post_init__(self) -> None:
        """Check that lengths are positive and the cylinders do not overlap."""
        for name in ("span_mm", "indenter_radius_mm", "support_radius_mm"):
            check_number(self, name, above=0.0, unit="mm")
        check_instance(self, "friction", Friction)


@dataclass(frozen=True)
class Machine:
    """What the testing machine's displacement has beyond the indenter's travel.

    Attributes
    ----------
    compliance_mm_per_N
        Deflection of frame, load cell and fixture per force.
    seating_gap_mm
        Displacement recorded before the indenter touches the stalk.
    """

    compliance_mm_per_N: float = 0.0
    seating_gap_mm: float = 0.0

    def __post_init__(self) -> None:
        """Check that neither is negative."""
        check_number(self, "compliance_mm_per_N", at_least=0.0, unit="mm/N")
        check_number(self, "seating_gap_mm", at_least=0.0, unit="mm")

    def displacement(self, travel_mm: Any, force_N: Any) -> Any:
        """Return what the machine records at a travel of the indenter, mm; arrays as well."""
        return self.seating_gap_mm + travel_mm + self.compliance_mm_per_N * force_N


@dataclass(frozen=True)
class Protocol:
    """What the indenter does, and how often full fields are kept.

    Attributes
    ----------
    travel_mm
        Travel of the indenter along -Y, from first touch.
    save_every_mm
        Fields are saved at multiples of this travel and at the end.
    speed_mm_per_s
        Speed of the indenter, for materials that feel it; the study does not print its own.
    """

    travel_mm: float = 14.0
    save_every_mm: float = 2.0
    speed_mm_per_s: float = 1.0

    def __post_init__(self) -> None:
        """Check that all are positive."""
        check_number(self, "travel_mm", above=0.0, unit="mm")
        check_number(self, "save_every_mm", above=0.0, unit="mm")
        check_number(self, "speed_mm_per_s", above=0.0, unit="mm/s")

"""Friction between the stalk and the fixture."""

from __future__ import annotations

from dataclasses import dataclass

from ramiefenics.specification.checks import check_number
from ramiefenics.specification.errors import SpecificationError

MOST = 100.0
"""Largest coefficient of friction; that of rubber is 4."""


@dataclass(frozen=True)
class Friction:
    """Coulomb friction between stalk and fixture.

    Attributes
    ----------
    static
        Coefficient of friction at rest. The default is that of ramie on steel; a warning is issued
        for a file that leaves it out.
    dynamic
        Coefficient of friction in sliding, at most the static one. The default is that of ramie on
        steel; a warning is issued for a file that leaves it out.
    weakening_mm
        Slip over which the excess of a point's coefficient over the dynamic one falls to 1/e. It
        has not been measured: an assumption.
    """

    static: float = 0.59
    dynamic: float = 0.12
    weakening_mm: float = 0.02

    def __post_init__(self) -> None:
        """Check that 0 <= dynamic <= static, and that the length is positive."""
        check_number(self, "static", at_least=0.0, at_most=MOST)
        check_number(self, "dynamic", at_least=0.0, at_most=MOST)
        if self.dynamic > self.static:
            raise SpecificationError(
                "dynamic", self.dynamic, f"must be at most the static coefficient {self.static:g}"
            )
        check_number(self, "weakening_mm", above=0.0, unit="mm")

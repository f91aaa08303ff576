"""How the stalk rubs on the fixture."""

from __future__ import annotations

from dataclasses import dataclass

from ramiefenics.specification.checks import check_number
from ramiefenics.specification.errors import SpecificationError

MOST = 100.0
"""Of a coefficient; that of rubber is 4."""


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
        check_number(self, "static", at_least=0.0, at_most=MOST)
        check_number(self, "dynamic", at_least=0.0, at_most=MOST)
        if self.dynamic > self.static:
            raise SpecificationError(
                "dynamic", self.dynamic, f"must be at most the static coefficient {self.static:g}"
            )
        check_number(self, "weakening_mm", above=0.0, unit="mm")

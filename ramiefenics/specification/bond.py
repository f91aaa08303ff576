"""The bond of the outermost layer to the one inside it."""

from __future__ import annotations

from dataclasses import dataclass

from ramiefenics.specification.checks import check_number
from ramiefenics.specification.errors import SpecificationError


@dataclass(frozen=True)
class Bond:
    """How two layers hold together: perfectly, or by a film of no thickness that yields and fails.

    Attributes
    ----------
    compliance_mm_per_MPa
        Slip of one layer on the other per shear stress, and separation per tension; 0 for a
        perfect bond.
    strength_MPa
        Stress at which it begins to fail.
    toughness_N_per_mm
        Energy per area that it has taken when it has failed, by a stress that falls linearly.
    """

    compliance_mm_per_MPa: float = 0.0
    strength_MPa: float = 1.0
    toughness_N_per_mm: float = 0.3

    def __post_init__(self) -> None:
        """Check the signs, and that it does not break before it begins to fail."""
        check_number(self, "compliance_mm_per_MPa", at_least=0.0, unit="mm/MPa")
        check_number(self, "strength_MPa", above=0.0, unit="MPa")
        check_number(self, "toughness_N_per_mm", above=0.0, unit="N/mm")
        stored = self.strength_MPa * self.softens_at_mm / 2.0
        if self.toughness_N_per_mm <= stored:
            allowed = f"must be above {stored:g} N/mm, which it stores when it begins to fail"
            raise SpecificationError("toughness_N_per_mm", self.toughness_N_per_mm, allowed)

    @property
    def perfect(self) -> bool:
        """Whether nothing moves."""
        return self.compliance_mm_per_MPa == 0.0

    @property
    def softens_at_mm(self) -> float:
        """Slip at which it begins to fail."""
        return self.compliance_mm_per_MPa * self.strength_MPa

    @property
    def fails_at_mm(self) -> float:
        """Slip at which it has failed."""
        return 2.0 * self.toughness_N_per_mm / self.strength_MPa

    def scaled(self, factor: float) -> Bond:
        """Return the bond with all stresses, at the same slip, that many times as large."""
        if self.perfect:
            return self
        return Bond(
            self.compliance_mm_per_MPa / factor,
            self.strength_MPa * factor,
            self.toughness_N_per_mm * factor,
        )

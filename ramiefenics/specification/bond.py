"""The bond between the outermost layer and the one inside it."""

from __future__ import annotations

from dataclasses import dataclass

from ramiefenics.specification.checks import check_number
from ramiefenics.specification.errors import SpecificationError


@dataclass(frozen=True)
class Bond:
    """Bond between two layers: perfect, or a film of zero thickness that deforms and fails.

    Attributes
    ----------
    compliance_mm_per_MPa
        Slip of one layer on the other per shear stress, and separation per tension; 0 for a
        perfect bond.
    strength_MPa
        Stress at which the bond begins to fail.
    toughness_N_per_mm
        Energy per area that the bond has absorbed when it has failed; until then the stress falls
        linearly.
    """

    compliance_mm_per_MPa: float = 0.0
    strength_MPa: float = 1.0
    toughness_N_per_mm: float = 0.3

    def __post_init__(self) -> None:
        """Check signs, and that the toughness exceeds the energy stored when failure begins."""
        check_number(self, "compliance_mm_per_MPa", at_least=0.0, unit="mm/MPa")
        check_number(self, "strength_MPa", above=0.0, unit="MPa")
        check_number(self, "toughness_N_per_mm", above=0.0, unit="N/mm")
        stored = self.strength_MPa * self.softens_at_mm / 2.0
        if self.toughness_N_per_mm <= stored:
            allowed = f"must be above {stored:g} N/mm, the energy stored when failure begins"
            raise SpecificationError("toughness_N_per_mm", self.toughness_N_per_mm, allowed)

    @property
    def perfect(self) -> bool:
        """Whether the layers can neither slip nor separate."""
        return self.compliance_mm_per_MPa == 0.0

    @property
    def softens_at_mm(self) -> float:
        """Slip at which the bond begins to fail."""
        return self.compliance_mm_per_MPa * self.strength_MPa

    @property
    def fails_at_mm(self) -> float:
        """Slip at which the bond has failed."""
        return 2.0 * self.toughness_N_per_mm / self.strength_MPa

    def scaled(self, factor: float) -> Bond:
        """Return the bond with all stresses multiplied by a factor at the same slip."""
        if self.perfect:
            return self
        return Bond(
            self.compliance_mm_per_MPa / factor,
            self.strength_MPa * factor,
            self.toughness_N_per_mm * factor,
        )

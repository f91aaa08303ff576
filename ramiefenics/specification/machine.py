"""What the testing machine makes of the test."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from ramiefenics.specification.checks import check_number


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

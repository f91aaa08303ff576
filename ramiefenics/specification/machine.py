"""The testing machine, and what it records of a test."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ramiefenics.specification.checks import check_number, check_table
from ramiefenics.specification.errors import SpecificationError


@dataclass(frozen=True)
class Machine:
    """Testing machine: how its record differs from the indenter's travel and force.

    Attributes
    ----------
    compliance_mm_per_N
        Deflection of frame, load cell and fixture per force.
    seating_gap_mm
        Displacement recorded before the indenter touches the stalk.
    bedding_compliance_mm_per_N
        Additional compliance at zero force. Rough faces of the fixture bed in as they are pressed
        together: their stiffness grows in proportion to the force (Persson 2007, Physical Review
        Letters 99, 125502), their deflection with its logarithm.
    bedding_force_N
        Force at which half of the bedding compliance is left.
    table_N
        Forces, ascending, at which `table_mm` states deflections.
    table_mm
        Additional deflections of frame, load cell and fixture at the forces `table_N`; linear in
        between and from zero force on, constant beyond.
    load_scale
        Factor by which the load cell reads too high.
    load_offset_N
        Reading of the load cell without force.
    displacement_scale
        Factor by which the displacement of the drive is recorded too large.
    """

    compliance_mm_per_N: float = 0.0
    seating_gap_mm: float = 0.0
    bedding_compliance_mm_per_N: float = 0.0
    bedding_force_N: float = 10.0
    table_N: tuple[float, ...] = ()
    table_mm: tuple[float, ...] = ()
    load_scale: float = 1.0
    load_offset_N: float = 0.0
    displacement_scale: float = 1.0

    def __post_init__(self) -> None:
        """Check that deflections and the gap are not negative, and that factors are positive."""
        check_number(self, "compliance_mm_per_N", at_least=0.0, unit="mm/N")
        check_number(self, "seating_gap_mm", at_least=0.0, unit="mm")
        check_number(self, "bedding_compliance_mm_per_N", at_least=0.0, unit="mm/N")
        check_number(self, "bedding_force_N", above=0.0, unit="N")
        check_table(self, "table_N", "table_mm")
        if self.table_N and self.table_N[0] <= 0.0:
            raise SpecificationError("table_N", list(self.table_N), "must begin above 0 N")
        check_number(self, "load_scale", above=0.0)
        check_number(self, "load_offset_N", unit="N")
        check_number(self, "displacement_scale", above=0.0)

    def recorded(self, travel_mm: Any, force_N: Any) -> tuple[Any, Any]:
        """Return the displacement, mm, and the force, N, that the machine records.

        Parameters
        ----------
        travel_mm, force_N
            Travel of the indenter and force on it; numbers or arrays.
        """
        driven = travel_mm + self.deflection_mm(force_N)
        displacement = self.seating_gap_mm + self.displacement_scale * driven
        return displacement, self.load_offset_N + self.load_scale * force_N

    def travel_mm(self, displacement_mm: Any, force_N: Any) -> Any:
        """Return the indenter's travel, mm, from a recorded displacement and force.

        Parameters
        ----------
        displacement_mm, force_N
            Recorded displacement and force; numbers or arrays.
        """
        force = (force_N - self.load_offset_N) / self.load_scale
        driven = (displacement_mm - self.seating_gap_mm) / self.displacement_scale
        return driven - self.deflection_mm(force)

    def deflection_mm(self, force_N: Any) -> Any:
        """Return the deflection of frame, load cell and fixture, mm.

        Parameters
        ----------
        force_N
            Force on the indenter; a number or an array.
        """
        scale = self.bedding_force_N
        bedded = np.sign(force_N) * scale * np.log1p(np.abs(force_N) / scale)
        linear = self.compliance_mm_per_N * force_N
        table = np.interp(force_N, (0.0, *self.table_N), (0.0, *self.table_mm))
        return linear + self.bedding_compliance_mm_per_N * bedded + table

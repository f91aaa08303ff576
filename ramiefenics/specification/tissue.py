"""Variation of the tissue within a stalk."""

from __future__ import annotations

from dataclasses import dataclass

from ramiefenics.specification.checks import check_number


@dataclass(frozen=True)
class Tissue:
    """Deviations from uniform layers whose fibres run along the stalk without stress.

    Attributes
    ----------
    radial_gradient
        Difference of all moduli between the outside and the inside of a layer, over their mean;
        they are linear in the radius. The mean over the area of the layer is the given modulus.
    fibre_angle_deg
        Angle by which fibres lean from the stalk's axis towards the tangent, from X to Y; they form
        helices.
    growth_strain
        Strain along the fibres at the stalk's surface before loading, linear in the radius and zero
        where this balances the axial forces of the layers. If it is positive, the outside is in
        tension and the inside in compression.
    """

    radial_gradient: float = 0.0
    fibre_angle_deg: float = 0.0
    growth_strain: float = 0.0

    def __post_init__(self) -> None:
        """Check the ranges."""
        check_number(self, "radial_gradient", at_least=-1.0, at_most=1.0)
        check_number(self, "fibre_angle_deg", at_least=-60.0, at_most=60.0, unit="degrees")
        check_number(self, "growth_strain", at_least=-0.05, at_most=0.05)

"""How tissue differs from place to place within a stalk."""

from __future__ import annotations

from dataclasses import dataclass

from ramiefenics.specification.checks import check_number


@dataclass(frozen=True)
class Tissue:
    """What layers of one material each, with fibres along the stalk, leave out.

    Attributes
    ----------
    radial_gradient
        What all moduli at the outside of a layer exceed those at its inside by, over their mean;
        in between they are linear in the radius. The layer's mean over its area is the given one.
    fibre_angle_deg
        Angle by which fibres lean from the stalk's axis towards the tangent, from X to Y: helices.
    growth_strain
        Strain along the fibres at the stalk's surface before it is touched, linear in the radius
        and zero where it balances the layers' axial forces: with a positive one the outside is in
        tension, the inside in compression.
    """

    radial_gradient: float = 0.0
    fibre_angle_deg: float = 0.0
    growth_strain: float = 0.0

    def __post_init__(self) -> None:
        """Check the ranges."""
        check_number(self, "radial_gradient", at_least=-1.0, at_most=1.0)
        check_number(self, "fibre_angle_deg", at_least=-60.0, at_most=60.0, unit="degrees")
        check_number(self, "growth_strain", at_least=-0.05, at_most=0.05)

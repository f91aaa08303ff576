"""What a hyperelastic law is to the rest of the program."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from ramiefenics.specification import Elastic, Material

Expr = Any
"""A UFL expression; UFL's own types are not annotated."""


@dataclass(frozen=True)
class Law:
    """A stored energy and its parameters.

    Attributes
    ----------
    name
        As in the specification.
    parameters
        From a layer's material to the energy's parameters, each a number; the set of names is
        the same for every material, so that they can be data to one compiled form.
    energy
        From the deformation gradient, UFL shape (3, 3), and the parameters to the energy per
        undeformed volume, N/mm2. Its second derivative at rest is `Elastic.stiffness`.
    least_stretch
        Stretch at which the stress of a compressed fibre or layer stops growing; 0 if it never
        does.
    homogeneous
        Whether all stresses double where all moduli do, so that forces are known of stalks that
        are stiffer as a whole.
    """

    name: str
    parameters: Callable[[Material], dict[str, float]]
    energy: Callable[[Expr, Mapping[str, Expr]], Expr]
    least_stretch: float = 0.0
    homogeneous: bool = False


def stiffness_entries(elastic: Elastic) -> tuple[float, float, float, float]:
    """Return C11, C12, C13, C33 of a layer that is isotropic in its cross-section, MPa.

    The shear moduli are in `elastic`; what G_XY exceeds (C11 - C12) / 2 by, a law adds.
    """
    stiffness = elastic.stiffness()
    return stiffness[0, 0], stiffness[0, 1], stiffness[0, 2], stiffness[2, 2]

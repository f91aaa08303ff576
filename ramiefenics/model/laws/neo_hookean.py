"""Neo-Hookean cross-section with linear fibres.

The isotropic in-plane part, ``mu/2 (I_1 - 3 - 2 ln J) + C_12/2 (ln J)^2``, keeps crushed layers
stiff (Bonet and Wood 2008, Eq. 6.28). The contribution of the fibres is quadratic in the
Green-Lagrange strain, so the layer kinks at an axial compression of about G_XZ / E_Z.
"""

from __future__ import annotations

from collections.abc import Mapping

import ufl

from ramiefenics.model.laws.base import Expr, Law, stiffness_entries
from ramiefenics.specification import Material


def _parameters(material: Material) -> dict[str, float]:
    c11, c12, c13, c33 = stiffness_entries(material.elastic)
    mu = (c11 - c12) / 2
    return {
        "mu": mu,
        "lambda": c12,
        "fibre": c33 - c12 - 2 * mu,
        "coupling": c13 - c12,
        "shear_XZ": material.elastic.G_XZ_MPa - mu,
        "shear_XY": material.elastic.G_XY - mu,
    }


def _energy(F: Expr, p: Mapping[str, Expr]) -> Expr:
    C = F.T * F
    E = (C - ufl.Identity(3)) / 2
    log_j = ufl.ln(ufl.det(F))
    return (
        p["mu"] / 2 * (ufl.tr(C) - 3 - 2 * log_j)
        + p["lambda"] / 2 * log_j**2
        + p["fibre"] / 2 * E[2, 2] ** 2
        + p["coupling"] * (E[0, 0] + E[1, 1]) * E[2, 2]
        + 2 * p["shear_XZ"] * (E[0, 2] ** 2 + E[1, 2] ** 2)
        + 2 * p["shear_XY"] * E[0, 1] ** 2
    )


NEO_HOOKEAN = Law("neo_hookean", _parameters, _energy, homogeneous=True)

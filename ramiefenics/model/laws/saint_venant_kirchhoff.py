"""St. Venant-Kirchhoff: second Piola-Kirchhoff stress linear in the Green-Lagrange strain.

This is what LS-DYNA's MAT_002 computes, and hence the published model. It softens without bound in
compression: a layer collapses through its thickness at a stretch of 1/sqrt(3).
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import ufl

from ramiefenics.model.laws.base import Expr, Law, stiffness_entries
from ramiefenics.specification import Material


def _parameters(material: Material) -> dict[str, float]:
    c11, c12, c13, c33 = stiffness_entries(material.elastic)
    elastic = material.elastic
    return {
        "C11": c11,
        "C12": c12,
        "C13": c13,
        "C33": c33,
        "G_XZ": elastic.G_XZ_MPa,
        "G_XY": elastic.G_XY,
    }


def _energy(F: Expr, p: Mapping[str, Expr]) -> Expr:
    E = (F.T * F - ufl.Identity(3)) / 2
    return (
        p["C11"] / 2 * (E[0, 0] ** 2 + E[1, 1] ** 2)
        + p["C12"] * E[0, 0] * E[1, 1]
        + p["C13"] * (E[0, 0] + E[1, 1]) * E[2, 2]
        + p["C33"] / 2 * E[2, 2] ** 2
        + 2 * p["G_XZ"] * (E[0, 2] ** 2 + E[1, 2] ** 2)
        + 2 * p["G_XY"] * E[0, 1] ** 2
    )


SAINT_VENANT_KIRCHHOFF = Law(
    "svk", _parameters, _energy, least_stretch=1.0 / math.sqrt(3.0), homogeneous=True
)

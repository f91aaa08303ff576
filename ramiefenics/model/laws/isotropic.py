"""Isotropic neo-Hookean solid, ``mu/2 (J^(-2/3) I_1 - 3) + kappa/2 (J - 1)^2``.

This is what most finite-element codes call neo-Hookean (Holzapfel 2000, section 6.5). It serves to
compare codes, and for layers that have no fibres.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import ufl

from ramiefenics.model.laws.base import Expr, Law
from ramiefenics.specification import Material, SpecificationError


def _parameters(material: Material) -> dict[str, float]:
    elastic = material.elastic
    young, nu = elastic.E_X_MPa, elastic.nu_XY
    mu = young / (2 * (1 + nu))
    same = {"E_Z_MPa": young, "nu_XZ": nu, "G_XZ_MPa": mu, "G_XY": mu}
    for name, value in same.items():
        if not np.isclose(getattr(elastic, name), value, rtol=1e-6):
            raise SpecificationError(
                f"elastic.{name}",
                getattr(elastic, name),
                f"must be {value:.6g} for the law isotropic, to agree with E_X_MPa and nu_XY",
            )
    return {"mu": mu, "kappa": young / (3 * (1 - 2 * nu))}


def _energy(F: Expr, p: Mapping[str, Expr]) -> Expr:
    J = ufl.det(F)
    shape = J ** (-2 / 3) * ufl.inner(F, F) - 3
    return p["mu"] / 2 * shape + p["kappa"] / 2 * (J - 1) ** 2


ISOTROPIC = Law("isotropic", _parameters, _energy, homogeneous=True)

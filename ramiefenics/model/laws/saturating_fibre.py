"""The default law: stable under crushing of the section and under compression of the fibres.

Four parts, with f_i = F e_i, J = det F, lam = |f_3|:

- neo-Hookean cross-section, ``mu/2 (I1 - 3 - 2 ln J) + lambda/2 (ln J)^2``;
- fibre, Psi(e) with ``e = lam - 1 + r ln(J / lam)``: the second term carries the Poisson coupling.
  Linear in tension; in compression the stress saturates,
  ``Psi' = h e - s_c tanh((k - h) |e| / s_c)``, as a bundle of misaligned fibres that kinks
  (Rosen 1965; Budiansky and Fleck 1993), with the residual tangent h;
- axial shear, ``(G_XZ - mu)/2 (|f_3|^2 |cof(F) e_3|^2 / J^2 - 1)``: unlike a quadratic term it
  does not weaken when the layer is crushed (it is polyconvex: |cof(F) e_3| / J is the spacing of
  the fibres' planes);
- in-plane shear beyond Eq. 4, ``(G_XY - mu)/2 cos^2(f_1, f_2)``, zero by default.
"""

from __future__ import annotations

from collections.abc import Mapping

import ufl

from ramiefenics.model.laws.base import Expr, Law, stiffness_entries
from ramiefenics.specification import Material, SpecificationError


def _parameters(material: Material) -> dict[str, float]:
    c11, c12, c13, c33 = stiffness_entries(material.elastic)
    g_xz = material.elastic.G_XZ_MPa
    mu = (c11 - c12) / 2
    axial = c33 - 2 * mu - c13
    ratio = (c13 - c12) / axial if axial > 0 else 0.0
    tangent = axial / (1 - ratio)
    residual = material.fibre_compression.residual_tangent
    if residual * g_xz >= tangent:
        raise SpecificationError(
            "fibre_compression.residual_tangent",
            residual,
            f"must be below {tangent / g_xz:.4g} = k / G_XZ for the law saturating_fibre",
        )
    return {
        "mu": mu,
        "lambda": c12 - tangent * ratio**2,
        "r": ratio,
        "k": tangent,
        "s_c": material.fibre_compression.strength * g_xz,
        "h": residual * g_xz,
        "shear_XZ": g_xz - mu,
        "shear_XY": material.elastic.G_XY - mu,
    }


def _energy(F: Expr, p: Mapping[str, Expr]) -> Expr:
    f1, f2, f3 = (F[:, i] for i in range(3))
    area = ufl.cross(f1, f2)
    J = ufl.dot(area, f3)
    log_j = ufl.ln(J)
    stretch_squared = ufl.dot(f3, f3)
    stretch = ufl.sqrt(stretch_squared)
    e = stretch - 1 + p["r"] * (log_j - ufl.ln(stretch))
    return (
        p["mu"] / 2 * (ufl.inner(F, F) - 3 - 2 * log_j)
        + p["lambda"] / 2 * log_j**2
        + _fibre_energy(e, p)
        + p["shear_XZ"] / 2 * (stretch_squared * ufl.dot(area, area) / J**2 - 1)
        + p["shear_XY"] / 2 * ufl.dot(f1, f2) ** 2 / (ufl.dot(f1, f1) * ufl.dot(f2, f2))
    )


def _fibre_energy(e: Expr, p: Mapping[str, Expr]) -> Expr:
    drop = p["k"] - p["h"]
    x = drop * abs(e) / p["s_c"]
    log_cosh = x + ufl.ln((1 + ufl.exp(-2 * x)) / 2)  # does not overflow, unlike cosh
    compression = p["h"] / 2 * e**2 + p["s_c"] ** 2 / drop * log_cosh
    return ufl.conditional(ufl.ge(e, 0), p["k"] / 2 * e**2, compression)


SATURATING_FIBRE = Law("saturating_fibre", _parameters, _energy)

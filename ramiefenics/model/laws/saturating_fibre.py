"""The default law, stable under crushing of the section and under compression of the fibres.

With f_i = F e_i, J = det F, I_1 = F : F and the fibres' stretch lambda = |f_3|, the energy has five
parts:

- neo-Hookean cross-section, ``mu/2 (I_1 - 3 - 2 ln J) + lambda'/2 (ln J)^2``;
- densification, ``d/24 (2 mu + lambda') ((ln J)^4 + (I_1 - 3 - 2 ln J)^2 / 4)``, which does not
  affect small strains;
- fibre, Psi(e) with ``e = lambda - 1 + r ln(J / lambda)``, whose last term is the Poisson
  coupling. The stress is linear in tension, ``Psi' = k e``, and saturates in compression,
  ``Psi' = h e - s_c tanh((k_c - h) |e| / s_c)``, with the initial tangent k_c, which equals k
  unless the fibres are bimodular. Damage limits the energy (Volokh 2007):
  ``Psi / (1 + c_D Psi)``, so that the stress falls by the factor ``(1 + c_D Psi)^-2``;
- axial shear, ``(G_XZ - mu)/2 f(q)``, where ``q = |f_3|^2 |cof(F) e_3|^2 / J^2 - 1`` is the squared
  tangent of the angle by which the fibres lean from the normal of their cross-section. Unlike a
  term quadratic in the Green-Lagrange strain E_13, this does not weaken when the layer is crushed.
  The shear stress saturates: ``f = R q + 2 (1 - R) gamma_Y^2 (sqrt(1 + q / gamma_Y^2) - 1)``;
- in-plane shear, ``(G_XY - mu)/2 (f_1 . f_2)^2 / (|f_1|^2 |f_2|^2)``, the excess over an isotropic
  plane's, which is zero by default.

Shear has to saturate because, under a shear stress tau, rank-one disturbances that do not lean the
fibres release energy at the rate tau and are resisted by mu and lambda' alone, which are some forty
times smaller than G_XZ. A law that is linear in q loses ellipticity in the crushed phloem after a
few millimetres of travel.

Densification has two parts because crushing lowers J, whereas the free surface of a bent wall,
compressed in one direction, expands in the other. It would crease at any wavelength when compressed
to half its length (Biot 1963). The square of the neo-Hookean energy, which is polyconvex, stiffens
this deformation too.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

import ufl

from ramiefenics.model.laws.base import Expr, Law, stiffness_entries
from ramiefenics.specification import Material, SpecificationError

NO_FIBRES = 1e-9
"""Value of ``C_33 - 2 mu - C_13`` over C_33 below which a layer has no fibres, like a foam."""

DAMAGE_STRAIN = 0.05
"""Tensile strain eps_D to which `LargeStrain.fibre_damage` refers."""


def _parameters(material: Material) -> dict[str, float]:
    c11, c12, c13, c33 = stiffness_entries(material.elastic)
    g_xz = material.elastic.G_XZ_MPa
    mu = (c11 - c12) / 2
    axial = c33 - 2 * mu - c13
    large_strain = material.large_strain
    if abs(axial) > NO_FIBRES * c33:
        ratio = (c13 - c12) / axial if axial > 0 else 0.0
        tangent = axial / (1 - ratio)
        residual = large_strain.fibre_residual_tangent * g_xz
        strength = large_strain.fibre_strength * g_xz
    else:
        ratio, tangent, residual, strength = 0.0, NO_FIBRES * c33, 0.0, NO_FIBRES * c33
    compressive = tangent * (1 - large_strain.bimodularity)
    if residual >= compressive:
        raise SpecificationError(
            "large_strain.fibre_residual_tangent",
            large_strain.fibre_residual_tangent,
            f"must be below {compressive / g_xz:.4g} = k_c / G_XZ, the fibres' tangent in "
            "compression, for the law saturating_fibre",
        )
    return {
        "mu": mu,
        "lambda": c12 - tangent * ratio**2,
        "r": ratio,
        "k": tangent,
        "k_c": compressive,
        "s_c": strength,
        "h": residual,
        "c": ((1 - large_strain.fibre_damage) ** -0.5 - 1) / (tangent * DAMAGE_STRAIN**2 / 2),
        "R": large_strain.shear_residual_tangent,
        "gamma_Y": large_strain.shear_yield_strain,
        "d": large_strain.densification,
        "shear_XZ": g_xz - mu,
        "shear_XY": material.elastic.G_XY - mu,
    }


def _energy(F: Expr, p: Mapping[str, Expr]) -> Expr:
    return energy_with_fibres(F, p, fibre_energy)


def energy_with_fibres(
    F: Expr, p: Mapping[str, Expr], of_fibres: Callable[[Expr, Mapping[str, Expr]], Expr]
) -> Expr:
    """Return the energy above with another energy of the fibres, a function of e and `p`."""
    f1, f2, f3 = (F[:, i] for i in range(3))
    area = ufl.cross(f1, f2)
    J = ufl.dot(area, f3)
    log_j = ufl.ln(J)
    stretch_squared = ufl.dot(f3, f3)
    e = _fibre_strain(ufl.sqrt(stretch_squared), log_j, p)
    distortion = ufl.inner(F, F) - 3 - 2 * log_j
    return (
        p["mu"] / 2 * distortion
        + p["lambda"] / 2 * log_j**2
        + p["d"] / 24 * (2 * p["mu"] + p["lambda"]) * (log_j**4 + distortion**2 / 4)
        + of_fibres(e, p)
        + p["shear_XZ"] / 2 * _saturated(stretch_squared * ufl.dot(area, area) / J**2 - 1, p)
        + p["shear_XY"] / 2 * ufl.dot(f1, f2) ** 2 / (ufl.dot(f1, f1) * ufl.dot(f2, f2))
    )


def fibre_strain(F: Expr, p: Mapping[str, Expr]) -> Expr:
    """Return the fibres' strain e."""
    return _fibre_strain(ufl.sqrt(ufl.dot(F[:, 2], F[:, 2])), ufl.ln(ufl.det(F)), p)


def _fibre_strain(stretch: Expr, log_j: Expr, p: Mapping[str, Expr]) -> Expr:
    return stretch - 1 + p["r"] * (log_j - ufl.ln(stretch))


def _saturated(q: Expr, p: Mapping[str, Expr]) -> Expr:
    yield_squared = p["gamma_Y"] ** 2
    saturating = 2 * yield_squared * (ufl.sqrt(1 + q / yield_squared) - 1)
    return p["R"] * q + (1 - p["R"]) * saturating


def fibre_energy(e: Expr, p: Mapping[str, Expr]) -> Expr:
    """Return the energy of fibres at the strain e, damage included, N/mm2."""
    elastic = undamaged_energy(e, p)
    return elastic / (1 + p["c"] * elastic)


def undamaged_energy(e: Expr, p: Mapping[str, Expr]) -> Expr:
    """Return the energy Psi of undamaged fibres at the strain e, N/mm2."""
    drop = p["k_c"] - p["h"]
    x = drop * abs(e) / p["s_c"]
    log_cosh = x + ufl.ln((1 + ufl.exp(-2 * x)) / 2)  # does not overflow, unlike cosh
    compression = p["h"] / 2 * e**2 + p["s_c"] ** 2 / drop * log_cosh
    return ufl.conditional(ufl.ge(e, 0), p["k"] / 2 * e**2, compression)


def fibre_stress(e: Expr, p: Mapping[str, Expr]) -> Expr:
    """Return the stress of fibres at the strain e, damage included, MPa."""
    e = ufl.variable(e)
    return ufl.diff(fibre_energy(e, p), e)


SATURATING_FIBRE = Law("saturating_fibre", _parameters, _energy, homogeneous=True)

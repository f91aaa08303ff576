"""The default law for a tissue whose section is crushed permanently.

The deformation gradient is ``F = F_e F_p`` with a plastic part F_p within the section (Lee 1969).
The energy per undeformed volume is the default law's energy of F_e, because the amount of cell
wall, with the fibres in it, does not change. M, the block of the elastic part's Mandel stress
``F_e^T dW/dF_e`` within the section, has two principal values. Where one of them is a pressure
above

    Y = C_11 (eps_c / (1 - alpha_p / alpha_D) + y),    alpha_p = -ln det F_p,

the tissue is crushed along that direction, and only along it: cells that collapse do not bulge
(Gibson and Ashby 1997, section 5.3). As the area loss alpha_p approaches alpha_D, where the cells
are closed, Y grows without limit. Tension does not reopen the cells. Of the strain beyond Y, the
share ``crushed_share`` crushes the tissue, and the rest raises y permanently. Crushing by the
amounts z_i along the principal directions d_i multiplies F_p from the left by
``exp(-sum z_i d_i (x) d_i)``. It lowers the pressure along d_i by ``C_11 z_i + C_12 z_j``,
according to the stiffness C_ij at rest, so that the amounts follow in closed form from the trial
stress. The difference between that and the law's own stiffness is left to the next step.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import ufl

from ramiefenics.model.laws.base import Constant, Expr, Law, Memory, State, stiffness_entries
from ramiefenics.model.laws.saturating_fibre import SATURATING_FIBRE, fibre_strain, fibre_stress
from ramiefenics.specification import Material

CONSTANTS = (
    Constant("crushing_strain", "1", default=0.05, above=0.0),  # eps_c
    Constant("densified", "1", default=0.4, above=0.0),  # alpha_D
    Constant("crushed_share", "1", default=1.0, at_least=0.0, at_most=1.0),
)

START: dict[str, Any] = {"unloading": ((1.0, 0.0), (0.0, 1.0)), "resistance": 0.0}
"""Internal variables of the section at rest: the inverse of F_p, and the hardening y."""

ROUNDING = 1e-10
"""Half difference of the principal stresses over C_11 below which directions are smoothed out."""


def parameters(material: Material) -> dict[str, float]:
    """Return the default law's parameters, and those needed for crushing."""
    c11, c12, _, _ = stiffness_entries(material.elastic)
    return SATURATING_FIBRE.parameters(material) | {"C11": c11, "rho": c12 / c11}


def elastic_part(F: Expr, unloading: Expr) -> Expr:
    """Return F_e, given the block of F_p^-1 within the section, which has UFL shape (2, 2)."""
    u = unloading
    return F * ufl.as_matrix(((u[0, 0], u[0, 1], 0), (u[1, 0], u[1, 1], 0), (0, 0, 1)))


def _energy(F: Expr, p: Mapping[str, Expr], state: State) -> Expr:
    return SATURATING_FIBRE.energy(elastic_part(F, state["unloading"]), p)


def _update(F: Expr, p: Mapping[str, Expr], last: State, duration: Expr) -> State:
    return crushed(F, p, last, lambda elastic: fibre_stress(fibre_strain(elastic, p), p))


def crushed(
    F: Expr, p: Mapping[str, Expr], last: State, stress_of_fibres: Callable[[Expr], Expr]
) -> dict[str, Expr]:
    """Return the internal variables of the section at the end of a step.

    Parameters
    ----------
    F, p, last
        As for `Memory.update`.
    stress_of_fibres
        Function that returns the fibres' stress Psi', MPa, from F_e.
    """
    u = last["unloading"]
    elastic = elastic_part(F, u)
    mean, half, shear = _section_stress(elastic, stress_of_fibres(elastic), p)
    radius = ufl.sqrt(half**2 + shear**2 + ROUNDING**2)
    gained = last["resistance"]
    left = p["densified"] - ufl.ln(ufl.det(u))
    first, second, harder = _amounts(radius - mean - gained, -radius - mean - gained, left, p)
    # exp(z_1 d_1 (x) d_1 + z_2 d_2 (x) d_2), d_1 along the higher pressure
    middle = (ufl.exp(first) + ufl.exp(second)) / 2
    apart = (ufl.exp(first) - ufl.exp(second)) / 2 / radius
    grown = ufl.as_matrix(
        ((middle - apart * half, -apart * shear), (-apart * shear, middle + apart * half))
    )
    return {"unloading": u * grown, "resistance": gained + harder}


def _section_stress(F: Expr, of_fibres: Expr, p: Mapping[str, Expr]) -> tuple[Expr, Expr, Expr]:
    """Return mean, half difference and shear of M, the section's Mandel stress, over C_11.

    The shear energies do not contribute, as stretching the section does not change them. The
    exception is the energy of a G_XY other than Eq. 4's, which is neglected here.
    """
    f1, f2 = F[:, 0], F[:, 1]
    c11, c22, c12 = ufl.dot(f1, f1), ufl.dot(f2, f2), ufl.dot(f1, f2)
    log_j = ufl.ln(ufl.det(F))
    distortion = ufl.inner(F, F) - 3 - 2 * log_j
    densified = p["d"] / 24 * (2 * p["mu"] + p["lambda"])
    by_shape = (p["mu"] + densified * distortion) / p["C11"]
    by_volume = p["lambda"] * log_j + 4 * densified * log_j**3
    mean = by_shape * ((c11 + c22) / 2 - 1) + (by_volume + p["r"] * of_fibres) / p["C11"]
    return mean, by_shape * (c11 - c22) / 2, by_shape * c12


def _amounts(high: Expr, low: Expr, left: Expr, p: Mapping[str, Expr]) -> tuple[Expr, Expr, Expr]:
    """Return z_1 and z_2, the crushing along both directions, and the increase of y.

    Parameters
    ----------
    high, low
        Higher and lower trial pressure over C_11, as if nothing were crushed in this step, less
        y before the step.
    left
        Area loss still possible before the step, ``alpha_D - alpha_p``.
    p
        The law's parameters.
    """
    rho, share, first_y = p["rho"], p["crushed_share"], p["crushing_strain"] * p["densified"]

    def beyond(pressure: Expr, stiffness: Expr, times: int) -> Expr:
        """Return the strain beyond Y, summed over the directions that are crushed.

        It solves ``(pressure - falls * strain) * (left - share * strain) = times * first_y``.
        """
        falls = share * stiffness + times * (1 - share)
        root = ufl.sqrt(
            (falls * left - share * pressure) ** 2 + 4 * falls * share * times * first_y
        )
        over = pressure * left - times * first_y
        return 2 * over / (falls * left + share * pressure + root)

    alone = beyond(high, ufl.as_ufl(1.0), 1)
    both = ufl.gt((1 - rho) * share * alone, high - low)
    strain = ufl.conditional(both, beyond(high + low, 1 + rho, 2), alone)
    difference = ufl.conditional(both, (high - low) / (1 - rho), share * alone)
    yields = ufl.gt(high * left, first_y)
    first, second, harder = (
        ufl.conditional(yields, amount, 0.0)
        for amount in (
            (share * strain + difference) / 2,
            (share * strain - difference) / 2,
            (1 - share) * strain,
        )
    )
    return first, second, harder


CRUSHING = Law(
    "crushing",
    parameters,
    _energy,
    homogeneous=True,
    constants=CONSTANTS,
    memory=Memory(START, _update),
)

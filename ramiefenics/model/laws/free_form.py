"""The default law with free-form stresses of the fibres and of the crushed section.

To the default law's energy it adds

    k psi(e) + (2 mu + lambda') chi(alpha),    alpha = ln(J / lambda),

where e is the fibres' strain, lambda = |f_3| their stretch, k their tangent, and alpha the
logarithm of the section's area over that at rest. The added tangents psi'' and chi'' are piecewise
linear. They are zero at rest, have given values at the fibre strains `STRAINS` (separately for
tension and compression) and at the area losses `LOSSES` of a crushed section, and are constant
beyond. The energies are therefore twice differentiable and linear in these values, and the
stiffness at rest does not change.
"""

from __future__ import annotations

from collections.abc import Mapping

import ufl

from ramiefenics.model.laws.base import Constant, Expr, Law
from ramiefenics.model.laws.saturating_fibre import (
    SATURATING_FIBRE,
    energy_with_fibres,
    fibre_energy,
)

STRAINS = (0.015, 0.03, 0.06, 0.12)
"""Strains of the fibres, in tension or compression, at which the added tangent over k is given."""

LOSSES = (0.05, 0.1, 0.2, 0.4)
"""Area losses -alpha at which the section's added tangent over ``2 mu + lambda'`` is given."""

PULLED, PRESSED, CRUSHED = (
    tuple(f"{name}_{number}" for number, _ in enumerate(knots, start=1))
    for name, knots in (("pulled", STRAINS), ("pressed", STRAINS), ("crushed", LOSSES))
)
"""Names of the constants that give the added tangents at these points."""


def _energy(F: Expr, p: Mapping[str, Expr]) -> Expr:
    def of_fibres(e: Expr, p: Mapping[str, Expr]) -> Expr:
        pulled = _twice_integrated(e, STRAINS, [p[name] for name in PULLED])
        pressed = _twice_integrated(-e, STRAINS, [p[name] for name in PRESSED])
        return fibre_energy(e, p) + p["k"] * (pulled + pressed)

    loss = ufl.ln(ufl.sqrt(ufl.dot(F[:, 2], F[:, 2]))) - ufl.ln(ufl.det(F))
    section = _twice_integrated(loss, LOSSES, [p[name] for name in CRUSHED])
    return energy_with_fibres(F, p, of_fibres) + (2 * p["mu"] + p["lambda"]) * section


def _twice_integrated(x: Expr, knots: tuple[float, ...], values: list[Expr]) -> Expr:
    """Return the second integral from 0 of a piecewise linear function that is 0 for x < 0."""
    before, energy = (0.0, ufl.as_ufl(0.0)), ufl.as_ufl(0.0)
    for knot, value in zip(knots, values, strict=True):
        slope = (value - before[1]) / (knot - before[0])
        energy += slope / 6 * (_positive(x - before[0]) ** 3 - _positive(x - knot) ** 3)
        before = (knot, value)
    return energy


def _positive(x: Expr) -> Expr:
    return ufl.conditional(ufl.gt(x, 0), x, 0.0)


FREE_FORM = Law(
    "free_form",
    SATURATING_FIBRE.parameters,
    _energy,
    homogeneous=True,
    constants=tuple(Constant(name, "1", default=0.0) for name in (*PULLED, *PRESSED, *CRUSHED)),
)

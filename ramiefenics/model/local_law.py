"""A law whose stiffness, fibre direction and strain at rest vary from point to point.

The energy per undeformed volume is ``k_m / (s w^2) W(F Q S)``. The factor k_m multiplies all
moduli. Q is the rotation that turns Z into the fibres' direction the shortest way. The stretch of
the tissue from its stress-free state to the undeformed stalk is ``S = diag(w, w, s)`` (growth as a
multiplicative part of the deformation: Rodriguez, Hoger and McCulloch 1994, Journal of Biomechanics
27, 455-467).
"""

from __future__ import annotations

import functools
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import ufl

from ramiefenics.model.laws.base import Expr, Law, Memory, State

STIFFNESS, FIBRE_X, FIBRE_Y, STRETCH, WIDTH = (
    f"local_{name}" for name in ("stiffness", "fibre_x", "fibre_y", "stretch", "width")
)
"""Parameters that may vary from point to point.

They are k_m, two components of the fibres' direction, and s together with w.
"""


@functools.cache
def local_law(law: Law, given: tuple[str, ...]) -> Law:
    """Return a law with some of the parameters above, or the law itself if none are given."""
    if not given:
        return law

    def energy(F: Expr, p: Mapping[str, Expr], *state: State) -> Expr:
        return _share(p) * law.energy(_elastic(F, p), p, *state)

    return replace(law, energy=energy, memory=law.memory and _local_memory(law.memory))


def _local_memory(memory: Memory) -> Memory:
    stated = memory.dissipation

    def update(F: Expr, p: Mapping[str, Expr], last: State, duration: Expr) -> State:
        return memory.update(_elastic(F, p), p, last, duration)

    def dissipation(
        F: Expr, p: Mapping[str, Expr], last: State, now: State, duration: Expr
    ) -> Expr:
        assert stated is not None
        return _share(p) * stated(_elastic(F, p), p, last, now, duration)

    return replace(memory, update=update, dissipation=stated and dissipation)


def fibre(p: Mapping[str, Any]) -> Expr:
    """Return the fibres' direction at rest, UFL shape (3,)."""
    x, y = p[FIBRE_X], p[FIBRE_Y]
    return ufl.as_vector((x, y, ufl.sqrt(1 - x**2 - y**2)))


def _share(p: Mapping[str, Expr]) -> Expr:
    """Return the factor ``k_m / (s w^2)`` on the energy."""
    return p.get(STIFFNESS, 1) / (p[STRETCH] * p[WIDTH] ** 2 if STRETCH in p else 1)


def _elastic(F: Expr, p: Mapping[str, Expr]) -> Expr:
    """Return ``F Q S``, the deformation gradient of stress-free tissue with fibres along Z."""
    first, second, third = (F[:, i] for i in range(3))
    if FIBRE_X in p:
        d = fibre(p)
        tilt = (first * d[0] + second * d[1]) / (1 + d[2]) + third
        first, second, third = first - d[0] * tilt, second - d[1] * tilt, F * d
    if STRETCH in p:
        first, second, third = p[WIDTH] * first, p[WIDTH] * second, p[STRETCH] * third
    return ufl.as_matrix([[column[i] for column in (first, second, third)] for i in range(3)])

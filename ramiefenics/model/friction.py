"""Coulomb friction that remembers: what a point has slid weakens it.

A point of the surface slips by the vector s. The share b of the friction that opposes it, a vector
of the unit ball, builds up over a short presliding length d (Dahl 1968),

    b' = (s' - b |s'|) / d,

so that the slip d b springs back and the rest is slid for good. Sliding weakens the coefficient
over a length of its own (slip weakening: Ida 1972), from the static to the dynamic one,

    mu = mu_d + (mu_s - mu_d) exp(-k / L),    k' = |s' - d b'|,

and friction is ``-mu p b``. It depends on the path alone, not on its speed nor on the steps by
which it is followed: b is integrated exactly along the straight slip of a step, and k is the length
of what is slid in it. For d to 0 the law is Coulomb's. A point that touches no more forgets.
"""

from __future__ import annotations

from dataclasses import dataclass

import ufl
from dolfinx import fem
from dolfinx import mesh as dmesh

from ramiefenics.model.laws.base import Expr
from ramiefenics.specification import Friction

ROUNDING = 1e-6
"""Slip over the presliding length at which its magnitude is rounded off, to be differentiable."""


@dataclass(frozen=True)
class Grip:
    """How friction holds a point; in UFL.

    Attributes
    ----------
    mobilised
        The share b of friction that opposes slip, shape (3,).
    slid_mm
        The length k slid since the point touched.
    """

    mobilised: Expr
    slid_mm: Expr


class FrictionLaw:
    """The law above, its constants as data to the compiled forms.

    Parameters
    ----------
    mesh
        Where the forms are integrated.
    friction
        Coefficients, and the length over which they fall.
    presliding_mm
        The length d.
    """

    def __init__(self, mesh: dmesh.Mesh, friction: Friction, presliding_mm: float) -> None:
        self._static = fem.Constant(mesh, float(friction.static))
        self._dynamic = fem.Constant(mesh, float(friction.dynamic))
        self._weakening = fem.Constant(mesh, float(friction.weakening_mm))
        self._presliding = fem.Constant(mesh, float(presliding_mm))

    def slip(self, before: Grip, slip: Expr) -> Grip:
        """Return the grip after a straight slip, mm, in the tangent plane of `before`."""
        d = self._presliding
        length = _length(slip / d)
        left = ufl.exp(-length)
        mobilised = before.mobilised * left + slip / d * (1 - left) / length
        slid = slip - d * (mobilised - before.mobilised)
        return Grip(mobilised, before.slid_mm + d * (_length(slid / d) - ROUNDING))

    def opposed_slip(self, before: Grip, slip: Expr) -> Expr:
        """Return what largest friction, times it, dissipates along a straight slip, mm.

        Of the work ``mu p b.s'`` against friction, the part ``mu p b.d b'`` springs back with the
        slip; what dissipates is ``mu p b.(s' - d b') = mu p |b|^2 |s'|``, which is never negative.
        This is the integral of ``|b|^2 |s'|``, exact like b.
        """
        d, b = self._presliding, before.mobilised
        length = _length(slip / d)
        left, direction = ufl.exp(-length), slip / d / length
        fading = (1 - left**2) / 2
        growing = ufl.max_value(length - 2 * (1 - left) + fading, 0)  # which rounding may miss
        return d * (
            fading * ufl.dot(b, b)
            + (1 - left) ** 2 * ufl.dot(b, direction)
            + growing * ufl.dot(direction, direction)
        )

    def coefficient(self, grip: Grip) -> Expr:
        """Return the coefficient of friction."""
        weakened = ufl.exp(-grip.slid_mm / self._weakening)
        return self._dynamic + (self._static - self._dynamic) * weakened


def _length(vector: Expr) -> Expr:
    return ufl.sqrt(ufl.dot(vector, vector) + ROUNDING**2)

"""Coulomb friction with memory, which weakens with the distance that a point has slid.

A point of the surface slips by the vector s. The mobilised share b of the friction, a vector in the
unit ball, builds up over a short presliding length d (Dahl 1968),

    b' = (s' - b |s'|) / d,

so that the slip d b is recoverable and the rest is permanent. Permanent slip k weakens the
coefficient of friction from its static to its dynamic value over another length L (slip weakening:
Ida 1972),

    mu = mu_d + (mu_s - mu_d) exp(-k / L),    k' = |s' - d b'|,

and the friction traction is ``-mu p b``. It depends on the path alone, not on its speed or on the
steps by which it is followed: b is integrated exactly along the straight slip of a step, and k
grows by the length of the step's permanent slip. In the limit of d = 0 the law is Coulomb's. A
point that loses contact loses its state.
"""

from __future__ import annotations

from dataclasses import dataclass

import ufl
from dolfinx import fem
from dolfinx import mesh as dmesh

from ramiefenics.model.laws.base import Expr
from ramiefenics.specification import Friction

ROUNDING = 1e-6
"""Slip over the presliding length below which its magnitude is smoothed, to be differentiable."""


@dataclass(frozen=True)
class Grip:
    """State of friction at a point, in UFL.

    Attributes
    ----------
    mobilised
        Mobilised share b of the friction, shape (3,).
    slid_mm
        Length k of permanent slip since the point came into contact.
    """

    mobilised: Expr
    slid_mm: Expr


class FrictionLaw:
    """The law above, with its constants as data of the compiled forms.

    Parameters
    ----------
    mesh
        Mesh on which the forms are integrated.
    friction
        Coefficients, and the length L over which the coefficient falls.
    presliding_mm
        Length d.
    """

    def __init__(self, mesh: dmesh.Mesh, friction: Friction, presliding_mm: float) -> None:
        self._static = fem.Constant(mesh, float(friction.static))
        self._dynamic = fem.Constant(mesh, float(friction.dynamic))
        self._weakening = fem.Constant(mesh, float(friction.weakening_mm))
        self._presliding = fem.Constant(mesh, float(presliding_mm))

    def slip(self, before: Grip, slip: Expr) -> Grip:
        """Return the state after a straight slip, mm, in the tangent plane of `before`."""
        d = self._presliding
        length = _length(slip / d)
        left = ufl.exp(-length)
        mobilised = before.mobilised * left + slip / d * (1 - left) / length
        slid = slip - d * (mobilised - before.mobilised)
        return Grip(mobilised, before.slid_mm + d * (_length(slid / d) - ROUNDING))

    def opposed_slip(self, before: Grip, slip: Expr) -> Expr:
        """Return the integral of ``|b|^2 |s'|`` along a straight slip, mm.

        Times the largest friction ``mu p``, it is the energy dissipated: of the work ``mu p b.s'``
        against friction, the part ``mu p b.d b'`` is recoverable, and what is dissipated is
        ``mu p b.(s' - d b') = mu p |b|^2 |s'|``, which is never negative. The integral is exact,
        like b.
        """
        d, b = self._presliding, before.mobilised
        length = _length(slip / d)
        left, direction = ufl.exp(-length), slip / d / length
        fading = (1 - left**2) / 2
        growing = ufl.max_value(length - 2 * (1 - left) + fading, 0)  # not below 0 by rounding
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

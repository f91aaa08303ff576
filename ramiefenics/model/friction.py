"""Coulomb friction with memory, which weakens with the distance that a point has slid.

A point of the surface slips by the vector s, at the rate s'. The mobilised share b of the friction,
a vector in the unit ball, builds up over a short presliding length l_p (Dahl 1968),

    b' = (s' - b |s'|) / l_p,

so that the slip l_p b is recoverable and the rest is permanent. Permanent slip s_p weakens the
coefficient of friction mu_f from its static value mu_s to its dynamic value mu_d over the weakening
length l_w (slip weakening: Ida 1972),

    mu_f = mu_d + (mu_s - mu_d) exp(-s_p / l_w),    s_p' = |s' - l_p b'|,

and at the contact pressure p the friction traction is ``t_f = -mu_f p b``. It depends on the path
alone, not on its speed or on the steps by which it is followed: b is integrated exactly along the
straight slip of a step, and s_p grows by the length of the step's permanent slip. In the limit of
l_p = 0 the law is Coulomb's. A point that loses contact loses its state.
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
        Length s_p of permanent slip since the point came into contact.
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
        Coefficients, and the length l_w over which the coefficient falls.
    presliding_mm
        Length l_p.
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

        Times the largest friction ``mu_f p``, it is the energy dissipated: of the work
        ``mu_f p b.s'`` against friction, the part ``mu_f p b.l_p b'`` is recoverable, and what is
        dissipated is ``mu_f p b.(s' - l_p b') = mu_f p |b|^2 |s'|``, which is never negative. The
        integral is exact, like b.
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
        """Return the coefficient of friction mu_f."""
        weakened = ufl.exp(-grip.slid_mm / self._weakening)
        return self._dynamic + (self._static - self._dynamic) * weakened


def _length(vector: Expr) -> Expr:
    return ufl.sqrt(ufl.dot(vector, vector) + ROUNDING**2)

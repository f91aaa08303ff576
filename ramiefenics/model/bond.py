"""A bond between two layers: a film of cells, far thinner than the layers, that slips and fails.

A line across the film, along its normal N and as long as its thickness t_b, becomes
``l = t_b F N``. The deformed film has the normal ``n = cof(F) N / |cof(F) N|`` (Nanson's formula),
so its thickness is ``l.n``. The layers have slipped by s_b, ``s_b^2 = |l|^2 - (l.n)^2``, and
separated by ``o_b = l.n - t_b``; neither changes in a rigid rotation. The effective displacement
jump is Delta, ``Delta^2 = s_b^2 + [o_b]_+^2``. With the compliance c_b, the strength tau_b, the
toughness Gamma_b and a penalty k_b, the tractions follow from the energy per undeformed area

    psi_b = (1 - D_b) Delta^2 / (2 c_b) + [-o_b]_+^2 / (2 c_b) + k_b / 3 [-o_b]_+^3,

that of a cohesive surface that weighs slip and separation alike (Ortiz and Pandolfi 1999,
section 3). The damage D_b is that of the largest jump so far, Delta_m:

    1 - D_b = Delta_0 (Delta_1 - Delta_m) / (Delta_m (Delta_1 - Delta_0)),

so that the traction falls linearly from the strength at ``Delta_0 = c_b tau_b`` to zero at
``Delta_1 = 2 Gamma_b / tau_b``, and unloading is to the origin. Below Delta_0, 1 - D_b is 1, and
above Delta_1 it is `LEFT`. Between the two, the energy dissipated per area is
``tau_b Delta_1 (Delta_m - Delta_0) / (2 (Delta_1 - Delta_0))``, which rises from 0 to Gamma_b. The
terms in ``[-o_b]_+``, which damage does not reduce, keep the layers from penetrating each other. An
undamaged bond has the same stiffness on both sides of ``o_b = 0``, which helps Newton's method.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np
import ufl
from dolfinx import fem
from dolfinx import mesh as dmesh

from ramiefenics.model.equations import FormTerm, Term
from ramiefenics.model.jit import compile_form
from ramiefenics.model.laws.base import Expr
from ramiefenics.model.material_memory import MaterialMemory
from ramiefenics.model.solid import Solid, volume_measure
from ramiefenics.specification import Bond

LEFT = 1e-6
"""Share of its stiffness that a failed bond keeps.

Nothing else holds the nodes within the film, which cells of second order have.
"""

ROUNDING_MM = 1e-9
"""Jump below which its magnitude is smoothed, to be differentiable."""

PENETRATION = 0.01
"""Upper bound of the layers' penetration, over the thickness of the outer layer.

The bound holds for a pressure as large as that layer's transverse modulus.
"""


class BondFilm:
    """The film of cells between two layers.

    Parameters
    ----------
    solid
        The layers.
    cells
        Tags of the cells.
    tag
        Tag of the film's cells, which belong to no layer.
    bond
        Constants of the bond.
    penalty_MPa_per_mm2
        The penalty k_b above.
    """

    def __init__(
        self, solid: Solid, cells: dmesh.MeshTags, tag: int, bond: Bond, penalty_MPa_per_mm2: float
    ) -> None:
        self._solid = solid
        self._memory = MaterialMemory(solid.mesh, solid.order, {"largest_mm": 0.0}, cells.find(tag))
        self._dx = volume_measure(solid.mesh, solid.order, cells)(tag)
        self._stiffness, self._strength, self._softens_at, self._fails_at, self._penalty = (
            fem.Constant(solid.mesh, number)
            for number in (
                1.0 / bond.compliance_mm_per_MPa,
                bond.strength_MPa,
                bond.softens_at_mm,
                bond.fails_at_mm,
                penalty_MPa_per_mm2,
            )
        )
        self._state()

    def _state(self) -> None:
        """Express jump Delta, overlap ``[-o_b]_+`` and largest jump Delta_m in UFL."""
        J = ufl.Jacobian(self._solid.mesh)
        lengths = [ufl.dot(J[:, k], J[:, k]) for k in range(3)]
        least = ufl.min_value(lengths[0], ufl.min_value(lengths[1], lengths[2]))
        across = [ufl.conditional(ufl.le(length, least), 1.0, 0.0) for length in lengths]
        base = _area(J, ufl.as_vector(across))
        size = ufl.sqrt(ufl.dot(base, base))
        self._thickness = abs(ufl.det(J)) / size
        F, N = self._solid.gradient(self._solid.displacement), base / size
        line, area = self._thickness * F * N, _area(F, N)
        height = ufl.dot(line, area) / ufl.sqrt(ufl.dot(area, area))
        apart = height - self._thickness
        self._overlap = ufl.max_value(-apart, 0.0)
        slip_squared = ufl.dot(line, line) - height**2
        self._jump_squared = slip_squared + ufl.max_value(apart, 0.0) ** 2
        jump = ufl.sqrt(ufl.max_value(self._jump_squared, 0.0) + ROUNDING_MM**2)
        last = self._memory.last["largest_mm"]
        self._largest = ufl.max_value(jump, last)

    @property
    def _sound(self) -> Expr:
        """The share 1 - D_b above, from Delta_m, Delta_0 and Delta_1."""
        q, q0, q1 = self._largest, self._softens_at, self._fails_at
        softened = ufl.max_value(q0 * (q1 - q) / (q * (q1 - q0)), LEFT)
        return ufl.conditional(ufl.gt(q, q0), softened, 1.0)

    def term(self) -> Term:
        """Return the tractions' contribution to the equations."""
        u, v = self._solid.displacement, ufl.TestFunction(self._solid.space)
        held = self._sound * self._stiffness / 2 * ufl.derivative(self._jump_squared, u, v)
        pressure = self._stiffness * self._overlap + self._penalty * self._overlap**2
        kept_out = pressure * ufl.derivative(self._overlap, u, v)
        return FormTerm((held + kept_out) / self._thickness * self._dx, u)

    def energies(self) -> tuple[float, float]:
        """Return the energies that this rank's cells store, and have dissipated so far, N mm."""
        stored, dissipated = (float(fem.assemble_scalar(form)) for form in self._energies)
        return stored, dissipated

    @cached_property
    def _energies(self) -> tuple[fem.Form, fem.Form]:
        q, q0, q1 = self._largest, self._softens_at, self._fails_at
        stored = self._sound * self._stiffness / 2 * self._jump_squared
        stored += self._stiffness / 2 * self._overlap**2 + self._penalty / 3 * self._overlap**3
        beyond = ufl.max_value(ufl.min_value(q, q1) - q0, 0.0) / (q1 - q0)
        dissipated = self._strength * q1 / 2 * beyond
        made = [compile_form(x / self._thickness * self._dx) for x in (stored, dissipated)]
        return made[0], made[1]

    @cached_property
    def _now(self) -> fem.Expression:
        return self._memory.compile({"largest_mm": self._largest})

    def take_over(self, before: BondFilm) -> None:
        """Take over the largest jumps of the same film before the stalk was turned about Z."""
        self._memory.take_over(before._memory, np.eye(3))

    def remember(self) -> None:
        """Store the current jumps where they are the largest so far."""
        self._memory.remember(self._memory.evaluate(self._now))


def _area(map_: Expr, vector: Expr) -> Expr:
    """Return the cofactor of a map times a vector, UFL shape (3,)."""
    first, second, third = (map_[:, k] for k in range(3))
    return (
        vector[0] * ufl.cross(second, third)
        + vector[1] * ufl.cross(third, first)
        + vector[2] * ufl.cross(first, second)
    )

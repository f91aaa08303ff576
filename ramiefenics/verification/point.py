"""A law at one material point, without a mesh of its own."""

from __future__ import annotations

import numpy as np
import ufl
from dolfinx import fem
from dolfinx import mesh as dmesh
from mpi4py import MPI
from scipy.optimize import fsolve

from ramiefenics.model.jit import compile_expression
from ramiefenics.model.laws import law_named
from ramiefenics.specification import Material
from ramiefenics.verification.study import Array


class Point:
    """Energy, stress and tangent of a law at any deformation gradient.

    Parameters
    ----------
    law
        The law, as in the specification.
    material
        Its constants.

    Attributes
    ----------
    duration_s
        Of the step from what is remembered to the deformation that is asked about.
    """

    def __init__(self, law: str, material: Material) -> None:
        self._mesh = mesh = dmesh.create_unit_cube(
            MPI.COMM_SELF, 1, 1, 1, cell_type=dmesh.CellType.hexahedron
        )
        self._F, self._duration = fem.Constant(mesh, np.eye(3)), fem.Constant(mesh, 0.0)
        found = law_named(law)
        start = {} if found.memory is None else found.memory.start
        self._start = {name: np.asarray(value, dtype=np.float64) for name, value in start.items()}
        self._last = {name: fem.Constant(mesh, value) for name, value in self._start.items()}
        F = ufl.variable(self._F)
        numbers = found.parameters_of(material)
        p = {name: fem.Constant(mesh, float(value)) for name, value in numbers.items()}
        step = F, p, self._last, self._duration
        state, stress = found.state(*step), found.stress(*step)
        self._expressions = {
            "energy": found.stored(F, p, state),
            "stress": stress,
            "tangent": ufl.diff(stress, F),
            "dissipated": found.dissipated(F, p, self._last, state, self._duration),
            **state,
        }
        self._compiled: dict[str, fem.Expression] = {}

    @property
    def duration_s(self) -> float:  # noqa: D102
        return float(self._duration.value)

    @duration_s.setter
    def duration_s(self, value: float) -> None:
        self._duration.value = value

    def _evaluate(self, which: str, F: Array) -> Array:
        if which not in self._compiled:
            middle = np.full((1, 3), 0.5)
            self._compiled[which] = compile_expression(self._expressions[which], middle)
        self._F.value[:] = F
        cell = np.zeros(1, dtype=np.int32)
        return np.asarray(self._compiled[which].eval(self._mesh, cell)).reshape(-1)

    def state(self, F: Array) -> dict[str, Array]:
        """Return the internal variables at the end of a step to F, shape (3, 3)."""
        return {
            name: self._evaluate(name, F).reshape(last.ufl_shape)
            for name, last in self._last.items()
        }

    def forget(self) -> None:
        """Return to rest."""
        for name, value in self._start.items():
            self._last[name].value = value

    def remember(self, F: Array) -> float:
        """End a step at F, shape (3, 3); return what it dissipates, N/mm2."""
        dissipated = float(self._evaluate("dissipated", F)[0]) if self._last else 0.0
        for name, value in self.state(F).items():
            self._last[name].value = value
        return dissipated

    def energy(self, F: Array) -> float:
        """Return the energy per undeformed volume, N/mm2, at F, shape (3, 3)."""
        return float(self._evaluate("energy", F)[0])

    def stress(self, F: Array) -> Array:
        """Return the first Piola-Kirchhoff stress, MPa, shape (3, 3)."""
        return self._evaluate("stress", F).reshape(3, 3)

    def tangent(self, F: Array) -> Array:
        """Return its derivative by F, MPa, shape (3, 3, 3, 3)."""
        return self._evaluate("tangent", F).reshape(3, 3, 3, 3)

    def free_sides(self, prescribed: dict[tuple[int, int], float]) -> Array:
        """Return the symmetric F with some entries prescribed and no stress by the others.

        Parameters
        ----------
        prescribed
            Entries of F, from (row, column), row <= column; both of a pair are set.
        """
        pairs = [(i, j) for i in range(3) for j in range(i, 3) if (i, j) not in prescribed]

        def gradient(free: Array) -> Array:
            F = np.eye(3)
            for values in (prescribed.items(), zip(pairs, free, strict=True)):
                for (i, j), value in values:
                    F[i, j] = F[j, i] = value
            return F

        def stresses(free: Array) -> list[float]:
            P = self.stress(gradient(free))
            return [P[pair] for pair in pairs]

        start = [float(i == j) for i, j in pairs]
        return gradient(fsolve(stresses, start, xtol=1e-13))

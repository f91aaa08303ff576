"""A law at one material point, without a mesh of its own."""

from __future__ import annotations

import numpy as np
import ufl
from dolfinx import fem
from dolfinx import mesh as dmesh
from mpi4py import MPI
from scipy.optimize import fsolve

from ramiefenics.model.jit import compile_expression
from ramiefenics.model.laws import LAWS
from ramiefenics.specification import Material
from ramiefenics.verification.study import Array


class Point:
    """Energy, stress and tangent of a law at any deformation gradient.

    Parameters
    ----------
    law
        Name of the law.
    material
        Its constants.
    """

    def __init__(self, law: str, material: Material) -> None:
        self._mesh = dmesh.create_unit_cube(
            MPI.COMM_SELF, 1, 1, 1, cell_type=dmesh.CellType.hexahedron
        )
        self._F = fem.Constant(self._mesh, np.eye(3))
        F = ufl.variable(self._F)
        parameters = LAWS[law].parameters(material)
        constants = {name: fem.Constant(self._mesh, value) for name, value in parameters.items()}
        energy = LAWS[law].energy(F, constants)
        stress = ufl.diff(energy, F)
        middle = np.full((1, 3), 0.5)
        self._expressions = [
            compile_expression(expression, middle)
            for expression in (energy, stress, ufl.diff(stress, F))
        ]

    def _evaluate(self, which: int, F: Array) -> Array:
        self._F.value[:] = F
        cell = np.zeros(1, dtype=np.int32)
        return np.asarray(self._expressions[which].eval(self._mesh, cell)).reshape(-1)

    def energy(self, F: Array) -> float:
        """Return the energy per undeformed volume, N/mm2, at F, shape (3, 3)."""
        return float(self._evaluate(0, F)[0])

    def stress(self, F: Array) -> Array:
        """Return the first Piola-Kirchhoff stress, MPa, shape (3, 3)."""
        return self._evaluate(1, F).reshape(3, 3)

    def tangent(self, F: Array) -> Array:
        """Return its derivative by F, MPa, shape (3, 3, 3, 3)."""
        return self._evaluate(2, F).reshape(3, 3, 3, 3)

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

"""A law at one material point, without a mesh."""

from __future__ import annotations

import numpy as np
from scipy.optimize import fsolve

from ramiefenics.model.kernels.points import PointKernel
from ramiefenics.model.laws import law_named
from ramiefenics.specification import Material
from ramiefenics.verification.study import Array


class Point:
    """Energy, stress and tangent of a law at any deformation gradient.

    Parameters
    ----------
    law
        Law, as in the specification.
    material
        Constants of the law.

    Attributes
    ----------
    duration_s
        Duration of the step from the remembered state to the deformation that is evaluated.
    """

    def __init__(self, law: str, material: Material) -> None:
        found = law_named(law)
        parameters = found.parameters_of(material)
        self._kernel = PointKernel(found, tuple(parameters))
        self._parameters: Array = np.array(list(parameters.values()))
        start = {} if found.memory is None else dict(found.memory.start)
        self._shapes = {name: np.shape(value) for name, value in start.items()}
        numbers: list[float] = [float(x) for value in start.values() for x in np.ravel(value)]
        self._start: Array = np.array([*numbers, 0.0])
        self._last: Array = self._start
        self.duration_s = 0.0

    def _evaluate(self, which: str, F: Array) -> Array:
        return self._kernel.evaluate(which, F, self._parameters, self._last, self.duration_s)

    def state(self, F: Array) -> dict[str, Array]:
        """Return the internal variables at the end of a step to F, shape (3, 3)."""
        ends = np.cumsum([int(np.prod(shape)) for shape in self._shapes.values()])
        parts = np.split(self._evaluate("update", F), ends)
        return {
            name: part.reshape(shape)
            for (name, shape), part in zip(self._shapes.items(), parts, strict=False)
        }

    def forget(self) -> None:
        """Reset the internal variables to the state at rest."""
        self._last = self._start

    def remember(self, F: Array) -> float:
        """End a step at F, shape (3, 3), and return the energy that it dissipates, N/mm2."""
        before, self._last = self._last, self._evaluate("update", F)
        return float(self._last[-1] - before[-1])

    def energy(self, F: Array) -> float:
        """Return the energy per undeformed volume, N/mm2, at F, shape (3, 3)."""
        return float(self._evaluate("energies", F)[0])

    def stress(self, F: Array) -> Array:
        """Return the first Piola-Kirchhoff stress, MPa, shape (3, 3)."""
        return self._evaluate("stress", F).reshape(3, 3)

    def tangent(self, F: Array) -> Array:
        """Return the derivative of the stress with respect to F, MPa, shape (3, 3, 3, 3)."""
        return self._evaluate("tangent", F).reshape(3, 3, 3, 3)

    def free_sides(self, prescribed: dict[tuple[int, int], float]) -> Array:
        """Return the symmetric F with some entries prescribed and zero stress in the others.

        Parameters
        ----------
        prescribed
            Entries of F by (row, column), row <= column; both entries of a pair are set.
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

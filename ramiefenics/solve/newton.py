"""Newton's method for one step, with a non-monotone line search and a sparse direct solver.

Contact makes the residual non-smooth: the full step often raises it once, when points enter or
leave contact, and converges quadratically right after. A line search that insists on descent then
stalls, so a step only has to beat the largest of the last residuals (Grippo, Lampariello and
Lucidi 1986).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from dolfinx import fem
from dolfinx.fem.petsc import assemble_matrix, assemble_vector, create_matrix, set_bc
from petsc4py import PETSc

RIGID_SHIFT = 1e-9
"""Added to the tangent's diagonal, relative to its mean, in the Newton matrix only: it holds rigid
motions that no friction holds, and does not touch the solution."""

MEMORY = 4
"""Residuals that a step is compared with."""

SHORTEST = 1.0 / 32.0
"""Shortest fraction of a Newton step that is tried."""


@dataclass(frozen=True)
class NewtonOutcome:
    """How a solve ended.

    Attributes
    ----------
    converged
        Whether the residual met the tolerance.
    iterations
        Tangents factorised.
    residual_N
        Norm of the residual at the end.
    reason
        One phrase.
    """

    converged: bool
    iterations: int
    residual_N: float
    reason: str


@dataclass(frozen=True)
class Inertia:
    """Adds ``mass (u - predicted) / time_step^2`` to the residual.

    Attributes
    ----------
    mass
        Lumped, tonne, one entry per degree of freedom.
    predicted
        Where the structure would go without forces, mm.
    time_step_s
        Time step.
    """

    mass: PETSc.Vec
    predicted: PETSc.Vec
    time_step_s: float


class Newton:
    """Solve ``residual(u) = 0`` from the current value of `u`.

    Dirichlet conditions must be met by `u` already.

    Parameters
    ----------
    residual, jacobian
        Compiled forms.
    u
        The unknown; solved in place.
    bcs
        Dirichlet conditions.
    max_iterations
        Where to give up.
    """

    def __init__(
        self,
        residual: fem.Form,
        jacobian: fem.Form,
        u: fem.Function,
        bcs: list[fem.DirichletBC],
        max_iterations: int,
    ) -> None:
        self._residual, self._jacobian, self._u, self._bcs = residual, jacobian, u, bcs
        self._max_iterations = max_iterations
        self._matrix = create_matrix(jacobian)
        self._b = u.x.petsc_vec.duplicate()
        self._step = u.x.petsc_vec.duplicate()
        self._start = u.x.petsc_vec.duplicate()
        self._diagonal = u.x.petsc_vec.duplicate()
        self._inertia: Inertia | None = None
        self._solver = _direct_solver(self._matrix)

    def solve(
        self, tolerance_N: float, largest_update_mm: float, inertia: Inertia | None = None
    ) -> NewtonOutcome:
        """Solve to a residual norm of at most `tolerance_N`.

        Parameters
        ----------
        tolerance_N
            Bound on the Euclidean norm of the residual.
        largest_update_mm
            No displacement component changes by more in one iteration.
        inertia
            Of a time step; none, the default, means equilibrium.
        """
        self._inertia = inertia
        history = [self._evaluate()]
        for iteration in range(self._max_iterations):
            if history[-1] <= tolerance_N:
                return NewtonOutcome(True, iteration, history[-1], "converged")
            if not np.isfinite(history[-1]):
                return NewtonOutcome(False, iteration, history[-1], "an element turned inside out")
            self._assemble_tangent()
            self._solver.solve(self._b, self._step)
            size = self._step.norm(PETSc.NormType.INFINITY)
            if not np.isfinite(size):
                reason = "the tangent could not be factorised"
                return NewtonOutcome(False, iteration + 1, history[-1], reason)
            history.append(self._search(min(1.0, largest_update_mm / size), history[-MEMORY:]))
        converged = history[-1] <= tolerance_N
        reason = "converged" if converged else "too many iterations"
        return NewtonOutcome(converged, self._max_iterations, history[-1], reason)

    def _search(self, fraction: float, last: list[float]) -> float:
        """Go along the Newton step until the residual beats the largest of the last ones."""
        x = self._u.x.petsc_vec
        x.copy(self._start)
        shortest = SHORTEST * fraction
        while True:
            x.waxpy(-fraction, self._step, self._start)
            self._u.x.scatter_forward()
            residual = self._evaluate()
            if residual < max(last) or fraction <= shortest:
                return residual
            fraction /= 2.0

    def _evaluate(self) -> float:
        with self._b.localForm() as local:
            local.set(0.0)
        assemble_vector(self._b, self._residual)
        self._b.ghostUpdate(PETSc.InsertMode.ADD, PETSc.ScatterMode.REVERSE)
        if self._inertia is not None:
            self._add_inertia(self._inertia)
        set_bc(self._b, self._bcs, self._u.x.petsc_vec, -1.0)
        return float(self._b.norm())

    def _add_inertia(self, inertia: Inertia) -> None:
        change = self._diagonal
        change.waxpy(-1.0, inertia.predicted, self._u.x.petsc_vec)
        change.pointwiseMult(change, inertia.mass)
        self._b.axpy(1.0 / inertia.time_step_s**2, change)

    def _assemble_tangent(self) -> None:
        matrix = self._matrix
        matrix.zeroEntries()
        assemble_matrix(matrix, self._jacobian, self._bcs)
        matrix.assemble()
        matrix.getDiagonal(self._diagonal)
        matrix.shift(RIGID_SHIFT * abs(self._diagonal.sum()) / matrix.size[0])
        if self._inertia is not None:
            matrix.getDiagonal(self._diagonal)
            self._diagonal.axpy(1.0 / self._inertia.time_step_s**2, self._inertia.mass)
            matrix.setDiagonal(self._diagonal)

    def residual_norm(self) -> float:
        """Return the norm of the current residual without inertia, N."""
        self._inertia = None
        return self._evaluate()

    def mean_stiffness(self) -> float:
        """Return the mean diagonal entry of the current tangent without inertia, N/mm."""
        self._inertia = None
        self._assemble_tangent()
        self._matrix.getDiagonal(self._diagonal)
        return float(self._diagonal.sum()) / self._matrix.size[0]


def _direct_solver(matrix: PETSc.Mat) -> PETSc.KSP:
    """Return MUMPS with METIS, which orders long thin meshes several times better."""
    solver = PETSc.KSP().create(matrix.comm)
    solver.setOperators(matrix)
    solver.setType("preonly")
    solver.getPC().setType("lu")
    solver.getPC().setFactorSolverType("mumps")
    prefix, name = "ramiefenics_newton_", "mat_mumps_icntl_7"
    options = PETSc.Options()
    options[prefix + name] = 5
    solver.setOptionsPrefix(prefix)
    solver.setFromOptions()
    solver.getPC().setFactorSetUpSolverType()
    options.delValue(prefix + name)
    return solver

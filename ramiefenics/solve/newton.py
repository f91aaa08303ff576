"""Inexact Newton method for one step, with a non-monotone line search.

Contact makes the residual non-smooth: the full step often raises it once, when points enter or
leave contact, and converges quadratically right after. A line search that insists on descent then
stalls, so a step only has to bring the residual below the largest of the last ones (Grippo,
Lampariello and Lucidi 1986).
"""

from __future__ import annotations

import logging
from dataclasses import dataclass

import numpy as np
from dolfinx.fem.petsc import set_bc
from petsc4py import PETSc

from ramiefenics.model.equations import Equations
from ramiefenics.solve.tangent import Tangent

log = logging.getLogger(__name__)

MEMORY = 4
"""Number of earlier residuals with which the residual of a step is compared."""

LOOSEST = 0.1
"""Loosest tolerance on the residual of the linear equations, relative to their right-hand side."""

SHORTEST = 1.0 / 32.0
"""Shortest fraction of a Newton step that is tried."""


@dataclass(frozen=True)
class NewtonOutcome:
    """Outcome of a nonlinear solve.

    Attributes
    ----------
    converged
        Whether the residual met the tolerance.
    iterations
        Newton steps, each with one linear solve.
    residual_N
        Norm of the residual at the end.
    reason
        Why the solve ended, as a phrase.
    """

    converged: bool
    iterations: int
    residual_N: float
    reason: str


@dataclass(frozen=True)
class Inertia:
    """Inertia in a time step: the term ``M (u - u_p) / dt^2`` of the residual.

    Attributes
    ----------
    mass
        Lumped mass M, tonne, one entry per degree of freedom.
    predicted
        Displacement u_p that the structure would reach without forces, mm.
    time_step_s
        Time step dt, s.
    """

    mass: PETSc.Vec
    predicted: PETSc.Vec
    time_step_s: float


class Newton:
    """Newton solver that starts from the current displacement.

    That displacement must meet the Dirichlet conditions of the equations.

    Parameters
    ----------
    equations
        Equations to solve; their displacement is updated in place.
    max_iterations
        Number of iterations after which a solve fails.
    linear_solver
        As in `Stepping`.
    """

    def __init__(
        self,
        equations: Equations,
        max_iterations: int,
        linear_solver: str = "auto",
    ) -> None:
        self._equations, self._u = equations, equations.displacement
        self._max_iterations = max_iterations
        u = self._u
        self._b = u.x.petsc_vec.duplicate()
        self._step = u.x.petsc_vec.duplicate()
        self._start = u.x.petsc_vec.duplicate()
        self._work = u.x.petsc_vec.duplicate()
        self._diagonal = u.x.petsc_vec.duplicate()  # added to the tangent's by inertia
        self._inertia: Inertia | None = None
        self._linear_solver = linear_solver
        self._tangent = Tangent(equations, self._evaluate, linear_solver)

    @property
    def tangent(self) -> Tangent:
        """The tangent and its factors; rebuilt when the equations have a new matrix."""
        if self._tangent.matrix is not self._equations.matrix:
            iterations = self._tangent.iterations
            self._tangent = Tangent(self._equations, self._evaluate, self._linear_solver)
            self._tangent.iterations = iterations
        return self._tangent

    def solve(
        self, tolerance_N: float, largest_update_mm: float, inertia: Inertia | None = None
    ) -> NewtonOutcome:
        """Solve to a residual norm of at most `tolerance_N`.

        Parameters
        ----------
        tolerance_N
            Bound on the Euclidean norm of the residual.
        largest_update_mm
            Largest change of a displacement component in one iteration.
        inertia
            Inertia in a time step; by default there is none, and the solution is an equilibrium.
        """
        self._set_inertia(inertia)
        outcome = self._iterate(tolerance_N, largest_update_mm)
        if not outcome.converged:
            self.tangent.forget()
        return outcome

    def _iterate(self, tolerance_N: float, largest_update_mm: float) -> NewtonOutcome:
        history = [self._norm()]
        for iteration in range(self._max_iterations):
            log.debug("%2d: residual %.3e N, to be %.1e N", iteration, history[-1], tolerance_N)
            if history[-1] <= tolerance_N:
                return NewtonOutcome(True, iteration, history[-1], "converged")
            if not np.isfinite(history[-1]):
                return NewtonOutcome(False, iteration, history[-1], "an element turned inside out")
            forcing = self._forcing(history, tolerance_N)
            added = None if self._inertia is None else self._diagonal
            self.tangent.solve(self._b, self._step, forcing, added)
            size = self._step.norm(PETSc.NormType.INFINITY)
            if not np.isfinite(size) or size == 0.0:
                reason = "the tangent could not be factorised"
                return NewtonOutcome(False, iteration + 1, history[-1], reason)
            history.append(self._search(min(1.0, largest_update_mm / size), history[-MEMORY:]))
        log.debug("%2d: residual %.3e N", self._max_iterations, history[-1])
        converged = history[-1] <= tolerance_N
        reason = "converged" if converged else "too many iterations"
        return NewtonOutcome(converged, self._max_iterations, history[-1], reason)

    @staticmethod
    def _forcing(history: list[float], tolerance_N: float) -> float:
        """Return the tolerance of the linear solve (Eisenstat and Walker 1996, choice 2)."""
        drop = history[-1] / history[-2] if len(history) > 1 else 1.0
        return max(min(LOOSEST, 0.9 * drop**2), 0.5 * tolerance_N / history[-1])

    def _search(self, fraction: float, last: list[float]) -> float:
        """Shorten the Newton step until the residual is below the largest of the last ones."""
        x = self._u.x.petsc_vec
        x.copy(self._start)
        shortest = SHORTEST * fraction
        while True:
            x.waxpy(-fraction, self._step, self._start)
            self._u.x.scatter_forward()
            residual = self._norm()
            if residual < max(last) or fraction <= shortest:
                return residual
            fraction /= 2.0

    def _norm(self) -> float:
        self._evaluate(self._b)
        return float(self._b.norm())

    def _evaluate(self, b: PETSc.Vec) -> None:
        self._equations.residual(b)
        if self._inertia is not None:
            self._work.waxpy(-1.0, self._inertia.predicted, self._u.x.petsc_vec)
            self._work.pointwiseMult(self._work, self._diagonal)
            b.axpy(1.0, self._work)
            set_bc(b, self._equations.bcs, self._u.x.petsc_vec, -1.0)

    def _set_inertia(self, inertia: Inertia | None) -> None:
        """Set the inertia, and discard factors of a tangent without it or with another one."""
        if inertia is not None or self._inertia is not None:
            self.tangent.forget()
        self._inertia = inertia
        if inertia is not None:
            inertia.mass.copy(self._diagonal)
            self._diagonal.scale(1.0 / inertia.time_step_s**2)

    def residual_norm(self) -> float:
        """Return the norm of the current residual without inertia, N."""
        self._set_inertia(None)
        return self._norm()

    def mean_stiffness(self) -> float:
        """Return the mean diagonal entry of the current tangent without inertia, N/mm."""
        return self.tangent.assemble(None)

"""Newton's method for one step, by PETSc's SNES with a sparse direct solver."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from dolfinx import fem
from dolfinx.fem.petsc import assemble_matrix, assemble_vector, create_matrix, set_bc
from petsc4py import PETSc

RIGID_SHIFT = 1e-9
"""Added to the tangent's diagonal, relative to its mean, in the Newton matrix only: it holds rigid
motions that no friction holds, and does not touch the solution."""


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


_REASONS = {
    PETSc.SNES.ConvergedReason.DIVERGED_LINEAR_SOLVE: "the tangent could not be factorised",
    PETSc.SNES.ConvergedReason.DIVERGED_FNORM_NAN: "an element turned inside out",
    PETSc.SNES.ConvergedReason.DIVERGED_MAX_IT: "too many iterations",
    PETSc.SNES.ConvergedReason.DIVERGED_LINE_SEARCH: "the line search found no descent",
}


def _set_options(snes: Any) -> None:
    """Set what petsc4py 3.22 reaches through the options database only."""
    prefix = "ramiefenics_newton_"
    options = PETSc.Options()
    values = {"snes_type": "newtonls", "snes_linesearch_type": "bt", "snes_max_funcs": -1, "mat_mumps_icntl_7": 5}
    for name, value in values.items():
        options[prefix + name] = value
    snes.setOptionsPrefix(prefix)
    snes.setFromOptions()
    for name in values:
        options.delValue(prefix + name)


class Newton:
    """Solve ``residual(u) = 0`` from the current value of `u`.

    Dirichlet conditions are homogeneous or already met by `u`.

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
        comm = u.function_space.mesh.comm
        matrix = create_matrix(jacobian)
        self._x = u.x.petsc_vec.duplicate()
        self._work = u.x.petsc_vec.duplicate()
        self._snes = snes = PETSc.SNES().create(comm)
        snes.setFunction(self._evaluate, self._work)
        snes.setJacobian(self._tangent, matrix, matrix)
        self._max_iterations = max_iterations
        ksp = snes.getKSP()
        ksp.setType("preonly")
        pc = ksp.getPC()
        pc.setType("lu")
        pc.setFactorSolverType("mumps")
        _set_options(snes)

    def _evaluate(self, snes: Any, x: Any, f: Any) -> None:
        x.copy(self._u.x.petsc_vec)
        self._u.x.scatter_forward()
        with f.localForm() as local:
            local.set(0.0)
        assemble_vector(f, self._residual)
        f.ghostUpdate(PETSc.InsertMode.ADD, PETSc.ScatterMode.REVERSE)
        set_bc(f, self._bcs, x, -1.0)

    def _tangent(self, snes: Any, x: Any, matrix: Any, preconditioner: Any) -> None:
        matrix.zeroEntries()
        assemble_matrix(matrix, self._jacobian, self._bcs)
        matrix.assemble()
        matrix.shift(RIGID_SHIFT * abs(matrix.getDiagonal().sum()) / matrix.size[0])

    def solve(self, tolerance_N: float) -> NewtonOutcome:
        """Solve to a residual norm of at most `tolerance_N`."""
        self._u.x.petsc_vec.copy(self._x)
        self._snes.setTolerances(rtol=0.0, atol=tolerance_N, stol=0.0, max_it=self._max_iterations)
        self._snes.solve(None, self._x)
        reason = self._snes.getConvergedReason()
        residual = self._snes.getFunctionNorm()
        converged = reason > 0 and bool(np.isfinite(residual))
        told = "converged" if converged else _REASONS.get(reason, f"SNES reason {reason}")
        return NewtonOutcome(converged, self._snes.getIterationNumber(), residual, told)

"""The linear equations of Newton's method: GMRES behind a factorised tangent of an earlier state.

A factorisation costs as much as dozens of residuals, and the tangent changes little from one
iteration to the next. It is applied as a difference quotient of the residual (Knoll and Keyes
2004), and the factors of an older one precondition it until they are too old.
"""

from __future__ import annotations

import weakref
from collections.abc import Callable

from dolfinx import fem
from dolfinx.fem.petsc import assemble_matrix, create_matrix
from petsc4py import PETSc

RIGID_SHIFT = 1e-7
"""Added to the diagonal of the factorised tangent, relative to its mean: it holds rigid motions
that no friction holds. The solution does not feel a preconditioner."""

DIFFERENCE_MM = 1e-7
"""Largest displacement in the difference quotient: far above rounding, far below what changes
the pattern of contact."""

OLD_ITERATIONS = 10
"""A solve that took more is the last one with its factors."""

MAX_ITERATIONS = 40
"""Where a solve gives up; the direction it has is of use to Newton's line search nevertheless."""


class Tangent:
    """The derivative of a residual at its current state, and how to solve with it.

    Parameters
    ----------
    jacobian
        Compiled form of the derivative.
    bcs
        Dirichlet conditions.
    u
        The state.
    evaluate
        Evaluates the residual at the state into a vector.
    """

    def __init__(
        self,
        jacobian: fem.Form,
        bcs: list[fem.DirichletBC],
        u: fem.Function,
        evaluate: Callable[[PETSc.Vec], None],
    ) -> None:
        self._jacobian, self._bcs, self._u, self._evaluate = jacobian, bcs, u, evaluate
        self._matrix = create_matrix(jacobian)
        self._state = u.x.petsc_vec.duplicate()
        self._here = u.x.petsc_vec.duplicate()
        self._there = u.x.petsc_vec.duplicate()
        self._diagonal = u.x.petsc_vec.duplicate()
        sizes, comm = self._matrix.getSizes(), self._matrix.comm
        product = PETSc.Mat().createPython(sizes, _Product(self), comm)
        self._solver = _krylov(product, self._matrix)
        self._factorised = False

    def forget(self) -> None:
        """Let the next solve factorise the tangent at its own state."""
        self._factorised = False

    def factorise(self) -> None:
        """Factorise the tangent at the current state, without what inertia adds."""
        self.assemble(None)
        self._solver.getPC().setReusePreconditioner(False)
        self._solver.setUp()
        self._factorised = True

    def apply_factors(self, b: PETSc.Vec, x: PETSc.Vec) -> None:
        """Solve with the tangent that was factorised last, to the accuracy of its factors."""
        self._solver.getPC().apply(b, x)

    def solve(self, b: PETSc.Vec, x: PETSc.Vec, tolerance: float, added: PETSc.Vec | None) -> None:
        """Solve ``tangent x = b``, b the residual at the current state.

        Parameters
        ----------
        b, x
            Right-hand side, solution.
        tolerance
            Residual of the linear equations relative to b.
        added
            What the residual has on the tangent's diagonal beyond the form, if anything.
        """
        fresh = not self._factorised
        if fresh:
            self.assemble(added)
        self._u.x.petsc_vec.copy(self._state)
        b.copy(self._here)
        self._solver.getPC().setReusePreconditioner(not fresh)
        self._solver.setTolerances(rtol=tolerance, max_it=MAX_ITERATIONS)
        self._solver.solve(self._here, x)
        self._state.copy(self._u.x.petsc_vec)
        self._u.x.scatter_forward()
        self._factorised = self._solver.getIterationNumber() <= OLD_ITERATIONS

    def multiply(self, direction: PETSc.Vec, product: PETSc.Vec) -> None:
        """Apply the tangent at the state of the last solve to a direction."""
        size = direction.norm(PETSc.NormType.INFINITY)
        if size == 0.0:
            product.set(0.0)
            return
        step = DIFFERENCE_MM / size
        self._u.x.petsc_vec.waxpy(step, direction, self._state)
        self._u.x.scatter_forward()
        self._evaluate(self._there)  # has room for ghosts, unlike PETSc's vectors
        product.waxpy(-1.0, self._here, self._there)
        product.scale(1.0 / step)

    def assemble(self, added: PETSc.Vec | None) -> float:
        """Assemble the tangent to be factorised next; return its mean diagonal entry, N/mm."""
        matrix = self._matrix
        matrix.zeroEntries()
        assemble_matrix(matrix, self._jacobian, self._bcs)
        matrix.assemble()
        matrix.getDiagonal(self._diagonal)
        mean = float(self._diagonal.sum()) / matrix.size[0]
        self._diagonal.shift(RIGID_SHIFT * abs(mean))
        if added is not None:
            self._diagonal.axpy(1.0, added)
        matrix.setDiagonal(self._diagonal)
        return mean


class _Product:
    """The tangent as PETSc's matrix context. Through PETSc Python sees no cycle: hence weak."""

    def __init__(self, tangent: Tangent) -> None:
        self._tangent = weakref.ref(tangent)

    def mult(self, _: PETSc.Mat, direction: PETSc.Vec, product: PETSc.Vec) -> None:
        """Apply the tangent; PETSc calls it."""
        tangent = self._tangent()
        assert tangent is not None  # it owns the solver that calls
        tangent.multiply(direction, product)


def _krylov(product: PETSc.Mat, matrix: PETSc.Mat) -> PETSc.KSP:
    """Return GMRES behind MUMPS with METIS, which orders long thin meshes several times better."""
    solver = PETSc.KSP().create(matrix.comm)
    solver.setOperators(product, matrix)
    solver.setType("gmres")
    solver.setGMRESRestart(MAX_ITERATIONS)
    solver.setPCSide(PETSc.PC.Side.RIGHT)
    pc = solver.getPC()
    pc.setType("lu")
    pc.setFactorSolverType("mumps")
    prefix, name = "ramiefenics_newton_", "mat_mumps_icntl_7"
    options = PETSc.Options()
    options[prefix + name] = 5
    solver.setOptionsPrefix(prefix)
    solver.setFromOptions()
    pc.setFactorSetUpSolverType()
    options.delValue(prefix + name)
    return solver

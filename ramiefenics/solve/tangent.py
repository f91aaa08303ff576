"""Linear solver of Newton's method: GMRES with a preconditioner from an earlier state.

A factorisation costs as much as dozens of residuals, and the tangent changes little from one
iteration to the next. The tangent is therefore applied as a difference quotient of the residual
(Knoll and Keyes 2004), and the factors of an earlier tangent serve as the preconditioner until they
are too old. For large models, whose factors would not fit into memory, multigrid takes the place of
the factors (Adams 2002). As it needs more iterations, the assembled tangent then takes the place of
the difference quotient. Multigrid's coarse matrices, too, may belong to an earlier tangent.
"""

from __future__ import annotations

import logging
import weakref
from collections.abc import Callable

import numpy as np
from dolfinx import fem
from mpi4py import MPI
from petsc4py import PETSc

from ramiefenics.model.equations import Array, Equations
from ramiefenics.solve.factors import SingleFactors, single_factors

log = logging.getLogger(__name__)

PREFIX = "ramiefenics_"
"""Prefix of the solver's options among those of PETSc."""

RIGID_SHIFT = 1e-7
"""Addition to the diagonal of the factorised tangent, relative to its mean. It restrains rigid
motions that friction does not, and does not change the solution of Newton's method."""

DIFFERENCE_MM = 1e-7
"""Largest displacement component in the difference quotient: far above rounding, and far below what
changes which points are in contact."""

OLD_ITERATIONS = 10
"""Number of linear iterations in a solve above which the preconditioner is renewed for the next."""

MAX_ITERATIONS = {"direct": 40, "iterative": 150}
"""Largest number of linear iterations in a solve. Newton's line search can use the direction that
has been reached by then."""

DIRECT_UNKNOWNS = 200_000
"""Number of unknowns up to which factors are faster than multigrid and fit into memory."""


class Tangent:
    """Derivative of a residual at the current state, with its linear solver.

    Parameters
    ----------
    equations
        Equations whose derivative it is.
    evaluate
        Evaluates the residual into a vector: that of the equations, possibly with further terms.
    linear_solver
        As in `Stepping`.

    Attributes
    ----------
    matrix
        Matrix that the equations had at construction.
    iterations
        Linear iterations so far.
    factorised
        Whether there are factors, or multigrid's matrices, for the next solve to use.
    factorised_at
        Displacement at which they were made, ghosts included, shape (n,). Every factorisation has
        an array of its own.
    """

    def __init__(
        self,
        equations: Equations,
        evaluate: Callable[[PETSc.Vec], None],
        linear_solver: str,
    ) -> None:
        self._equations, self._evaluate = equations, evaluate
        self._u = u = equations.displacement
        self.matrix = equations.matrix
        self._matrix = self.matrix.petsc
        self._state = u.x.petsc_vec.duplicate()
        self._here = u.x.petsc_vec.duplicate()
        self._there = u.x.petsc_vec.duplicate()
        self._diagonal = u.x.petsc_vec.duplicate()
        if linear_solver == "auto":
            linear_solver = "direct" if self._matrix.size[0] <= DIRECT_UNKNOWNS else "iterative"
        self._max_iterations = MAX_ITERATIONS[linear_solver]
        self._iterative = linear_solver == "iterative"
        self._solver = _krylov(self._matrix.comm, self._iterative, self._max_iterations)
        self._single: SingleFactors | None = None
        if self._iterative:
            self._matrix.setNearNullSpace(_rigid_motions(u))
            self._solver.setOperators(self._matrix)
            self._solver.getPC().setType("gamg")
            self._solver.setFromOptions()
        else:
            sizes = self._matrix.getSizes()
            product = PETSc.Mat().createPython(sizes, _Product(self), self._matrix.comm)
            self._solver.setOperators(product, self._matrix)
            self._single = _factorise(self._solver, equations)
        self.factorised, self.factorised_at = False, np.zeros(0)
        self.iterations = 0

    def begin(self) -> None:
        """Set up all that lasts for the whole run, as a first solve from the current state would.

        What lasts is multigrid's coarse spaces; factors do not.
        """
        if self._iterative:
            self.factorise()

    def forget(self) -> None:
        """Make the next solve factorise the tangent at its own state."""
        self.factorised = False

    def factorise(self) -> None:
        """Factorise the tangent at the current state, without inertia."""
        self.assemble(None)
        self._solver.getPC().setReusePreconditioner(False)
        self._solver.setUp()
        self._solver.getPC().setUp()  # the solver postpones this if it was set up before
        self.factorised, self.factorised_at = True, self._u.x.array.copy()

    def apply_factors(self, right: Array) -> Array:
        """Solve with the tangent that was factorised last, to the accuracy of its factors.

        Parameters
        ----------
        right
            This rank's part of the right-hand sides, shape (k, n).
        """
        if self._single is not None:
            return self._single.solve(right)
        solutions = np.empty_like(right)
        for given, solution in zip(right, solutions, strict=True):
            self._here.array = given
            self._solver.getPC().apply(self._here, self._there)
            solution[:] = self._there.array_r
        return solutions

    def solve(self, b: PETSc.Vec, x: PETSc.Vec, tolerance: float, added: PETSc.Vec | None) -> None:
        """Solve ``dR/du x = b``, where b is the residual R at the current state.

        Parameters
        ----------
        b, x
            Right-hand side and solution.
        tolerance
            Tolerance on the residual of the linear equations, relative to b.
        added
            Addition to the tangent's diagonal by terms that the equations do not have, if any.
        """
        fresh = not self.factorised
        if fresh:
            self.factorised_at = self._u.x.array.copy()
        if fresh or self._iterative:
            self.assemble(added)
        self._u.x.petsc_vec.copy(self._state)
        b.copy(self._here)
        self._solver.getPC().setReusePreconditioner(not fresh)
        self._solver.setTolerances(rtol=tolerance, max_it=self._max_iterations)
        self._solver.solve(self._here, x)
        self._state.copy(self._u.x.petsc_vec)
        self._u.x.scatter_forward()
        iterations = self._solver.getIterationNumber()
        self.iterations += iterations
        how = "fresh" if fresh else "reused"
        log.debug("    %d linear iterations with a %s preconditioner", iterations, how)
        self.factorised = iterations <= OLD_ITERATIONS

    def multiply(self, direction: PETSc.Vec, product: PETSc.Vec) -> None:
        """Apply the tangent at the state of the last solve to a direction."""
        size = direction.norm(PETSc.NormType.INFINITY)
        if size == 0.0:
            product.set(0.0)
            return
        step = DIFFERENCE_MM / size
        self._u.x.petsc_vec.waxpy(step, direction, self._state)
        self._u.x.scatter_forward()
        self._evaluate(self._there)  # unlike `product`, this vector has room for ghosts
        product.waxpy(-1.0, self._here, self._there)
        product.scale(1.0 / step)

    def assemble(self, added: PETSc.Vec | None) -> float:
        """Assemble the tangent to be factorised next; return its mean diagonal entry, N/mm."""
        self._equations.assemble()
        matrix = self._matrix
        matrix.getDiagonal(self._diagonal)
        mean = float(self._diagonal.sum()) / matrix.size[0]
        self._diagonal.shift(RIGID_SHIFT * abs(mean))
        if added is not None:
            self._diagonal.axpy(1.0, added)
        matrix.setDiagonal(self._diagonal)
        return mean


class _Product:
    """Context of a PETSc matrix that applies the tangent.

    Its reference is weak, as Python cannot see a cycle that passes through PETSc.
    """

    def __init__(self, tangent: Tangent) -> None:
        self._tangent = weakref.ref(tangent)

    def mult(self, _: PETSc.Mat, direction: PETSc.Vec, product: PETSc.Vec) -> None:
        """Apply the tangent; called by PETSc."""
        tangent = self._tangent()
        assert tangent is not None  # it owns the solver that calls
        tangent.multiply(direction, product)


def _krylov(comm: MPI.Comm, spare_memory: bool, restart: int) -> PETSc.KSP:
    """Return GMRES, preconditioned from the right so that its residual is that of the equations.

    The flexible variant keeps the preconditioned vectors, which saves one solve with the factors.
    """
    solver = PETSc.KSP().create(comm)
    solver.setOptionsPrefix(PREFIX)
    solver.setType("gmres" if spare_memory else "fgmres")
    solver.setGMRESRestart(restart)
    solver.setPCSide(PETSc.PC.Side.RIGHT)
    return solver


def _factorise(solver: PETSc.KSP, equations: Equations) -> SingleFactors | None:
    """Set up MUMPS as the preconditioner; return the factors if they are in single precision.

    METIS orders long thin meshes several times better than other methods. A build of MUMPS without
    METIS, such as Debian's, chooses another ordering by itself.
    """
    pc = solver.getPC()
    own = PETSc.Options(PREFIX).getAll()  # user's options for PETSc's factors go first
    chosen = any(name.startswith(("pc_", "mat_mumps_")) for name in own)
    single = None if chosen else single_factors(equations.matrix, equations.symmetric)
    if single is not None:
        pc.setType("python")
        pc.setPythonContext(single)
        solver.setFromOptions()
        return single
    pc.setType("lu")
    pc.setFactorSolverType("mumps")
    solver.setFromOptions()
    pc.setFactorSetUpSolverType()
    pc.getFactorMatrix().setMumpsIcntl(7, 5)  # before PETSc reads the user's options of MUMPS
    return None


def _rigid_motions(u: fem.Function) -> PETSc.NullSpace:
    """Return the six rigid motions, from which multigrid builds its coarse spaces."""
    axes = np.eye(3)
    motions = [lambda x, e=e: np.outer(e, np.ones(x.shape[1])) for e in axes]
    motions += [lambda x, e=e: np.cross(e, x.T).T for e in axes]
    vectors = []
    for motion in motions:
        field = fem.Function(u.function_space)
        field.interpolate(motion)
        vectors.append(field.x.petsc_vec.copy())
    for k, vector in enumerate(vectors):
        for other in vectors[:k]:
            vector.axpy(-vector.dot(other), other)
        vector.normalize()
    return PETSc.NullSpace().create(vectors=vectors, comm=u.function_space.mesh.comm)

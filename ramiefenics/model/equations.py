"""Equilibrium as a sum of terms, each with its forces and their derivative, the stiffness."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import Protocol

import numpy as np
import ufl
from dolfinx import fem
from dolfinx.fem.petsc import assemble_matrix, set_bc
from numpy.typing import NDArray
from petsc4py import PETSc

from ramiefenics.model.jit import compile_form
from ramiefenics.model.laws.base import Expr
from ramiefenics.model.matrix import NONE, Matrix

Array = NDArray[np.float64]
Conditions = Sequence[fem.DirichletBC]


class Term(Protocol):
    """A contribution to the equations."""

    def add_forces(self, forces: Array) -> None:
        """Add the forces on the degrees of freedom that this rank knows, N, shape (n,)."""

    def add_stiffness(self, matrix: Matrix, bcs: Conditions) -> None:
        """Add the derivative of the forces, N/mm, without constrained rows and columns."""


class FormTerm:
    """A term that is evaluated by code of the form compiler.

    Parameters
    ----------
    form
        UFL form, linear in a test function.
    displacement
        The unknown.
    """

    def __init__(self, form: Expr, displacement: fem.Function) -> None:
        self._form, self._displacement = form, displacement

    @cached_property
    def _residual(self) -> fem.Form:
        return compile_form(self._form)

    @cached_property
    def _jacobian(self) -> fem.Form:
        du = ufl.TrialFunction(self._displacement.function_space)
        return compile_form(ufl.derivative(self._form, self._displacement, du))

    def add_forces(self, forces: Array) -> None:  # noqa: D102
        fem.assemble_vector(forces, self._residual)

    def add_stiffness(self, matrix: Matrix, bcs: Conditions) -> None:  # noqa: D102
        assemble_matrix(matrix.petsc, self._jacobian, list(bcs))


class Equations:
    """The residual at a displacement, N, and its derivative, N/mm.

    Parameters
    ----------
    displacement
        The unknown.
    terms
        Terms to sum up.
    bcs
        Dirichlet conditions.
    symmetric
        Whether the derivative is symmetric, or nearly so.

    Attributes
    ----------
    displacement, bcs, symmetric
        As given.
    """

    def __init__(
        self,
        displacement: fem.Function,
        terms: Sequence[Term],
        bcs: list[fem.DirichletBC],
        symmetric: bool = False,
    ) -> None:
        self.symmetric = symmetric
        self._couplings: NDArray[np.int64] = NONE
        self.displacement, self.bcs, self._terms = displacement, bcs, terms

    def residual(self, b: PETSc.Vec) -> None:
        """Evaluate the residual at the displacement, which must satisfy `bcs`; collective."""
        with b.localForm() as local:
            local.set(0.0)
            for term in self._terms:
                term.add_forces(local.array_w)
        b.ghostUpdate(PETSc.InsertMode.ADD, PETSc.ScatterMode.REVERSE)
        set_bc(b, self.bcs, self.displacement.x.petsc_vec, -1.0)

    @cached_property
    def matrix(self) -> Matrix:
        """The derivative as last assembled; `couple` replaces the matrix by a new one."""
        space = self.displacement.function_space
        u, v = ufl.TrialFunction(space), ufl.TestFunction(space)
        return Matrix(compile_form(ufl.inner(u, v) * ufl.dx), self._couplings)

    def couple(self, couplings: NDArray[np.int64]) -> None:
        """Allow entries of the derivative between nodes that share no cell, see `Matrix`."""
        self._couplings = couplings
        self.__dict__.pop("matrix", None)

    def assemble(self) -> None:
        """Assemble the derivative, with 1 on the diagonal of constrained rows; collective."""
        matrix = self.matrix.petsc
        matrix.zeroEntries()
        for term in self._terms:
            term.add_stiffness(self.matrix, self.bcs)
            matrix.assemble(PETSc.Mat.AssemblyType.FLUSH)
        matrix.assemble()
        diagonal = matrix.getDiagonal()
        for bc in self.bcs:
            held, owned = bc.dof_indices()
            diagonal.array[held[:owned]] = 1.0
        matrix.setDiagonal(diagonal)

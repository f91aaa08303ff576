"""Rectangular blocks of hexahedra, and boundary value problems on them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import basix.ufl
import numpy as np
import ufl
from dolfinx import fem
from dolfinx import mesh as dmesh
from mpi4py import MPI
from numpy.typing import NDArray

from ramiefenics.model.equations import Equations, FormTerm, Term
from ramiefenics.model.jit import compile_form
from ramiefenics.model.laws.base import Expr
from ramiefenics.model.solid import Solid
from ramiefenics.solve.newton import Newton
from ramiefenics.verification.study import Array

Field = Callable[[Array], Array]
"""Function from points, shape (3, n), to vectors of the same shape."""


def block(x: Array, y: Array, z: Array) -> dmesh.Mesh:
    """Return a mesh of first-order hexahedra on this rank, with given coordinates, mm."""
    axes = (x, y, z)
    counts = [len(axis) - 1 for axis in axes]
    corners = [np.zeros(3), np.array(counts, dtype=float)]
    mesh = dmesh.create_box(MPI.COMM_SELF, corners, counts, dmesh.CellType.hexahedron)
    points = mesh.geometry.x
    for k, axis in enumerate(axes):
        points[:, k] = np.interp(points[:, k], np.arange(len(axis)), axis)
    return mesh


def second_order(mesh: dmesh.Mesh) -> dmesh.Mesh:
    """Return a mesh with the same cells but of second order, with 27 nodes each."""
    space = fem.functionspace(mesh, ("Lagrange", 2))
    points = space.tabulate_dof_coordinates()
    element = basix.ufl.element("Lagrange", "hexahedron", 2, shape=(3,))
    return dmesh.create_mesh(MPI.COMM_SELF, cells=space.dofmap.list, x=points, e=element)


def layers(mesh: dmesh.Mesh, interfaces_mm: Sequence[float] = ()) -> dmesh.MeshTags:
    """Tag cells by layer along Y, with 1 below the first interface."""
    cells = np.arange(mesh.topology.index_map(3).size_local, dtype=np.int32)
    middle = dmesh.compute_midpoints(mesh, 3, cells)[:, 1]
    tags = 1 + np.searchsorted(np.asarray(interfaces_mm), middle)
    return dmesh.meshtags(mesh, 3, cells, tags.astype(np.int32))


def on_planes(mesh: dmesh.Mesh, axis: int, *at_mm: float) -> NDArray[np.int32]:
    """Return the boundary facets that lie in any of several planes normal to an axis."""
    return dmesh.locate_entities_boundary(
        mesh, 2, lambda x: np.isclose(x[axis], np.array(at_mm)[:, None], atol=1e-6).any(axis=0)
    )


def all_around(mesh: dmesh.Mesh) -> NDArray[np.int32]:
    """Return all boundary facets."""
    return dmesh.locate_entities_boundary(mesh, 2, lambda x: np.full(x.shape[1], True))


def hold(solid: Solid, at: NDArray[np.int32], axis: int) -> fem.DirichletBC:
    """Return a condition that holds a displacement component on facets at zero.

    The function `g` of the condition can be given other values.
    """
    space = solid.space.sub(axis)
    scalar, _ = space.collapse()
    dofs = fem.locate_dofs_topological((space, scalar), 2, at)
    return fem.dirichletbc(fem.Function(scalar), dofs, space)


def prescribe(solid: Solid, at: NDArray[np.int32], value: Field) -> fem.DirichletBC:
    """Return a condition that prescribes the displacement on facets, mm."""
    prescribed = fem.Function(solid.space)
    prescribed.interpolate(value)
    return fem.dirichletbc(prescribed, fem.locate_dofs_topological(solid.space, 2, at))


class BoundaryValueProblem:
    """A solid with Dirichlet conditions and any other terms.

    Parameters
    ----------
    solid
        Solid.
    bcs
        Dirichlet conditions.
    more
        Function from the test function to further terms of the weak form.
    terms
        Further terms of the equations.
    """

    def __init__(
        self,
        solid: Solid,
        bcs: list[fem.DirichletBC],
        more: Callable[[Expr], Expr] | None = None,
        terms: Sequence[Term] = (),
    ) -> None:
        self.solid, self.bcs = solid, bcs
        u = solid.displacement
        self._internal = solid.term()
        stated = [] if more is None else [FormTerm(more(ufl.TestFunction(solid.space)), u)]
        self._newton = Newton(Equations(u, [self._internal, *stated, *terms], bcs), 30)

    def solve(self, tolerance_N: float, largest_update_mm: float = np.inf) -> None:
        """Solve from the current displacement, in which prescribed values are first set.

        Raises
        ------
        RuntimeError
            If Newton's method does not converge.
        """
        u = self.solid.displacement
        for bc in self.bcs:
            bc.set(u.x.array)
        outcome = self._newton.solve(tolerance_N, largest_update_mm)
        if not outcome.converged:
            raise RuntimeError(f"the verification problem has no solution: {outcome.reason}")

    def reactions(self) -> Array:
        """Return the internal forces at all degrees of freedom, N, shape (nodes, 3)."""
        forces = np.zeros(len(self.solid.displacement.x.array))
        self._internal.add_forces(forces)
        return forces.reshape(-1, 3)


def norm(form: Any) -> float:
    """Return the square root of a functional."""
    return float(fem.assemble_scalar(compile_form(form))) ** 0.5

"""Internal variables at the quadrature points of the cells, kept from step to step."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import basix
import basix.ufl
import numpy as np
import ufl
from dolfinx import fem
from dolfinx import mesh as dmesh
from numpy.typing import NDArray

from ramiefenics.model.jit import compile_expression
from ramiefenics.model.laws.base import Expr


def point_element(mesh: dmesh.Mesh, order: int, **options: Any) -> Any:
    """Return a discontinuous element whose nodes are the Gauss points of the volume's quadrature.

    Parameters
    ----------
    mesh
        Hexahedra.
    order
        Order of the solid's elements; the quadrature has one more point along an edge.
    options
        Further options of `basix.ufl.element`.
    """
    variant = basix.LagrangeVariant.gl_warped
    cell = mesh.basix_cell()
    return basix.ufl.element(
        "Lagrange", cell, order, lagrange_variant=variant, discontinuous=True, **options
    )


class MaterialMemory:
    """Internal variables at every quadrature point of the cells.

    They are stored in a function of a discontinuous space whose nodes are the Gauss points of the
    volume's quadrature. They are exact at these points, and interpolated between them and on the
    surface, where contact evaluates the stress.

    Parameters
    ----------
    mesh
        Hexahedra.
    order
        Order of the elements; the quadrature has one more point along an edge.
    start
        Initial values by name, each a number or nested tuples of numbers.
    cells
        Local cells that have internal variables; all by default.

    Attributes
    ----------
    last
        Stored variables by name, in UFL.
    size
        Total number of their components.
    points
        Coordinates of the points in the reference cell, shape (n, 3).
    """

    def __init__(
        self,
        mesh: dmesh.Mesh,
        order: int,
        start: Mapping[str, Any],
        cells: NDArray[np.int32] | None = None,
    ) -> None:
        values = {name: np.asarray(value, dtype=np.float64) for name, value in start.items()}
        self.size = sum(value.size for value in values.values())
        nodes = point_element(mesh, order)
        space = fem.functionspace(mesh, point_element(mesh, order, shape=(self.size,)))
        self._function = fem.Function(space, name="memory")
        self.numbers[:] = np.concatenate([value.ravel() for value in values.values()])
        self._nodes = nodes.basix_element
        self.points = self._nodes.points
        index_map = mesh.topology.index_map(mesh.topology.dim)
        known = np.arange(index_map.size_local + index_map.num_ghosts, dtype=np.int32)
        self._cells = known if cells is None else cells
        self.last: dict[str, Expr] = {}
        first = 0
        for name, value in values.items():
            self.last[name] = self._variable(first, value.shape)
            first += value.size

    @property
    def places(self) -> np.ndarray:
        """Index in `numbers` of each point of each cell, shape (cells, points)."""
        return np.asarray(self._function.function_space.dofmap.list)

    @property
    def numbers(self) -> np.ndarray:
        """Stored values by place and component, a view that may be written to."""
        return np.asarray(self._function.x.array.reshape(-1, self.size))

    def _variable(self, first: int, shape: tuple[int, ...]) -> Expr:
        if not shape:
            return self._function[first]
        stride = math.prod(shape[1:])
        return ufl.as_tensor(
            [self._variable(first + i * stride, shape[1:]) for i in range(shape[0])]
        )

    def compile(self, variables: Mapping[str, Expr]) -> fem.Expression:
        """Compile expressions for new values of all variables, for `evaluate`."""
        numbers = [
            variables[name][index] if index else variables[name]
            for name, last in self.last.items()
            for index in np.ndindex(last.ufl_shape)
        ]
        return compile_expression(ufl.as_vector(numbers), self.points)

    def evaluate(self, variables: fem.Expression) -> NDArray[np.float64]:
        """Return new values from an expression of `compile`, in the layout of `numbers`."""
        values = variables.eval(self._function.function_space.mesh, self._cells)
        now = self.numbers.copy()
        now[self.places[self._cells].ravel()] = values.reshape(-1, self.size)
        return np.asarray(now)

    def remember(self, now: NDArray[np.float64]) -> None:
        """Store new values, in the layout of `numbers`."""
        self.numbers[:] = now

    def take_over(self, before: MaterialMemory, turn: NDArray[np.float64]) -> None:
        """Take over the values that another memory has for the same points, rotated.

        Parameters
        ----------
        before
            Memory to take the values from.
        turn
            Rotation of the undeformed stalk about Z, shape (3, 3). Each index of a variable of
            shape (2,), (3,), (2, 2) or (3, 3) refers to an axis of the undeformed stalk.
        """
        first = 0
        for last in self.last.values():
            shape = last.ufl_shape
            part = slice(first, first + math.prod(shape))
            values = before.numbers[:, part].reshape(-1, *shape)
            for axis, size in enumerate(shape, start=1):
                turned = np.tensordot(values, turn[:size, :size], axes=(axis, 1))
                values = np.moveaxis(turned, -1, axis)
            self.numbers[:, part] = values.reshape(len(values), -1)
            first = part.stop

    def interpolate(
        self, now: NDArray[np.float64], points: NDArray[np.float64], cells: NDArray[np.int32]
    ) -> dict[str, NDArray[np.float64]]:
        """Interpolate new values, which need not be stored, between the quadrature points.

        Parameters
        ----------
        now
            Values at the quadrature points, in the layout of `numbers`.
        points
            Points in reference coordinates, shape (n, 3).
        cells
            Local cells.

        Returns
        -------
        dict
            Values by name, shape (cells, n, ...), which ends in the variable's own shape.
        """
        values = now[self.places[cells]]
        shares = self._nodes.tabulate(0, points)[0, :, :, 0]
        between, first = np.einsum("pn,cns->cps", shares, values), 0
        found = {}
        for name, last in self.last.items():
            size = math.prod(last.ufl_shape)
            part = between[:, :, first : first + size]
            found[name] = part.reshape(len(cells), len(points), *last.ufl_shape)
            first += size
        return found

"""What the quadrature points of the cells remember from step to step."""

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


class MaterialMemory:
    """Internal variables at every quadrature point of the cells.

    They are held by a discontinuous space whose nodes are the Gauss points of the volume's
    quadrature. There they are exact; between them, and on the surface, where contact asks for the
    stress, they are interpolated.

    Parameters
    ----------
    mesh
        Hexahedra.
    order
        Of the elements: the quadrature has one point more along an edge.
    start
        First values by name, each a number or nested tuples of numbers.

    Attributes
    ----------
    last
        The variables by name, in UFL.
    """

    def __init__(self, mesh: dmesh.Mesh, order: int, start: Mapping[str, Any]) -> None:
        values = {name: np.asarray(value, dtype=np.float64) for name, value in start.items()}
        self._size = sum(value.size for value in values.values())
        options = {"lagrange_variant": basix.LagrangeVariant.gl_warped, "discontinuous": True}
        cell = mesh.basix_cell()
        nodes = basix.ufl.element("Lagrange", cell, order, **options)
        element = basix.ufl.element("Lagrange", cell, order, shape=(self._size,), **options)
        self._function = fem.Function(fem.functionspace(mesh, element), name="memory")
        self._numbers[:] = np.concatenate([value.ravel() for value in values.values()])
        self._nodes = nodes.basix_element
        index_map = mesh.topology.index_map(mesh.topology.dim)
        self._cells = np.arange(index_map.size_local + index_map.num_ghosts, dtype=np.int32)
        self.last: dict[str, Expr] = {}
        first = 0
        for name, value in values.items():
            self.last[name] = self._variable(first, value.shape)
            first += value.size

    @property
    def _numbers(self) -> np.ndarray:
        return np.asarray(self._function.x.array.reshape(-1, self._size))

    def _variable(self, first: int, shape: tuple[int, ...]) -> Expr:
        if not shape:
            return self._function[first]
        stride = math.prod(shape[1:])
        return ufl.as_tensor(
            [self._variable(first + i * stride, shape[1:]) for i in range(shape[0])]
        )

    def compile(self, variables: Mapping[str, Expr]) -> fem.Expression:
        """Prepare new values of all variables for `remember`."""
        numbers = [
            variables[name][index] if index else variables[name]
            for name, last in self.last.items()
            for index in np.ndindex(last.ufl_shape)
        ]
        return compile_expression(ufl.as_vector(numbers), self._nodes.points)

    def remember(self, variables: fem.Expression) -> None:
        """Let every point remember new values, which may depend on the old ones."""
        mesh = self._function.function_space.mesh
        values = variables.eval(mesh, self._cells).reshape(-1, self._size)
        self._numbers[self._function.function_space.dofmap.list[self._cells].ravel()] = values

    def interpolate(
        self, variables: fem.Expression, points: NDArray[np.float64], cells: NDArray[np.int32]
    ) -> dict[str, NDArray[np.float64]]:
        """Return new values, not remembered yet, between the quadrature points.

        Parameters
        ----------
        variables
            From `compile`.
        points
            In reference coordinates, shape (n, 3).
        cells
            Local cells.

        Returns
        -------
        dict
            By name, shape (cells, n, ...) with the variable's own shape in the end.
        """
        mesh = self._function.function_space.mesh
        values = variables.eval(mesh, cells).reshape(len(cells), -1, self._size)
        shares = self._nodes.tabulate(0, points)[0, :, :, 0]
        between, first = np.einsum("pn,cns->cps", shares, values), 0
        found = {}
        for name, last in self.last.items():
            size = math.prod(last.ufl_shape)
            part = between[:, :, first : first + size]
            found[name] = part.reshape(len(cells), len(points), *last.ufl_shape)
            first += size
        return found

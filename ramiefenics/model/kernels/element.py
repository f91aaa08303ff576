"""Forces, stiffness and energy of a solid's hexahedra, by compiled C code."""

from __future__ import annotations

import functools
from collections.abc import Mapping
from typing import Any

import basix
import numpy as np
from dolfinx import fem

from ramiefenics.model.kernels.assembled import (
    WIDTH,
    Array,
    AssembledKernel,
    Integers,
    cell_maps,
    padded,
    program,
)
from ramiefenics.model.kernels.material import material_source
from ramiefenics.model.laws.base import Law
from ramiefenics.model.material_memory import MaterialMemory

DECLARATIONS = """
struct cells {
  int64_t count;                /* of cells */
  const int32_t *nodes;         /* by cell and node */
  const double *by_point;       /* slopes of the shape functions by direction, node and point */
  const double *by_node;        /* the same by direction, point and node */
  const double *inverse;        /* of the map from the reference cell: by cell, entry and point */
  const double *weight;         /* of the points: volume, by cell and point */
  const double *parameters;     /* by cell */
  const double *memory;         /* by place: what is remembered */
  const int32_t *places;        /* by cell and point */
};
"""

FUNCTIONS = """
void sum_energies(const struct cells *, const double *, double, double *);
void update(const struct cells *, const double *, double, double *);
void list_gradients(const struct cells *, const double *, double *);
void list_tangents(const struct cells *, const double *, double, double *);
"""


class ElementKernel(AssembledKernel):
    """Integrals over a solid's cells, at its current displacement.

    Parameters
    ----------
    law
        Material law.
    parameters
        Parameters of the law by name, constant in every cell.
    local
        Parameters that vary from point to point, by name.
    memory
        Internal variables at the quadrature points; None for an elastic law.
    displacement
        The unknown.
    duration
        Duration of the step, s.
    quadrature_degree
        Degree of the quadrature in the cells.
    cells
        Local cells of the solid, those that this rank owns first.

    Attributes
    ----------
    points
        Number of quadrature points in a cell.

    Raises
    ------
    UnknownOperation
        If the law uses an operation that has no counterpart in C.
    """

    def __init__(
        self,
        law: Law,
        parameters: Mapping[str, fem.Function],
        local: Mapping[str, fem.Function],
        memory: MaterialMemory | None,
        displacement: fem.Function,
        duration: fem.Constant,
        quadrature_degree: int,
        cells: Integers,
    ) -> None:
        space, mesh = displacement.function_space, displacement.function_space.mesh
        self._memory, self._of_solid = memory, cells
        points, weights = basix.make_quadrature(basix.CellType.hexahedron, quadrature_degree)
        if memory is not None:  # its points are the same, but in another order
            order = [int(np.abs(points - point).sum(axis=1).argmin()) for point in memory.points]
            points, weights = points[order], weights[order]
        self.points, nodes = len(points), space.dofmap.list.shape[1]
        padded_points, padded_nodes = padded(self.points), padded(nodes)
        sizes = {
            "POINTS": self.points,
            "NODES": nodes,
            "PADDED_POINTS": padded_points,
            "PADDED_NODES": padded_nodes,
            "PARAMETERS": len(parameters) + len(local) * padded_points,
            "REMEMBERED": 0 if memory is None else memory.size,
            "SYMMETRIC": int(law.memory is None),
            "WIDTH": WIDTH,
        }
        source = _source(law, tuple(parameters), tuple(local), tuple(sizes.items()))
        here = mesh.topology.index_map(mesh.topology.dim).size_local
        owned = int((cells < here).sum())
        of_cells = space.dofmap.list[cells]
        super().__init__(source, DECLARATIONS + FUNCTIONS, of_cells, owned, displacement, duration)
        slopes = space.element.basix_element.tabulate(1, points)[
            1:, :, :, 0
        ]  # direction, point, node
        by_node = np.zeros((3, self.points, padded_nodes))
        by_node[:, :, :nodes] = slopes
        by_point = np.zeros((3, nodes, padded_points))
        by_point[:, :, : self.points] = slopes.transpose(0, 2, 1)
        inverse, weight = self._map(points, weights, padded_points)
        cellwise = [p.x.array[cells, None] for p in parameters.values()]
        pointwise = [self._at_points(p, points, padded_points) for p in local.values()]
        numbers_of_law = np.concatenate([*cellwise, *pointwise], axis=1)
        places: Integers = np.zeros((1, 1), dtype=np.int32)
        numbers = np.zeros(1)
        if memory is not None:
            places, numbers = memory.places[cells], memory.numbers
        self._arrays = [  # in the order of the structure; kept alive by this object
            np.ascontiguousarray(array)
            for array in (self.nodes, by_point, by_node, inverse, weight, numbers_of_law)
        ] + [numbers, np.ascontiguousarray(places)]
        self._cells = self._of_cells(self.owned)

    def _map(self, points: Array, weights: Array, width: int) -> tuple[Array, Array]:
        """Return the cells' inverse Jacobians, by entry and point, and the points' volumes."""
        _, jacobian = cell_maps(self._u.function_space.mesh, self._of_solid, points)
        inverse = np.zeros((len(jacobian), 3, 3, width))
        inverse[..., : len(points)] = np.linalg.inv(jacobian).transpose(0, 2, 3, 1)
        weight = np.zeros((len(jacobian), width))
        weight[:, : len(points)] = weights * np.abs(np.linalg.det(jacobian))
        return inverse, weight

    def _at_points(self, values: fem.Function, points: Array, width: int) -> Array:
        """Return a function at the points of every cell, padded with the value at the last one."""
        space = values.function_space
        shares = space.element.basix_element.tabulate(0, points)[0, :, :, 0]
        found = values.x.array[space.dofmap.list[self._of_solid]] @ shares.T
        return np.pad(found, ((0, 0), (0, width - len(points))), mode="edge")

    def _of_cells(self, count: int) -> Any:
        return self._ffi.new("struct cells *", [count, *map(self._pointer, self._arrays)])

    def energies(self) -> tuple[float, float]:
        """Return the energies that this rank's cells store, and have dissipated so far, N mm."""
        sums = np.zeros(2)
        self._lib.sum_energies(self._cells, *self._step, self._pointer(sums))
        return float(sums[0]), float(sums[1])

    def updated(self) -> Array:
        """Return the current internal variables, in the layout of `MaterialMemory.numbers`."""
        assert self._memory is not None
        now = self._memory.numbers.copy()
        self._lib.update(self._of_cells(len(self.nodes)), *self._step, self._pointer(now))
        return np.asarray(now)

    def gradients(self) -> Array:
        """Return the deformation gradients, shape (owned cells, points, 3, 3)."""
        found = np.empty((self.owned, self.points, 3, 3))
        self._lib.list_gradients(self._cells, self._step[0], self._pointer(found))
        return found

    def tangents(self) -> Array:
        """Return the tangents dP/dF, MPa, shape (owned cells, points, 3, 3, 3, 3)."""
        found = np.empty((self.owned, self.points, 3, 3, 3, 3))
        self._lib.list_tangents(self._cells, *self._step, self._pointer(found))
        return found


@functools.cache
def _source(
    law: Law,
    parameters: tuple[str, ...],
    local: tuple[str, ...],
    sizes: tuple[tuple[str, int], ...],
) -> str:
    parts = (DECLARATIONS, material_source(law, parameters, local))
    return program(dict(sizes), parts, "element.c")

"""Forces, stiffness and energy of a solid's hexahedra by compiled C."""

from __future__ import annotations

import functools
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import basix
import basix.ufl
import numpy as np
from dolfinx import fem
from numpy.typing import NDArray

from ramiefenics.model.compat import geometry_nodes
from ramiefenics.model.kernels.library import compiled
from ramiefenics.model.kernels.material import material_source
from ramiefenics.model.laws.base import Law
from ramiefenics.model.material_memory import MaterialMemory

WIDTH = 4
"""Numbers that loops over nodes and points handle at once."""

Array = NDArray[np.float64]
Integers = NDArray[np.int32]

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
void add_forces(const struct cells *, const double *, double, double *);
void add_stiffness(const struct cells *, const double *, double, const uint8_t *, const int32_t *,
                   const int32_t *, double *);
void list_stiffness(const struct cells *, const double *, double, const uint8_t *, int64_t, int64_t,
                    double *);
void find_offsets(const struct cells *, const int32_t *, const int32_t *, int32_t *);
void sum_energies(const struct cells *, const double *, double, double *);
void update(const struct cells *, const double *, double, double *);
void list_gradients(const struct cells *, const double *, double *);
void list_tangents(const struct cells *, const double *, double, double *);
"""


class ElementKernel:
    """Integrals over a solid's cells, at its current displacement.

    Parameters
    ----------
    law
        The material.
    parameters
        Its parameters by name, constant in every cell.
    local
        Those that differ from point to point.
    memory
        What the quadrature points remember.
    displacement
        The unknown.
    duration
        Of the step, s.
    quadrature_degree
        Of the quadrature in the cells.
    cells
        Local cells of the solid, those that this rank owns first.

    Attributes
    ----------
    nodes
        Of these cells, shape (cells, nodes).
    owned
        Number of those that are integrated over.
    components
        Number of the displacement's components that this rank knows.

    Raises
    ------
    UnknownOperation
        If the law uses something that has no counterpart in C.
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
        self._u, self._duration, self._memory = displacement, duration, memory
        here = mesh.topology.index_map(mesh.topology.dim).size_local
        self.owned, self._of_solid = int((cells < here).sum()), cells
        points, weights = basix.make_quadrature(basix.CellType.hexahedron, quadrature_degree)
        if memory is not None:  # its points are the same, but in another order
            order = [int(np.abs(points - point).sum(axis=1).argmin()) for point in memory.points]
            points, weights = points[order], weights[order]
        self.nodes = np.ascontiguousarray(space.dofmap.list[cells])
        self.components = len(displacement.x.array)
        self.points, nodes = len(points), self.nodes.shape[1]
        padded_points, padded_nodes = (-(-n // WIDTH) * WIDTH for n in (self.points, nodes))
        remembered = 0 if memory is None else memory.size
        sizes = {
            "POINTS": self.points,
            "NODES": nodes,
            "PADDED_POINTS": padded_points,
            "PADDED_NODES": padded_nodes,
            "PARAMETERS": len(parameters) + len(local) * padded_points,
            "REMEMBERED": remembered,
            "SYMMETRIC": int(law.memory is None),
            "WIDTH": WIDTH,
        }
        module = compiled(
            _source(law, tuple(parameters), tuple(local), tuple(sizes.items())), _declared()
        )
        self._ffi, self._lib = module.ffi, module.lib
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
        self._arrays = [  # in the order of the structure; they live as long as this does
            np.ascontiguousarray(array)
            for array in (self.nodes, by_point, by_node, inverse, weight, numbers_of_law)
        ] + [numbers, np.ascontiguousarray(places)]
        self._cells = self._of_cells(self.owned)

    def _map(self, points: Array, weights: Array, padded: int) -> tuple[Array, Array]:
        """Return the inverse of the cells' map, by entry and point, and the points' volumes."""
        mesh = self._u.function_space.mesh
        element = mesh.ufl_domain().ufl_coordinate_element()
        element = element.sub_elements[0] if element.block_size > 1 else element
        slopes = element.tabulate(1, points)[1:]
        at = mesh.geometry.x[geometry_nodes(mesh)[self._of_solid]]
        jacobian = np.einsum("cni,kqn->cqik", at, slopes.reshape(3, len(points), -1), optimize=True)
        inverse = np.zeros((len(at), 3, 3, padded))
        inverse[..., : len(points)] = np.linalg.inv(jacobian).transpose(0, 2, 3, 1)
        weight = np.zeros((len(at), padded))
        weight[:, : len(points)] = weights * np.abs(np.linalg.det(jacobian))
        return inverse, weight

    def _at_points(self, values: fem.Function, points: Array, padded: int) -> Array:
        """Return a function at the points of every cell, those behind the last one repeated."""
        space = values.function_space
        shares = space.element.basix_element.tabulate(0, points)[0, :, :, 0]
        found = values.x.array[space.dofmap.list[self._of_solid]] @ shares.T
        return np.pad(found, ((0, 0), (0, padded - len(points))), mode="edge")

    def _of_cells(self, count: int) -> Any:
        return self._ffi.new("struct cells *", [count, *map(self._pointer, self._arrays)])

    def _pointer(self, array: NDArray[Any]) -> Any:
        kinds = {"d": "double *", "i": "int32_t *", "B": "uint8_t *"}
        return self._ffi.cast(kinds[array.dtype.char], array.ctypes.data)

    @property
    def _step(self) -> tuple[Any, float]:
        """Displacement and duration."""
        return self._pointer(self._u.x.array), float(self._duration.value)

    def add_forces(self, forces: Array) -> None:
        """Add what the stress exerts on the nodes of this rank's cells, ghosts included, N."""
        self._lib.add_forces(self._cells, *self._step, self._pointer(forces))

    def list_stiffness(self, held: NDArray[np.uint8], first: int, behind: int) -> Array:
        """Return the derivative of the forces, shape (cells, components of nodes, the same).

        Parameters
        ----------
        held
            1 where a component of the displacement is held, whose row and column are zero.
        first, behind
            Which cells.
        """
        entries = np.empty((behind - first, 3 * self.nodes.shape[1], 3 * self.nodes.shape[1]))
        arrays = self._pointer(held), first, behind, self._pointer(entries)
        self._lib.list_stiffness(self._cells, *self._step, *arrays)
        return entries

    def offsets(self, starts: Integers, columns: Integers) -> Integers:
        """Return where in a node's row of a matrix another node is, by cell, node and node.

        Parameters
        ----------
        starts, columns
            Of the rows, compressed, with sorted columns; one row and column per node.
        """
        found = np.empty((self.owned, *2 * self.nodes.shape[1:]), dtype=np.int32)
        arrays = (self._pointer(array) for array in (starts, columns, found))
        self._lib.find_offsets(self._cells, *arrays)
        return found

    def add_stiffness(
        self, held: NDArray[np.uint8], starts: Integers, offsets: Integers, values: Array
    ) -> None:
        """Add the derivative of the forces to a matrix with compressed rows.

        Parameters
        ----------
        held
            As for `list_stiffness`.
        starts
            Of the rows, one per component of the displacement, among the values.
        offsets
            By `offsets`.
        values
            To add to.
        """
        arrays = (self._pointer(array) for array in (held, starts, offsets, values))
        self._lib.add_stiffness(self._cells, *self._step, *arrays)

    def energies(self) -> tuple[float, float]:
        """Return what this rank's cells store, and have dissipated so far, N mm."""
        sums = np.zeros(2)
        self._lib.sum_energies(self._cells, *self._step, self._pointer(sums))
        return float(sums[0]), float(sums[1])

    def updated(self) -> Array:
        """Return what all points remember of the current state, as `MaterialMemory.numbers`."""
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
        """Return the derivatives of the stress by them, MPa, shape (cells, points, 3, 3, 3, 3)."""
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
    defined = "\n".join(f"#define {name} {value}" for name, value in sizes)
    elements = Path(__file__).with_name("element.c").read_text(encoding="utf-8")
    headers = "#include <math.h>\n#include <stdint.h>"
    material = material_source(law, parameters, local)
    return "\n".join((headers, defined, DECLARATIONS, material, elements))


def _declared() -> str:
    return DECLARATIONS + FUNCTIONS

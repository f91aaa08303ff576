"""Contributions of compiled C code to the equations: forces, and their derivatives in a matrix."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from dolfinx import fem
from dolfinx import mesh as dmesh
from numpy.typing import NDArray

from ramiefenics.model.compat import geometry_nodes
from ramiefenics.model.kernels.library import compiled

WIDTH = 4
"""How many numbers the loops over nodes and points handle at once."""

Array = NDArray[np.float64]
Integers = NDArray[np.int32]

FUNCTIONS = """
void add_forces(const struct cells *, const double *, double, double *);
void add_stiffness(const struct cells *, const double *, double, const uint8_t *, const int32_t *,
                   const int32_t *, double *);
void list_stiffness(const struct cells *, const double *, double, const uint8_t *, int64_t, int64_t,
                    double *);
void find_offsets(const struct cells *, const int32_t *, const int32_t *, int32_t *);
"""


class AssembledKernel:
    """Forces on the nodes of cells at the current displacement, and stiffness.

    Parameters
    ----------
    source, declarations
        C code with the functions above, and the declarations of whatever else is called. The
        structure `cells` begins with the number of cells and their nodes.
    nodes
        Nodes of the cells, shape (cells, nodes).
    owned
        Number of cells that are integrated over, which come first.
    displacement
        The unknown.
    duration
        Duration of the step, s.

    Attributes
    ----------
    nodes, owned
        As given.
    components
        Number of the displacement's components that this rank knows.
    """

    def __init__(
        self,
        source: str,
        declarations: str,
        nodes: Integers,
        owned: int,
        displacement: fem.Function,
        duration: fem.Constant,
    ) -> None:
        module = compiled(source, declarations + FUNCTIONS)
        self._ffi, self._lib = module.ffi, module.lib
        self.nodes, self.owned = np.ascontiguousarray(nodes), owned
        self._u, self._duration = displacement, duration
        self.components = len(displacement.x.array)
        self._cells: Any  # to be set by subclasses, which have the rest of the structure

    def _pointer(self, array: NDArray[Any]) -> Any:
        kinds = {"d": "double *", "i": "int32_t *", "B": "uint8_t *"}
        return self._ffi.cast(kinds[array.dtype.char], array.ctypes.data)

    @property
    def _step(self) -> tuple[Any, float]:
        """Displacement and duration, as arguments of the C functions."""
        return self._pointer(self._u.x.array), float(self._duration.value)

    def add_forces(self, forces: Array) -> None:
        """Add the forces on the nodes of this rank's cells, ghosts included, N."""
        self._lib.add_forces(self._cells, *self._step, self._pointer(forces))

    def list_stiffness(self, held: NDArray[np.uint8], first: int, behind: int) -> Array:
        """Return the derivative of the forces, shape (cells, 3 nodes, 3 nodes).

        Parameters
        ----------
        held
            1 where a component of the displacement is constrained, whose row and column are zero.
        first, behind
            First cell, and the one after the last.
        """
        entries = np.empty((behind - first, 3 * self.nodes.shape[1], 3 * self.nodes.shape[1]))
        arrays = self._pointer(held), first, behind, self._pointer(entries)
        self._lib.list_stiffness(self._cells, *self._step, *arrays)
        return entries

    def offsets(self, starts: Integers, columns: Integers) -> Integers:
        """Return the position of one node in the matrix row of another, by cell, node and node.

        Parameters
        ----------
        starts, columns
            Compressed rows of the matrix, with sorted columns; one row and column per node.
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
            Starts of the rows, one per component of the displacement, among the values.
        offsets
            Result of `offsets`.
        values
            Entries of the matrix, to add to.
        """
        arrays = (self._pointer(array) for array in (held, starts, offsets, values))
        self._lib.add_stiffness(self._cells, *self._step, *arrays)


def padded(count: int) -> int:
    """Return a number of nodes or points, rounded up to a whole multiple of `WIDTH`."""
    return -(-count // WIDTH) * WIDTH


def program(sizes: Mapping[str, int], parts: Sequence[str], file: str) -> str:
    """Return the C code of a kernel: sizes, declarations, generated functions, files."""
    defined = "\n".join(f"#define {name} {value}" for name, value in sizes.items())
    files = [Path(__file__).with_name(n).read_text(encoding="utf-8") for n in (file, "scatter.c")]
    return "\n".join(("#include <math.h>\n#include <stdint.h>", defined, *parts, *files))


def cell_maps(mesh: dmesh.Mesh, cells: Integers, points: Array) -> tuple[Array, Array]:
    """Return the positions in cells of points of the reference cell, and the Jacobians there.

    Returns
    -------
    tuple
        Positions, shape (cells, points, 3), and Jacobians, shape (cells, points, 3, 3).
    """
    element = mesh.ufl_domain().ufl_coordinate_element()
    element = element.sub_elements[0] if element.block_size > 1 else element
    shapes = np.reshape(element.tabulate(1, points), (4, len(points), -1))
    nodes = mesh.geometry.x[geometry_nodes(mesh)[cells]]
    places = np.einsum("cni,qn->cqi", nodes, shapes[0], optimize=True)
    return places, np.einsum("cni,kqn->cqik", nodes, shapes[1:], optimize=True)

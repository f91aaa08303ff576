"""A term of the equations that is evaluated by a kernel."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from dolfinx import fem
from numpy.typing import NDArray
from petsc4py import PETSc

from ramiefenics.model.kernels.assembled import AssembledKernel
from ramiefenics.model.matrix import Matrix

CHUNK = 256
"""Number of cells whose matrices are handed to PETSc at once."""


class KernelTerm:
    """Forces and stiffness of all cells of a kernel.

    On one rank, the kernel adds to the matrix's entries at positions that are found once; on
    several ranks, PETSc finds the position of each entry.

    Parameters
    ----------
    kernel
        Kernel that computes forces and stiffness.
    """

    def __init__(self, kernel: AssembledKernel) -> None:
        self._kernel = kernel
        self._offsets: NDArray[np.int32]  # positions in the last matrix
        self._matrix: Matrix | None = None

    def add_forces(self, forces: NDArray[np.float64]) -> None:  # noqa: D102
        self._kernel.add_forces(forces)

    def add_stiffness(self, matrix: Matrix, bcs: Sequence[fem.DirichletBC]) -> None:  # noqa: D102
        kernel = self._kernel
        held = np.zeros(kernel.components, dtype=np.uint8)
        for bc in bcs:
            held[bc.dof_indices()[0]] = 1
        if matrix.in_rows:
            if self._matrix is not matrix:
                self._matrix = matrix
                self._offsets = kernel.offsets(matrix.node_starts, matrix.node_columns)
            kernel.add_stiffness(held, matrix.starts, self._offsets, matrix.values)
            return
        for first in range(0, kernel.owned, CHUNK):
            behind = min(first + CHUNK, kernel.owned)
            nodes = kernel.nodes[first:behind]
            entries = kernel.list_stiffness(held, first, behind)
            matrix.petsc.setValuesBlockedLocalRCV(nodes, nodes, entries, PETSc.InsertMode.ADD)

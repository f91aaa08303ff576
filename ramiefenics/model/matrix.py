"""The matrix of the linearised equations, with direct access to its entries on one rank."""

from __future__ import annotations

from typing import Any

import numpy as np
from dolfinx import fem
from dolfinx.fem.petsc import create_matrix
from numpy.typing import NDArray
from petsc4py import PETSc
from scipy import sparse

NONE: NDArray[np.int64] = np.zeros((0, 2), dtype=np.int64)


class Matrix:
    """A PETSc matrix, whose entries on one rank are an array that can be added to directly.

    Parameters
    ----------
    pattern
        Bilinear form with an entry wherever the matrix may have one.
    couplings
        Pairs of nodes between which it may have further entries, global numbers, shape (n, 2); the
        same on every rank.

    Attributes
    ----------
    petsc
        The matrix in PETSc.
    in_rows
        Whether the array is available; if not, the following attributes do not exist.
    node_starts, node_columns
        Compressed rows of the graph of nodes, with sorted columns.
    starts, columns, values
        Compressed rows of the matrix, one per component of the displacement: starts, columns and
        entries. A pair of nodes has as many columns in a row as there are components.
    """

    def __init__(self, pattern: fem.Form, couplings: NDArray[np.int64] = NONE) -> None:
        space = pattern.function_spaces[0]
        self.in_rows = space.mesh.comm.size == 1
        couplings = np.concatenate([couplings, couplings[:, ::-1]])
        if not self.in_rows:
            self.petsc = create_matrix(pattern)
            self._make_room(couplings)
            return
        size = space.dofmap.index_map_bs
        sparsity = fem.create_sparsity_pattern(pattern)
        sparsity.finalize()
        columns, starts = (np.asarray(part, dtype=np.int32) for part in sparsity.graph)
        if len(couplings):
            columns, starts = _with_entries(columns, starts, couplings)
        self.node_starts, self.node_columns = starts, columns
        lengths = np.repeat(size * np.diff(starts), size)
        self.starts = np.concatenate([[0], np.cumsum(lengths)]).astype(np.int32)
        in_row = np.arange(self.starts[-1]) - np.repeat(self.starts[:-1], lengths)
        place = np.repeat(np.repeat(size * starts[:-1], size), lengths) + in_row
        self.columns = size * columns[place // size] + place % size
        self.values = np.zeros(len(self.columns))
        rows = self.starts.astype(PETSc.IntType), self.columns.astype(PETSc.IntType), self.values
        self.petsc = PETSc.Mat().createAIJWithArrays(len(lengths), rows, comm=PETSc.COMM_SELF)
        nodes = np.arange(len(starts) - 1, dtype=PETSc.IntType)
        same = PETSc.LGMap().create(nodes, bsize=size, comm=PETSc.COMM_SELF)
        self.petsc.setBlockSize(size)
        self.petsc.setLGMap(same, same)

    def _make_room(self, couplings: NDArray[np.int64]) -> None:
        """Add zero entries between pairs of nodes."""
        if not len(couplings):
            return
        self.petsc.setOption(PETSc.Mat.Option.NEW_NONZERO_ALLOCATION_ERR, False)
        size = self.petsc.getBlockSize()
        low, high = (edge // size for edge in self.petsc.getOwnershipRange())
        own = couplings[(low <= couplings[:, 0]) & (couplings[:, 0] < high)]
        for node in np.unique(own[:, 0]):
            others = own[own[:, 0] == node, 1].astype(PETSc.IntType)
            zeros = np.zeros((size, size * len(others)))
            self.petsc.setValuesBlocked([node], others, zeros, PETSc.InsertMode.ADD)
        self.petsc.assemble()

    def add_rows(
        self, rows: NDArray[np.int64], columns: NDArray[np.int64], entries: sparse.csr_array
    ) -> None:
        """Add to this rank's rows, at positions where the matrix may have entries.

        Parameters
        ----------
        rows, columns
            Global numbers of the rows and columns of `entries`.
        entries
            Values to add.
        """
        placed = (entries.indptr, columns[entries.indices], rows)
        starts, at, numbers = (part.astype(PETSc.IntType) for part in placed)
        self.petsc.setValuesIJV(starts, at, entries.data, PETSc.InsertMode.ADD, numbers)

    @property
    def own_rows(self) -> tuple[NDArray[Any], NDArray[Any], NDArray[np.float64]]:
        """Compressed rows of this rank: starts, global columns, and entries."""
        if self.in_rows:
            return self.starts, self.columns, self.values
        starts, columns, values = self.petsc.getValuesCSR()
        return starts, columns, values


def _with_entries(
    columns: NDArray[np.int32], starts: NDArray[np.int32], added: NDArray[np.int64]
) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """Add entries, by row and column, to compressed rows; return sorted columns and starts."""
    size = len(starts) - 1
    there = sparse.csr_array((np.ones(len(columns)), columns, starts), shape=(size, size))
    new = sparse.coo_array((np.ones(len(added)), tuple(added.T)), shape=(size, size))
    graph = sparse.csr_array(there + new)
    graph.sort_indices()
    return graph.indices.astype(np.int32), graph.indptr.astype(np.int32)

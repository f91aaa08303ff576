"""The matrix of a displacement's linearised equations, open to whoever knows where entries go."""

from __future__ import annotations

from typing import Any

import numpy as np
from dolfinx import fem
from dolfinx.fem.petsc import create_matrix
from numpy.typing import NDArray
from petsc4py import PETSc


class Matrix:
    """A matrix of PETSc. On one rank its entries are an array that can be added to directly.

    Parameters
    ----------
    pattern
        Bilinear form with an entry wherever the matrix may have one.

    Attributes
    ----------
    petsc
        The matrix.
    in_rows
        Whether there is the array; without, there are none of the following.
    node_starts, node_columns
        Compressed rows of the nodes, with sorted columns.
    starts, columns, values
        The same rows, one per component of the displacement: where they begin, and the entries. An
        entry of a node has as many columns as components.
    """

    def __init__(self, pattern: fem.Form) -> None:
        space = pattern.function_spaces[0]
        self.in_rows = space.mesh.comm.size == 1
        if not self.in_rows:
            self.petsc = create_matrix(pattern)
            return
        size = space.dofmap.index_map_bs
        sparsity = fem.create_sparsity_pattern(pattern)
        sparsity.finalize()
        columns, starts = (np.asarray(part, dtype=np.int32) for part in sparsity.graph)
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

    @property
    def own_rows(self) -> tuple[NDArray[Any], NDArray[Any], NDArray[np.float64]]:
        """Where this rank's rows begin, their columns among all, and the entries."""
        if self.in_rows:
            return self.starts, self.columns, self.values
        starts, columns, values = self.petsc.getValuesCSR()
        return starts, columns, values

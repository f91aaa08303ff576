"""Mass lumped at the nodes, positive for every type of element."""

from __future__ import annotations

import numpy as np
from dolfinx.fem.petsc import assemble_matrix
from numpy.typing import NDArray

from ramiefenics.solve.driven import Driven


def lumped_mass(problem: Driven) -> NDArray[np.float64]:
    """Return a structure's mass at the displacement components that this rank owns, tonne.

    The masses are the row sums of the consistent mass matrix, which are positive for elements of
    first order and for Lagrange hexahedra of second order. Where row sums are not positive
    (serendipity elements), the masses are the diagonal entries, scaled to the total mass (Hinton,
    Rock and Zienkiewicz 1976; here over all cells at once).
    """
    matrix = assemble_matrix(problem.mass)
    matrix.assemble()
    ones, rows = matrix.createVecs()
    ones.set(1.0)
    matrix.mult(ones, rows)
    if rows.min()[1] > 0.0:
        return rows.array.copy()
    diagonal = matrix.getDiagonal()
    return np.asarray(diagonal.array * (rows.sum() / diagonal.sum()))

"""Directions in the space of coordinates, along which simulations are differentiated."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import qr

from ramiefenics.specification.replacing import Path
from ramiefenics.surrogate.coordinates import Array, Direction, is_logarithmic

NOTHING = 1e-4
"""Size of a difference of coordinates, all taken together, below which it counts as none."""


def spanning(paths: Sequence[Path], rows: Array, size: Array) -> tuple[Direction, ...]:
    """Return directions that span differences of coordinates, and nothing else.

    Numbers that only change together, such as both coefficients of friction, may not be able to
    change apart. Logarithms may be mixed at will. Other numbers may be one-sided, such as a damage
    that is at least zero, and a mixture of two of them may be possible in neither sense. Of the
    given differences, those in the fewest numbers are therefore taken.

    Parameters
    ----------
    paths
        Paths of the coordinates.
    rows
        Differences, shape (n, d).
    size
        Magnitudes of the coordinates, shape (d,), relative to which differences may be rounding
        errors.
    """
    ranges = np.abs(rows).max(axis=0)
    logarithmic = np.array([is_logarithmic(path) for path in paths])
    others = ~logarithmic & (ranges > 1e-9 * (1.0 + size))
    scale = np.where(others, ranges, 1.0)
    found = np.concatenate([_span(rows, logarithmic), _chosen(rows / scale, others) * scale])
    return tuple(_direction(f"direction_{k}", row, paths) for k, row in enumerate(found))


def components(directions: Sequence[Direction], paths: Sequence[Path]) -> Array:
    """Return directions as rows of coordinates, shape (q, d)."""
    rows = np.zeros((len(directions), len(paths)))
    for row, direction in zip(rows, directions, strict=True):
        row[[paths.index(path) for path in direction.paths]] = direction.weights
    return rows


def combinations(rows: Array, along: Array) -> Array:
    """Return weights, shape (n, q), with which directions best add up to differences.

    Parameters
    ----------
    rows
        Differences of coordinates, shape (n, d).
    along
        Directions, shape (q, d).
    """
    return np.asarray(np.linalg.lstsq(along.T, rows.T, rcond=None)[0].T)


def _direction(name: str, row: Array, paths: Sequence[Path]) -> Direction:
    used = np.flatnonzero(np.abs(row) > 1e-12)
    weights = tuple(float(weight) for weight in row[used])
    return Direction(name, tuple(paths[index] for index in used), weights)


def _span(rows: Array, columns: NDArray[np.bool_]) -> Array:
    """Return unit vectors that span some columns of rows, zero in the other columns."""
    _, sizes, axes = np.linalg.svd(rows[:, columns], full_matrices=False)
    found = np.zeros((len(axes), rows.shape[1]))
    found[:, columns] = axes
    return found[sizes > NOTHING]


def _chosen(rows: Array, columns: NDArray[np.bool_]) -> Array:
    """Return rows, with few nonzeros each, that span some columns of all; zero in the others."""
    block = np.where(columns, rows, 0.0)
    sizes = np.linalg.norm(block, axis=1)
    block = block[sizes > NOTHING] / sizes[sizes > NOTHING, None]
    used = (np.abs(block) > NOTHING).sum(axis=1)
    _, triangle, order = qr((block / used[:, None] ** 2).T, mode="economic", pivoting=True)
    return block[order[: np.count_nonzero(np.abs(np.diag(triangle)) > NOTHING)]]

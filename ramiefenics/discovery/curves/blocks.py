"""Grouping of curves by specimen: one block of the data for each specimen."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.floating[Any]]
Integers = NDArray[np.integer[Any]]

SMOOTHNESS = (1.0,) * 5 + (0.2,) * 4
"""Standard deviations of the cosines along the displacement that make up a smooth error, relative
to its size. At the true parameters of three synthetic data sets, the program's forces err by up to
0.26 % of the peak in the first five, and by 0.07 % on average in the next four."""


@dataclass(frozen=True)
class Blocks:
    """Arrangement of curves in blocks, one for each specimen.

    All blocks are as long as the longest one; the rest of a shorter one has no data.

    Attributes
    ----------
    specimen
        Index of the specimen of every curve, counted from 0, shape (r,).
    place
        Index of every curve among those of its specimen, counted from 0, shape (r,).
    points
        Number of displacements of a curve, m.
    """

    specimen: Integers
    place: Integers
    points: int

    @classmethod
    def of(cls, specimens: Sequence[str], points: int) -> Blocks:
        """Arrange curves, given the name of the specimen of each."""
        names = list(dict.fromkeys(specimens))
        places = [list(specimens[:index]).count(name) for index, name in enumerate(specimens)]
        numbers = [names.index(name) for name in specimens]
        return cls(np.array(numbers, dtype=int), np.array(places, dtype=int), points)

    @property
    def number(self) -> int:
        """Number of specimens, n."""
        return int(self.specimen.max()) + 1

    @property
    def most(self) -> int:
        """Number of curves of the specimen that has most."""
        return int(self.place.max()) + 1

    def stack(self, columns: Array) -> Array:
        """Return columns, shape (r, c, m), stacked by specimen, shape (n, b, c), b = most * m."""
        whole = np.zeros((self.number, self.most, self.points, columns.shape[1]))
        whole[self.specimen, self.place] = columns.transpose(0, 2, 1)
        return whole.reshape(self.number, self.most * self.points, columns.shape[1])

    def curves(self, stacked: Array) -> Array:
        """Return stacked columns by curve again, shape (r, c, m)."""
        whole = stacked.reshape(self.number, self.most, self.points, -1)
        return np.asarray(whole[self.specimen, self.place].transpose(0, 2, 1))

    def covariance(self, kernels: Array, elsewhere: float) -> Array:
        """Return blocks, (n, b, b), with matrices of the curves, (r, m, m), on their diagonals.

        Where there are no data, the diagonal is `elsewhere`.
        """
        n, q, m = self.number, self.most, self.points
        whole = np.zeros((n, q, m, q, m))
        diagonal = np.einsum("nqiqi->nqi", whole)
        diagonal[...] = elsewhere
        whole[self.specimen, self.place, :, self.place, :] = kernels
        return whole.reshape(n, q * m, q * m)

    def kernels(self, covariance: Array) -> Array:
        """Return the blocks of the curves, shape (r, m, m), on the diagonals of (n, b, b)."""
        whole = covariance.reshape(self.number, self.most, self.points, self.most, self.points)
        return np.asarray(whole[self.specimen, self.place, :, self.place, :])


def smooth(curves: int, points: int) -> Array:
    """Return cosines, slow ones of unit amplitude, the same for all curves, shape (r, modes, m)."""
    x = (np.arange(points) + 0.5) / points
    modes = np.array([share * np.cos(k * np.pi * x) for k, share in enumerate(SMOOTHNESS)])
    return np.broadcast_to(modes, (curves, *modes.shape)).copy()

"""Products by the inverse covariance of all curves, for many scatters at once.

A specimen's own part of the covariance is ``sigma^2 N + tau^2 J J^T`` (see `evidence`). With
``N = L L^T``, which the length of correlation decides alone, and ``L^-1 J = U S V^T``, its inverse
is

    L^-T (1 - U diag(w) U^T) L^-1 / sigma^2,   w = tau^2 S^2 / (sigma^2 + tau^2 S^2)

(Sherman, Morrison and Woodbury: Golub and Van Loan 2013, section 2.1.4), so that all products need
to be summed over displacements only once for each length.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_triangular

Array = NDArray[np.floating[Any]]


@dataclass(frozen=True)
class Columns:
    """Columns in the basis of the whitened noise.

    Attributes
    ----------
    white
        Shape (n m, c).
    own
        What the specimens' own factors see of them, ``U^T`` times that, shape (n k, c).
    """

    white: Array
    own: Array


@dataclass(frozen=True)
class Scales:
    """A pair of standard deviations.

    Attributes
    ----------
    sigma
        Of the noise.
    weight
        w, shape (n k, 1).
    half_log_determinant
        Of the specimens' own parts of the covariance.
    """

    sigma: float
    weight: Array
    half_log_determinant: float


class Whitening:
    """The covariance without what the specimens share, for one length of correlation.

    Parameters
    ----------
    noise
        N, shape (m, m).
    by_factors
        J, shape (n, k, m).
    """

    def __init__(self, noise: Array, by_factors: Array) -> None:
        self._root = np.linalg.cholesky(noise)
        self._shape = by_factors.shape
        own = self._whiten(by_factors.transpose(0, 2, 1))
        self._basis, self._singular, _ = np.linalg.svd(own, full_matrices=False)

    def _whiten(self, columns: Array) -> Array:
        n, m, c = columns.shape
        side = columns.transpose(1, 0, 2).reshape(m, n * c)
        white = solve_triangular(self._root, side, lower=True, check_finite=False)
        return np.asarray(white.reshape(m, n, c).transpose(1, 0, 2))

    def columns(self, columns: Array) -> Columns:
        """Return columns, shape (n, m, c), in the new basis."""
        white = self._whiten(columns)
        own = self._basis.transpose(0, 2, 1) @ white
        number = columns.shape[2]
        return Columns(white.reshape(-1, number), own.reshape(-1, number))

    def scales(self, tau: float, sigma: float) -> Scales:
        """Return what depends on the standard deviations."""
        ratio = (tau / sigma * self._singular).reshape(-1, 1) ** 2
        n, _, m = self._shape
        whole = n * (m * np.log(sigma) + np.log(np.diagonal(self._root)).sum())
        return Scales(sigma, ratio / (1.0 + ratio), float(whole + 0.5 * np.log1p(ratio).sum()))

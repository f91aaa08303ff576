"""Curves in a basis in which their errors are white, with what specimens share integrated out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ramiefenics.discovery.curves.blocks import Array


@dataclass(frozen=True)
class Whitened:
    """Columns in a basis in which errors are white.

    Attributes
    ----------
    columns
        Columns that specimens share, for unit prior deviations, in the order factors, nuisance,
        effects; then those of the data. Shape (n, b, c).
    shared, effects
        Numbers of columns of factors and nuisance, and of effects.
    half_log_determinant
        Half the logarithm of the determinant of the covariance of what specimens do not share.
    """

    columns: Array
    shared: int
    effects: int
    half_log_determinant: float

    def reduce(self) -> Reduced:
        """Integrate out factors and nuisance."""
        flat = self.columns.reshape(-1, self.columns.shape[2])
        shared, rest = flat[:, : self.shared], flat[:, self.shared :]
        gram = np.eye(self.shared) + shared.T @ shared
        root = np.linalg.cholesky(gram)
        taken = np.linalg.solve(root, shared.T @ rest)
        p = self.effects
        products = rest[:, :p].T @ rest - taken[:, :p].T @ taken
        left = (rest[:, p:] ** 2).sum(axis=0) - (taken[:, p:] ** 2).sum(axis=0)
        volume = self.half_log_determinant + float(np.log(np.diagonal(root)).sum())
        return Reduced(products[:, :p], products[:, p:], -0.5 * left - volume)

    def deviations(self, chosen: Sequence[int]) -> tuple[Array, Array]:
        """Return the mean and covariance of factors, nuisance and chosen effects given the data.

        Parameters
        ----------
        chosen
            Indices of the effects, counted from 0.
        """
        columns = self._chosen(chosen)
        gram = np.einsum("nbi,nbj->ij", columns, columns)
        onto = np.einsum("nbi,nb->i", columns, self.columns[..., -1])
        covariance = np.linalg.inv(np.eye(len(gram)) + gram)
        return covariance @ onto, covariance

    def left_out(self, chosen: Sequence[int]) -> Array:
        """Return the mean of the same with each specimen left out in turn, shape (n, c)."""
        columns = self._chosen(chosen)
        grams = np.einsum("nbi,nbj->nij", columns, columns)
        onto = np.einsum("nbi,nb->ni", columns, self.columns[..., -1])
        rest = np.eye(columns.shape[2]) + grams.sum(axis=0) - grams
        return np.asarray(np.linalg.solve(rest, (onto.sum(axis=0) - onto)[..., None])[..., 0])

    def _chosen(self, chosen: Sequence[int]) -> Array:
        which = [*range(self.shared), *(self.shared + index for index in chosen)]
        return self.columns[..., which]


@dataclass(frozen=True)
class Reduced:
    """Information in the data on the effects' amplitudes, relative to `Evidence.scale`.

    Attributes
    ----------
    gram
        Precision of the amplitudes from the data alone, shape (p, p).
    onto
        Products of the signatures with the data, shape (p, B).
    log_evidence
        Log-evidence of the data without effects, shape (B,).
    """

    gram: Array
    onto: Array
    log_evidence: Array

    def amplitudes(self, chosen: Sequence[int], prior: float | Array = 1.0) -> tuple[Array, Array]:
        """Return the mean and covariance of chosen amplitudes, for given prior precisions."""
        which = list(chosen)
        covariance = np.linalg.inv(prior * np.eye(len(which)) + self.gram[np.ix_(which, which)])
        return covariance @ self.onto[which, 0], covariance

"""How probable measured curves are under a model: one Gaussian for all curves of all specimens.

Residuals of the linearised model without factors and effect, over each specimen's peak force,
stacked for all specimens, are taken as

    r = a g + J (d + b_s) + D c + e_s

with g the effect's signature and a its amplitude; J the derivatives by the fitted log factors, d
their common values, b_s what a specimen's own material deviates by (sd tau, the same for all
factors); D what the simulator may be wrong by, the same way in all specimens (`nuisance`); e_s the
noise, of sd sigma and correlation exp(-|x - x'| / l). All but a are Gaussian and integrated out
(a linear mixed model: Laird and Ware 1982); tau, sigma and l maximise the likelihood on a grid.
The common parts bind the specimens together: it is their number, not that of points, that counts.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_triangular

from ramiefenics.discovery.whitening import Whitening

Array = NDArray[np.floating[Any]]

SCATTER = (0.0, 0.01, 0.02, 0.03, 0.045, 0.07, 0.1, 0.15, 0.25, 0.4, 0.6)
"""Grid of tau, a specimen's own log factors."""

NOISE = tuple(0.001 * 2.0 ** (k / 2.0) for k in range(14))
"""Grid of sigma, over the peak force: 0.1 to 9 %."""

LENGTH_SHARE = (0.01, 0.02, 0.04, 0.08, 0.16, 0.32)
"""Grid of l, over the range of displacement."""

WHITE = 0.05
"""Part of the noise, over its sd, that is not correlated at all."""


@dataclass(frozen=True)
class Scatter:
    """Standard deviations and the length of correlation.

    Attributes
    ----------
    tau
        Of a specimen's own log factors.
    sigma
        Of the noise, over the peak force.
    length
        Over which noise is correlated, as a share of the range.
    """

    tau: float
    sigma: float
    length: float


@dataclass(frozen=True)
class Fit:
    """The best amplitudes for one signature, or none.

    Attributes
    ----------
    log_likelihood
        At the maximum.
    amplitude, error
        With its standard deviation.
    scatter
        Where the maximum is.
    """

    log_likelihood: float
    amplitude: float
    error: float
    scatter: Scatter


class Evidence:
    """Likelihood of residuals; everything over each specimen's peak force.

    Parameters
    ----------
    residual
        Measured minus predicted without factors and effect, shape (n, m).
    by_factors
        J, shape (n, k, m).
    nuisance
        D for deviations of unit prior, shape (n, q, m).
    factor_sd
        Prior of a common log factor: how well the moduli are known.
    """

    def __init__(
        self, residual: Array, by_factors: Array, nuisance: Array, factor_sd: float
    ) -> None:
        self.residual = residual[..., None]
        self._J, self._nuisance, self._factor_sd = by_factors, nuisance, factor_sd
        common = np.concatenate([factor_sd * by_factors, nuisance], axis=1)
        self._common = common.transpose(0, 2, 1)
        where = np.arange(residual.shape[1]) / residual.shape[1]
        self._distance = np.abs(where[:, None] - where)

    def without(self, specimen: int) -> Evidence:
        """Return the evidence of all specimens but one."""
        residual, by_factors, nuisance = (
            np.delete(part, specimen, axis=0)
            for part in (self.residual[..., 0], self._J, self._nuisance)
        )
        return Evidence(residual, by_factors, nuisance, self._factor_sd)

    def with_nuisance(self, columns: Array) -> Evidence:
        """Return the evidence with more nuisance, shape (n, q, m)."""
        together = np.concatenate([self._nuisance, columns], axis=1)
        return Evidence(self.residual[..., 0], self._J, together, self._factor_sd)

    def fit(self, signature: Array | None = None, limits: tuple[float, float] = (0, 0)) -> Fit:
        """Return the best fit with a signature, shape (n, m), or without any."""
        grid = all_scatters()
        g = np.zeros(self.residual.shape[:2]) if signature is None else signature
        log_likelihoods, amplitudes, squares = self.log_likelihoods(
            grid, g[None], [limits], self.residual
        )
        best = int(log_likelihoods[:, 0, 0].argmax())
        error = float(squares[best, 0]) ** -0.5 if squares[best, 0] > 0.0 else 0.0
        amplitude = float(amplitudes[best, 0, 0])
        return Fit(float(log_likelihoods[best, 0, 0]), amplitude, error, grid[best])

    def log_likelihoods(
        self,
        scatters: Sequence[Scatter],
        signatures: Array,
        limits: Sequence[tuple[float, float]],
        residuals: Array,
    ) -> tuple[Array, Array, Array]:
        """Fit every signature to residuals with every scatter.

        Parameters
        ----------
        scatters
            Which to try, S of them.
        signatures, limits
            Shape (E, n, m); least and largest amplitude of each.
        residuals
            B sets of data, shape (n, m, B).

        Returns
        -------
        tuple
            Log-likelihoods and amplitudes, shape (S, E, B); for each signature the inverse of the
            amplitude's variance, shape (S, E).
        """
        number = len(signatures)
        vectors = np.concatenate([signatures.transpose(1, 2, 0), residuals], axis=2)
        shape = (len(scatters), number, residuals.shape[2])
        log_likelihoods, amplitudes = np.empty(shape), np.empty(shape)
        squares = np.empty(shape[:2])
        low, high = np.array(limits, dtype=float).T[..., None]
        for length in {scatter.length for scatter in scatters}:
            products = self._products(length, vectors, number)
            for index, scatter in enumerate(scatters):
                if scatter.length != length:
                    continue
                square, product, rest, volume = products(scatter)
                a = np.clip(product / np.maximum(square, 1e-300)[:, None], low, high)
                fits = a * product - 0.5 * a**2 * square[:, None] - 0.5 * rest
                log_likelihoods[index] = fits - volume
                amplitudes[index], squares[index] = a, square
        return log_likelihoods, amplitudes, squares

    def _products(
        self, length: float, vectors: Array, number: int
    ) -> Callable[[Scatter], tuple[Array, Array, Array, float]]:
        """Return a function of scatters with that length of correlation.

        It gives products by the inverse covariance: of each of the first vectors with itself and
        with all others, of each of the others with itself; and half the covariance's logarithmic
        determinant.
        """
        whitening = Whitening(self._noise(length), self._J)
        common, given = whitening.columns(self._common), whitening.columns(vectors)
        x, y = given.white[:, :number], given.white[:, number:]
        own_x, own_y = given.own[:, :number], given.own[:, number:]
        inner, onto = common.white.T @ common.white, common.white.T @ given.white
        squares, both, rests = (x**2).sum(axis=0), x.T @ y, (y**2).sum(axis=0)

        def products(scatter: Scatter) -> tuple[Array, Array, Array, float]:
            scales = whitening.scales(scatter.tau, scatter.sigma)
            weighted, variance = scales.weight * common.own, scales.sigma**2
            gram = np.eye(len(inner)) + (inner - weighted.T @ common.own) / variance
            root = np.linalg.cholesky(gram)
            shared = (onto - weighted.T @ given.own) / variance
            taken = solve_triangular(root, shared, lower=True, check_finite=False)
            u, v = taken[:, :number], taken[:, number:]
            weighted_x = scales.weight * own_x
            square = (squares - (weighted_x * own_x).sum(axis=0)) / variance - (u**2).sum(axis=0)
            product = (both - weighted_x.T @ own_y) / variance - u.T @ v
            own_rests = (scales.weight * own_y**2).sum(axis=0)
            rest = (rests - own_rests) / variance - (v**2).sum(axis=0)
            volume = scales.half_log_determinant + np.log(np.diagonal(root)).sum()
            return square, product, rest, float(volume)

        return products

    def products(self, scatter: Scatter, vectors: Array) -> Array:
        """Return all products of vectors, shape (E, n, m), by the inverse covariance."""
        twice = np.concatenate([vectors, vectors]).transpose(1, 2, 0)
        _, found, _, _ = self._products(scatter.length, twice, len(vectors))(scatter)
        return found

    def mean_log_factors(self, fit: Fit, signature: Array | None = None) -> Array:
        """Return the expected log factors, mean over the specimens, shape (k,).

        That is d and the mean of b_s: where the data contradict the prior of d, part of what all
        specimens share is in the latter.
        """
        deviations = self._common_deviations(fit, signature)
        errors = self._without(fit, signature)[..., 0] - self._common @ deviations
        common = self._factor_sd * deviations[: self._J.shape[1]]
        return np.asarray(common + self._own_log_factors(fit, errors).mean(axis=0))

    def _without(self, fit: Fit, signature: Array | None) -> Array:
        """Return the residual less the effect, shape (n, m, 1)."""
        if signature is None:
            return self.residual
        return np.asarray(self.residual - fit.amplitude * signature[..., None])

    def _common_deviations(self, fit: Fit, signature: Array | None) -> Array:
        data = self._without(fit, signature)
        own, common, _ = self._reduce(fit.scatter)
        white = np.linalg.solve(own, data)[..., 0]
        return _posterior(
            np.einsum("nmq,nmp->qp", common, common), np.einsum("nmq,nm->q", common, white)
        )

    def left_out(self, fit: Fit, signature: Array | None = None) -> Array:
        """Predict each specimen's residual from all others, shape (n, m), given the scatter."""
        own, common, _ = self._reduce(fit.scatter)
        g = np.zeros_like(self.residual) if signature is None else signature[..., None]
        white = np.linalg.solve(own, np.concatenate([g, self.residual], axis=2))
        gram = np.einsum("nmq,nmp->nqp", common, common)
        onto = np.einsum("nmq,nmc->nqc", common, white)
        plain = np.einsum("nma,nmb->nab", white, white)
        predicted = np.zeros(self.residual.shape[:2])
        for s in range(len(predicted)):
            rest = np.arange(len(predicted)) != s
            inner, both = gram[rest].sum(axis=0), onto[rest].sum(axis=0)
            solved = _posterior(inner, both)
            products = plain[rest].sum(axis=0) - both.T @ solved
            a = 0.0 if signature is None else products[0, 1] / products[0, 0]
            weights = solved[:, 1] - a * solved[:, 0]
            predicted[s] = a * g[s, :, 0] + self._common[s] @ weights
        return predicted

    def without_own(self, fit: Fit, errors: Array) -> Array:
        """Return errors, shape (n, m), less what each specimen's own factors make of them."""
        return errors - np.einsum("nki,nk->ni", self._J, self._own_log_factors(fit, errors))

    def _own_log_factors(self, fit: Fit, errors: Array) -> Array:
        """Return the expected b_s, shape (n, k), given errors without the common parts."""
        own, _, _ = self._reduce(fit.scatter)
        white = np.linalg.solve(own, errors[..., None])
        solved = np.linalg.solve(own.transpose(0, 2, 1), white)
        return np.asarray(fit.scatter.tau**2 * np.einsum("nkj,njc->nk", self._J, solved))

    def parts(self, fit: Fit, signature: Array | None = None) -> tuple[Array, Array]:
        """Return what effect and mean factors explain, and what the nuisance does, (n, m)."""
        deviations = self._common_deviations(fit, signature)
        number = self._J.shape[1]
        explained = np.einsum("nkm,k->nm", self._J, self.mean_log_factors(fit, signature))
        if signature is not None:
            explained += fit.amplitude * signature
        return explained, self._common[..., number:] @ deviations[number:]

    def draw(self, scatter: Scatter, number: int, rng: np.random.Generator) -> Array:
        """Return random residuals without any effect, shape (n, m, number)."""
        own, _, _ = self._reduce(scatter)
        noise = own @ rng.standard_normal((*self.residual.shape[:2], number))
        return noise + self._common @ rng.standard_normal((self._common.shape[2], number))

    def _noise(self, length: float) -> Array:
        """Return the noise's covariance over sigma^2, shape (m, m)."""
        return np.asarray(np.exp(-self._distance / length) + WHITE**2 * np.eye(len(self._distance)))

    def _reduce(self, scatter: Scatter) -> tuple[Array, Array, float]:
        """Return what the inverse of the covariance needs.

        That is the root of every specimen's own part, the common columns whitened by it, and half
        the logarithm of the determinant of the whole.
        """
        own = scatter.sigma**2 * self._noise(scatter.length) + scatter.tau**2 * np.einsum(
            "nki,nkj->nij", self._J, self._J
        )
        root = np.linalg.cholesky(own)
        common = np.linalg.solve(root, self._common)
        inner = np.eye(common.shape[2]) + np.einsum("nmq,nmp->qp", common, common)
        volume = np.log(np.diagonal(root, axis1=1, axis2=2)).sum()
        return root, common, float(volume + 0.5 * np.linalg.slogdet(inner)[1])


def _posterior(gram: Array, onto: Array) -> Array:
    """Return the expected deviations of unit prior, given products of their columns with data."""
    return np.asarray(np.linalg.solve(np.eye(len(gram)) + gram, onto))


def all_scatters(length: float | None = None) -> list[Scatter]:
    """Return the grid, or the part of it with that length of correlation."""
    lengths = LENGTH_SHARE if length is None else (length,)
    return [Scatter(*values) for values in itertools.product(SCATTER, NOISE, lengths)]

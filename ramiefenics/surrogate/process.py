"""Gaussian process for values and directional derivatives of several outputs at once.

The prior mean is linear in the coordinates, with unknown coefficients, and the covariance is
squared-exponential with one length per coordinate. Lengths and scales have priors, as observations
that differ in some coordinates only say nothing about how far the function is from linear in the
others. Derivatives are linear in the function, so they
are observed like values, with derivatives of the covariance (Rasmussen and Williams 2006, sections
2.7 and 9.4). All outputs share lengths and noise, and each has a scale of its own; these maximise
the restricted likelihood times the priors. The errors of predictions in which all observations of
one run are left out at a time follow without another fit (section 5.4.2 there).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve
from scipy.optimize import minimize
from scipy.spatial.distance import cdist

Array = NDArray[np.floating[Any]]

LENGTHS = (0.5, 200.0)
"""Bounds of the lengths of the covariance, for coordinates that differ by about one."""

LENGTH = (2.0, 0.7)
"""Median of the lengths before anything is observed, and standard deviation of their logarithm."""

SCALE, SCALE_WEIGHT = 0.5, 3.0
"""Scale of the process before anything is observed, and the weight of that in observations.

For logarithms of a force that is a sum of parts in proportion to some coordinates' exponentials,
second derivatives are up to 0.25; these values give 0.2 with the median length."""

NOISE = (1e-4, 0.3)
"""Bounds of the standard deviation of the noise of values, and of that of derivatives, relative to
the scale of the process. Simulations are no more exact than the least, and with much less the
likelihood consists of rounding errors."""


@dataclass(frozen=True)
class Observed:
    """Observed values and derivatives.

    Attributes
    ----------
    at
        Coordinates, which differ by about one, shape (N, d).
    along
        Directions of the derivatives, of length about one, shape (N, d); zero for a value.
    value
        Observed values and derivatives of m outputs, shape (N, m).
    run
        Number of the run to which each belongs, shape (N,); each run has one value, and
        derivatives.
    """

    at: Array
    along: Array
    value: Array
    run: NDArray[np.integer[Any]]

    @property
    def plain(self) -> Array:
        """1 where a value is observed, 0 where a derivative is, shape (N,)."""
        return np.asarray(~self.along.any(axis=1), dtype=float)


@dataclass(frozen=True)
class _Pairs:
    """Pairs of what is asked for (a) and what was observed (b), in units of the lengths.

    The attributes are the places and directions of both, shapes (n, d) and (N, d), and
    `Observed.plain` of both. Everything is computed by products of matrices, because there are many
    pairs with many coordinates.
    """

    at_a: Array
    along_a: Array
    plain_a: Array
    at_b: Array
    along_b: Array
    plain_b: Array

    @cached_property
    def of_a(self) -> Array:
        """Component of the difference of places, a minus b, along a's direction, shape (n, N)."""
        own = (self.along_a * self.at_a).sum(axis=1)[:, None]
        return np.asarray(own - self.along_a @ self.at_b.T)

    @cached_property
    def of_b(self) -> Array:
        """Component of the same difference along b's direction, shape (n, N)."""
        own = (self.along_b * self.at_b).sum(axis=1)
        return np.asarray(self.at_a @ self.along_b.T - own)

    @cached_property
    def decay(self) -> Array:
        """Covariance of values, shape (n, N)."""
        return np.asarray(np.exp(-0.5 * cdist(self.at_a, self.at_b, "sqeuclidean")))

    @cached_property
    def factor(self) -> Array:
        """Covariance of values or derivatives relative to that of values, shape (n, N)."""
        a, b = self.plain_a[:, None], self.plain_b
        plain = a * b + a * self.of_b - b * self.of_a
        return np.asarray(plain + self.along_a @ self.along_b.T - self.of_a * self.of_b)

    def gradient(self, by_covariance: Array) -> Array:
        """Return derivatives by the logarithms of the lengths, given those by the covariance.

        The latter are symmetric, shape (N, N), because both sides of the pairs are the same
        observations.
        """
        x, v = self.at_a, self.along_a
        weight = by_covariance * self.decay
        sloped, whole = weight * (self.of_b + self.plain_b), weight * self.factor
        by_slopes = (x * v).T @ sloped.sum(axis=1) - (v * (sloped @ x)).sum(axis=0)
        by_distance = (x**2).T @ whole.sum(axis=1) - (x * (whole @ x)).sum(axis=0)
        return np.asarray(
            4.0 * by_slopes - 2.0 * (v * (weight @ v)).sum(axis=0) + 2.0 * by_distance
        )


class Process:
    """A Gaussian process given observations.

    Parameters
    ----------
    observed
        Values of at least two runs, and enough derivatives to cover all coordinates.

    Attributes
    ----------
    lengths
        Lengths of the covariance, shape (d,).
    """

    def __init__(self, observed: Observed) -> None:
        self._observed = observed
        value = observed.plain[:, None]
        self._basis = np.hstack([value, value * observed.at + observed.along])
        d = observed.at.shape[1]
        bounds = [tuple(np.log(LENGTHS))] * d + [tuple(np.log(NOISE))] * 2
        start = np.log([LENGTH[0]] * d + [1e-3, 1e-2])
        found = minimize(self._cost, start, jac=True, method="L-BFGS-B", bounds=bounds)
        self._set(found.x)

    def _cost(self, log_parameters: Array) -> tuple[float, Array]:
        """Return the negative log-posterior, up to a constant, and its gradient.

        They follow Rasmussen and Williams 2006, equations 2.45 and 5.9, with the optimal scales.
        The prior of each scale's square is inverse-gamma. Every output brings its own prior of the
        lengths, as it brings its own likelihood.
        """
        self._set(log_parameters)
        outputs = len(self._scale2)
        cost = 0.5 * self._freedom * np.log(self._scale2).sum()
        cost += 0.5 * outputs * self._log_determinant
        away = (log_parameters[:-2] - np.log(LENGTH[0])) / LENGTH[1]
        cost += 0.5 * outputs * (away**2).sum()
        of_values = (self._weights / self._scale2) @ self._weights.T
        by_covariance = 0.5 * (outputs * self._precision() - of_values)
        by_length = self._pairs(self._observed.at, self._observed.along).gradient(by_covariance)
        by_length += outputs * away / LENGTH[1]
        by_variance = 2.0 * np.diag(by_covariance) * self._noise**2
        value = self._observed.plain > 0.0
        by_noise = [by_variance[value].sum(), by_variance[~value].sum()]
        return float(cost), np.concatenate([by_length, by_noise])

    def _set(self, log_parameters: Array) -> None:
        """Set lengths and noise, and compute what predictions need."""
        *lengths, of_value, of_derivative = np.exp(log_parameters)
        observed, basis = self._observed, self._basis
        self.lengths = np.array(lengths)
        self._noise = np.where(observed.plain > 0.0, of_value, of_derivative)
        covariance = self._covariance(observed.at, observed.along)
        covariance[np.diag_indices_from(covariance)] += self._noise**2
        self._root = cho_factor(covariance, lower=True)
        self._inside = cho_solve(self._root, basis)
        self._gram = cho_factor(basis.T @ self._inside, lower=True)
        self._line = cho_solve(self._gram, self._inside.T @ observed.value)
        self._weights = cho_solve(self._root, observed.value - basis @ self._line)
        squares = (observed.value * self._weights).sum(axis=0)
        self._scale2 = (squares + SCALE_WEIGHT * SCALE**2) / self._freedom
        diagonals = np.concatenate([np.diag(self._root[0]), np.diag(self._gram[0])])
        self._log_determinant = 2.0 * float(np.log(diagonals).sum())

    @property
    def _freedom(self) -> float:
        """Number of observations besides those that determine the mean, with that of the prior."""
        return len(self._basis) - self._basis.shape[1] + SCALE_WEIGHT

    def _precision(self) -> Array:
        """Return the inverse covariance minus the part that the unknown mean takes up."""
        whole = cho_solve(self._root, np.eye(len(self._basis)))
        return np.asarray(whole - self._inside @ cho_solve(self._gram, self._inside.T))

    def _pairs(self, at: Array, along: Array) -> _Pairs:
        observed = self._observed
        plain = np.asarray(~along.any(axis=1), dtype=float)
        scaled = (x / self.lengths for x in (at, along, observed.at, observed.along))
        at_a, along_a, at_b, along_b = scaled
        return _Pairs(at_a, along_a, plain, at_b, along_b, observed.plain)

    def _covariance(self, at: Array, along: Array) -> Array:
        """Return covariances with the observations, shape (n, N)."""
        pairs = self._pairs(at, along)
        return np.asarray(pairs.factor * pairs.decay)

    def mean(self, at: Array) -> Array:
        """Return the expected values, shape (n, m)."""
        line = np.column_stack([np.ones(len(at)), at]) @ self._line
        return np.asarray(line + self._covariance(at, np.zeros_like(at)) @ self._weights)

    def sd(self, at: Array) -> Array:
        """Return the standard deviations of the values without noise, shape (n, m)."""
        across = self._covariance(at, np.zeros_like(at)).T
        rest = np.column_stack([np.ones(len(at)), at]).T - self._inside.T @ across
        variance = 1.0 - (across * cho_solve(self._root, across)).sum(axis=0)
        variance += (rest * cho_solve(self._gram, rest)).sum(axis=0)
        return np.sqrt(np.maximum(variance, 0.0)[:, None] * self._scale2)

    def left_out(self) -> tuple[Array, Array]:
        """Return errors of each run's value predicted from all other runs, and their sd.

        Both have shape (runs, m), in the order of the runs' numbers, and are NaN for a run without
        which the others do not determine the mean.
        """
        precision, errors, deviations = self._precision(), [], []
        for run in np.unique(self._observed.run):
            own = self._observed.run == run
            if np.linalg.matrix_rank(self._basis[~own]) < self._basis.shape[1]:
                errors.append(np.full(len(self._scale2), np.nan))
                deviations.append(errors[-1])
                continue
            block = np.linalg.inv(precision[np.ix_(own, own)])
            value = int(self._observed.plain[own].argmax())
            errors.append(block[value] @ self._weights[own])
            deviations.append(np.sqrt(max(block[value, value], 0.0) * self._scale2))
        return np.array(errors), np.array(deviations)

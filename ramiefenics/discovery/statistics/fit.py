"""Estimates of factors and amplitudes, given the effects that are present."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.stats import chi2

from ramiefenics.discovery.curves.blocks import Array, Integers
from ramiefenics.discovery.statistics.evidence import Evidence
from ramiefenics.discovery.statistics.fit_scatter import UNKNOWN
from ramiefenics.discovery.statistics.scatter import Scatter

SAMPLES = 20000
"""Number of random amplitudes drawn to find intervals within bounds."""

LEVEL = 0.95
"""Probability content of intervals."""


@dataclass(frozen=True)
class Fit:
    """A fitted set of effects.

    Attributes
    ----------
    evidence
        Evidence of the curves.
    chosen
        Names of the effects in the set.
    scatter
        Standard deviations of specimens and curves.
    """

    evidence: Evidence
    chosen: tuple[str, ...]
    scatter: Scatter

    @cached_property
    def _which(self) -> list[int]:
        return [self.evidence.names.index(name) for name in self.chosen]

    @cached_property
    def _deviations(self) -> tuple[Array, Array]:
        return self.evidence.whiten(self.scatter).deviations(self._which)

    @property
    def _factors(self) -> int:
        return self.evidence.by_own.shape[1]

    @cached_property
    def samples(self) -> Array:
        """Random amplitudes given the data, within their bounds, shape (s, chosen).

        They follow Student's distribution with one degree of freedom fewer than there are
        specimens, because the standard deviations are estimated from the specimens.
        """
        number, scale = len(self.chosen), self.evidence.scale[self._which]
        mean, covariance = (part[-number:] for part in self._deviations)
        rng = np.random.default_rng(0)
        freedom = max(len(self.evidence.whole) - 1, 2)
        root = np.linalg.cholesky(covariance[:, -number:])
        wider = np.sqrt(freedom / rng.chisquare(freedom, SAMPLES))
        drawn = mean + wider[:, None] * (rng.standard_normal((SAMPLES, number)) @ root.T)
        low, high = self.evidence.bounds[self._which].T
        inside = ((drawn >= low) & (drawn <= high)).all(axis=1)
        if inside.sum() < SAMPLES / 1000:  # the data call for amplitudes beyond the bounds
            return np.clip(mean, low, high)[None] * scale
        return np.asarray(drawn[inside] * scale)

    @property
    def amplitudes(self) -> dict[str, float]:
        """Expected amplitudes, by effect."""
        if not self.chosen:
            return {}
        return dict(zip(self.chosen, map(float, self.samples.mean(axis=0)), strict=True))

    def sd(self, name: str) -> float:
        """Return the standard deviation of an amplitude."""
        return float(self.samples[:, self.chosen.index(name)].std())

    def interval(self, name: str) -> tuple[float, float]:
        """Return the 95 % interval of an amplitude."""
        values = self.samples[:, self.chosen.index(name)]
        low, high = np.quantile(values, ((1 - LEVEL) / 2, (1 + LEVEL) / 2))
        return float(low), float(high)

    @property
    def sd_between_specimens(self) -> dict[str, float]:
        """Standard deviations of amplitudes that differ between specimens, by effect."""
        scale = dict(zip(self.evidence.names, self.evidence.scale, strict=True))
        return {name: float(sd * scale[name]) for name, sd in self.scatter.spread.items()}

    @cached_property
    def common_log_factors(self) -> Array:
        """Log factors common to all specimens, shape (k,)."""
        return self.evidence.factor_sd * self._deviations[0][: self._factors]

    @cached_property
    def log_factors(self) -> Array:
        """Log factors of every specimen, shape (n, k)."""
        return self.common_log_factors + self._own_log_factors(self._without_shared())

    @property
    def mean_log_factors(self) -> Array:
        """Mean of the log factors over the specimens that are not broken, shape (k,)."""
        return np.asarray(self.log_factors[self.evidence.whole].mean(axis=0))

    def _columns(self) -> Array:
        """Return the columns that specimens share, for unit prior deviations, shape (r, c, m)."""
        evidence = self.evidence
        parts = (evidence.factor_sd * evidence.by_common, evidence.nuisance)
        return np.concatenate([*parts, evidence.signatures[:, self._which]], axis=1)

    def _without_shared(self) -> Array:
        """Return the residual minus all that specimens share, shape (r, m)."""
        shared = np.einsum("rcm,c->rm", self._columns(), self._deviations[0])
        return np.asarray(self.evidence.residual - shared)

    def _own_log_factors(self, errors: Array) -> Array:
        """Return specimens' expected own log factors, shape (n, k), given errors, shape (r, m)."""
        squares = np.array(self.scatter.own) ** 2
        return squares * self._information(self.evidence.by_own, errors)

    def _by_own(self, log_factors: Array) -> Array:
        """Return the change of curves, (r, m), by specimens' own log factors, shape (n, k)."""
        each = log_factors[self.evidence.blocks.specimen]
        return np.asarray(np.einsum("rkm,rk->rm", self.evidence.by_own, each))

    def _by_own_amplitudes(self, errors: Array) -> Array:
        """Return the change of curves by what specimens' expected amplitudes differ, (r, m)."""
        which = [self.evidence.names.index(name) for name in self.scatter.spread]
        signatures = self.evidence.signatures[:, which]
        squares = np.array(list(self.scatter.spread.values())) ** 2
        each = (squares * self._information(signatures, errors))[self.evidence.blocks.specimen]
        return np.asarray(np.einsum("rpm,rp->rm", signatures, each))

    def _information(self, columns: Array, errors: Array) -> Array:
        """Return products of columns, (r, q, m), with errors, (r, m), by specimen, (n, q)."""
        blocks = self.evidence.blocks
        covariance = self.evidence.covariance(self.scatter)
        weights = np.linalg.solve(covariance, blocks.stack(errors[:, None]))
        return np.asarray(np.einsum("nbq,nbc->nq", blocks.stack(columns), weights))

    def remaining(self) -> tuple[Array, Array]:
        """Return the residual of the fit, and the part of it attributed to the simulator.

        Both have shape (r, m). The fit includes common factors and effects, and every specimen's
        own factors and amplitudes.
        """
        k, number = self._factors, len(self.chosen)
        expected = self._deviations[0]
        nuisance = expected[k : len(expected) - number]
        simulator = np.einsum("rqm,q->rm", self.evidence.nuisance, nuisance)
        errors = self._without_shared()
        own = self._by_own(self._own_log_factors(errors)) + self._by_own_amplitudes(errors)
        return errors - own + simulator, simulator

    @cached_property
    def _simulation(self) -> Fit:
        """The fit for plain predictions: a simulation does not correct its own errors."""
        return dataclasses.replace(self, evidence=self.evidence.of_simulation())

    def left_out(self) -> Array:
        """Return the residual of each curve for a fit to all other specimens, shape (r, m)."""
        fit = self._simulation
        expected = fit.evidence.whiten(fit.scatter).left_out(fit._which)
        each = expected[fit.evidence.blocks.specimen]
        return fit.evidence.residual - np.einsum("rcm,rc->rm", fit._columns(), each)

    def left_out_shape(self) -> Array:
        """Return the same with each specimen's own factors fitted to its own curves."""
        errors = self.left_out()
        return errors - self._by_own(self._own_log_factors(errors))

    def left_out_condition(self, condition: Integers) -> Array:
        """Return the residual of each curve for a fit under all other conditions, shape (r, m).

        Parameters
        ----------
        condition
            Condition of each curve, shape (r,).
        """
        fit, left = self._simulation, np.empty_like(self.evidence.residual)
        for one in np.unique(condition):
            out = condition == one
            others = dataclasses.replace(fit, evidence=fit.evidence.blind_to(out))
            own = others._own_log_factors(others._without_shared())
            shared = np.einsum("rcm,c->rm", fit._columns(), others._deviations[0])
            left[out] = (fit.evidence.residual - shared - fit._by_own(own))[out]
        return left

    def conflict(self) -> float:
        """Return the probability of common log factors at least as far from their prior as these.

        They are estimated as if nothing were known of them; their squared distance from the prior
        has a chi-square distribution (Evans and Moshonov 2006, section 4).
        """
        blind = dataclasses.replace(self.evidence, factor_sd=10.0 * UNKNOWN)
        mean, covariance = blind.whiten(self.scatter).deviations(self._which)
        k = self._factors
        found = blind.factor_sd * mean[:k]
        spread = blind.factor_sd**2 * covariance[:k, :k] + self.evidence.factor_sd**2 * np.eye(k)
        return float(chi2.sf(found @ np.linalg.solve(spread, found), k))

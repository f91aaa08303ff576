"""Probability of measured curves under a model: one Gaussian for all curves of all specimens.

The residuals of the linearised model without factors and effects, relative to the peak force of
each curve, are

    r = sum_j (a_j + s_js) g_j + J d + K b_s + D c + w + e

Here g_j is the signature of effect j, a_j its amplitude, and s_js the deviation of specimen s from
that amplitude; d contains the common log factors and b_s the deviations of specimen s; J and K are
the derivatives with respect to them; D contains the errors that the simulator may make in all
curves alike (`nuisance`); w is a smooth error of the single curve, and e its noise. Standard
deviations are those of `Scatter`, except for that of d, which is given, and that of a_j, which is
proportional to the effect's typical amplitude (`PRIOR`), within its bounds. All are Gaussian (a
linear mixed model: Laird and Ware 1982). What specimens share makes their curves correlated, so
that the number of specimens counts, not that of points. A specimen that is taken for broken says
nothing of all this: its curves are a smooth error and a slip, both of the order of the forces, and
noise.

Noise differs between curves: that of each is proportional to the roughness of its residual, as far
as so few points can tell.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ramiefenics.discovery.curves.blocks import Array, Blocks
from ramiefenics.discovery.statistics.scatter import LENGTH, Scatter
from ramiefenics.discovery.statistics.whitened import Whitened
from ramiefenics.effects import Effect

MODEL_ERROR = 0.003
"""Standard deviation of each smooth error that the simulator makes in all curves alike, relative to
the peak force, apart from the error of its mesh."""

WHITE = 0.05
"""Standard deviation of the uncorrelated part of the noise, relative to that of the noise."""

DRIFT_LENGTH = 0.2
"""Correlation length of a curve's own smooth error, as a share of the range."""

BROKEN = 0.2
"""Standard deviation of the smooth error, and of the slip, of a broken specimen, relative to the
peak force."""

PRIOR = 1.5
"""Prior standard deviation of an amplitude, relative to the typical amplitude."""

ROUGHNESS_WEIGHT = 10.0
"""Weight, in points, of the roughness common to all curves in the estimate of that of each."""


@dataclass(frozen=True)
class Suspect:
    """An effect and its signature.

    Attributes
    ----------
    effect
        The effect.
    signature
        Change of every curve relative to its peak force, per unit of the amplitude, shape (r, m).
    """

    effect: Effect
    signature: Array


@dataclass(frozen=True)
class Evidence:
    """Likelihood of residuals, all relative to the peak force of each curve.

    Attributes
    ----------
    residual
        Measured forces minus those predicted without factors and effects, shape (r, m).
    by_common
        Derivatives J with respect to the common log factors, shape (r, k, m).
    by_own
        Derivatives K with respect to a specimen's own log factors, shape (r, k, m).
    nuisance
        Errors D of the simulator, for unit prior deviations, shape (r, q, m).
    factor_sd
        Prior standard deviation of a common log factor: how well the moduli are known.
    blocks
        Which curves belong to the same specimen.
    suspects
        Effects that may be present, by name.
    broken
        Indices of the specimens that are taken for broken.
    learned
        Number of the last columns of `nuisance` that belong to a function learned inside the model
        rather than to errors of the simulator.
    """

    residual: Array
    by_common: Array
    by_own: Array
    nuisance: Array
    factor_sd: float
    blocks: Blocks
    suspects: Mapping[str, Suspect] = dataclasses.field(default_factory=dict)
    broken: frozenset[int] = frozenset()
    learned: int = 0

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Names of the suspects, in order."""
        return tuple(self.suspects)

    @cached_property
    def scale(self) -> Array:
        """Prior standard deviations of the suspects' amplitudes, shape (p,)."""
        return PRIOR * np.array([abs(s.effect.typical) for s in self.suspects.values()])

    @cached_property
    def bounds(self) -> Array:
        """Least and largest amplitudes relative to `scale`, shape (p, 2)."""
        limits = np.array([s.effect.bounds for s in self.suspects.values()]).reshape(-1, 2)
        return limits / self.scale[:, None]

    @cached_property
    def signatures(self) -> Array:
        """Signatures of the suspects, for amplitudes of `scale`, shape (r, p, m)."""
        found = [s.signature for s in self.suspects.values()]
        stacked = np.array(found).reshape(-1, *self.residual.shape).transpose(1, 0, 2)
        return stacked * self.scale[:, None]

    @cached_property
    def _own_noise(self) -> Array:
        """Noise of every curve by itself, relative to its peak force, shape (r,).

        Second differences show noise and little else; their median, which is insensitive to a step
        or a kink, is about the standard deviation of noise of the typical length.
        """
        return np.asarray(np.median(np.abs(np.diff(self.residual, 2, axis=1)), axis=1) + 1e-8)

    @cached_property
    def roughness(self) -> Array:
        """Noise of every curve relative to what is typical of all, shape (r,).

        That of few points is uncertain, so its logarithm is shrunk towards the typical one.
        """
        rough = np.log(self._own_noise)
        number = self.residual.shape[1]
        share = number / (number + ROUGHNESS_WEIGHT)
        return np.asarray(np.exp(share * (rough - np.median(rough[self._counts]))))

    @property
    def whole(self) -> list[int]:
        """Indices of the specimens that are not taken for broken."""
        return [s for s in range(self.blocks.number) if s not in self.broken]

    @cached_property
    def distance(self) -> Array:
        """Distances between points, as shares of the range, shape (m, m)."""
        where = np.arange(self.blocks.points) / self.blocks.points
        return np.abs(where[:, None] - where)

    def but_without(self, specimen: int) -> Evidence:
        """Return the evidence without that of a specimen, which is taken for broken."""
        return dataclasses.replace(self, broken=self.broken | {specimen})

    def blind_to(self, curves: NDArray[np.bool_]) -> Evidence:
        """Return the evidence in which certain curves, shape (r,), carry no information."""
        told = np.where(curves, 0.0, 1.0)[:, None]
        suspects = {
            name: dataclasses.replace(suspect, signature=told * suspect.signature)
            for name, suspect in self.suspects.items()
        }
        return dataclasses.replace(
            self,
            by_common=told[..., None] * self.by_common,
            by_own=told[..., None] * self.by_own,
            nuisance=told[..., None] * self.nuisance,
            suspects=suspects,
        )

    def with_nuisance(self, columns: Array) -> Evidence:
        """Return the evidence with further columns of nuisance, shape (r, q, m)."""
        together = np.concatenate([self.nuisance, columns], axis=1)
        return dataclasses.replace(self, nuisance=together)

    def of_simulation(self) -> Evidence:
        """Return the evidence in which the simulator makes no errors."""
        errors = self.nuisance.shape[1] - self.learned
        return dataclasses.replace(self, nuisance=self.nuisance[:, errors:])

    def covariance(self, scatter: Scatter) -> Array:
        """Return the covariance of what specimens do not share, shape (n, b, b)."""
        noise, drift = self._noise(scatter.length), scatter.drift**2 * self._drift
        kernels = scatter.noise**2 * noise + drift
        wrong = ~self._counts
        kernels[wrong] = BROKEN**2 * (self._drift + self._slip)
        kernels[wrong] += self._own_noise[wrong, None, None] ** 2 * self._kernel(LENGTH[0])
        whole = self.blocks.covariance(kernels, elsewhere=1.0)
        own = self._varying(scatter)
        whole += own @ own.transpose(0, 2, 1)
        return whole

    def slopes(self, by_covariance: Array, scatter: Scatter) -> Array:
        """Return derivatives with respect to `Scatter.logarithms`, shape (number of logarithms,).

        Parameters
        ----------
        by_covariance
            Derivatives with respect to the entries of `covariance`, shape (n, b, b).
        scatter
            Standard deviations.
        """
        own = self._varying(scatter)
        columns = 2.0 * (own * (by_covariance @ own)).sum(axis=(0, 1))
        by_curve = self.blocks.kernels(by_covariance) * self._counts[:, None, None]
        rough = scatter.noise**2 * np.tensordot(self.roughness**2, by_curve, axes=1)
        longer = np.exp(-self.distance / scatter.length) * self.distance / scatter.length
        stationary = [
            2.0 * (rough * self._kernel(scatter.length)).sum(),
            (rough * longer).sum(),
            2.0 * scatter.drift**2 * (by_curve.sum(axis=0) * self._drift).sum(),
        ]
        factors = len(scatter.own)
        return np.concatenate([columns[:factors], stationary, columns[factors:]])

    def _varying(self, scatter: Scatter) -> Array:
        """Return the changes by one sd of specimens' own factors and amplitudes, (n, b, c)."""
        own = self._own * np.array(scatter.own)
        if not scatter.spread:
            return own
        which = [self.names.index(name) for name in scatter.spread]
        spread = self._effects[:, :, which] * np.array(list(scatter.spread.values()))
        return np.concatenate([own, spread], axis=2)

    def _noise(self, length: float) -> Array:
        """Return the covariance of curves' noise relative to its typical variance, (r, m, m)."""
        return np.asarray(self.roughness[:, None, None] ** 2 * self._kernel(length))

    def _kernel(self, length: float) -> Array:
        """Return the covariance of the noise of a typical curve, relative to its variance."""
        return np.exp(-self.distance / length) + WHITE**2 * np.eye(self.blocks.points)

    @cached_property
    def _drift(self) -> Array:
        return np.exp(-0.5 * (self.distance / DRIFT_LENGTH) ** 2)

    @cached_property
    def _slip(self) -> Array:
        """Return the covariance of a step of unit variance at any displacement, shape (m, m)."""
        places = np.arange(1, self.blocks.points + 1) / self.blocks.points
        return np.minimum(places[:, None], places)

    @cached_property
    def _own(self) -> Array:
        return self._stacked(self.by_own)

    @cached_property
    def _common(self) -> Array:
        return self._stacked(self.by_common)

    @cached_property
    def _effects(self) -> Array:
        return self._stacked(self.signatures)

    @cached_property
    def _nuisance(self) -> Array:
        return self._stacked(self.nuisance)

    @cached_property
    def _counts(self) -> NDArray[np.bool_]:
        """Whether curves are those of specimens that are not taken for broken, shape (r,)."""
        return np.isin(self.blocks.specimen, self.whole)

    def _stacked(self, columns: Array) -> Array:
        """Return columns, (r, q, m), by specimen, (n, b, q); broken specimens have zeros."""
        return self.blocks.stack(self._counts[:, None, None] * columns)

    @cached_property
    def data(self) -> Array:
        """The residual by specimen, shape (n, b, 1)."""
        return self.blocks.stack(self.residual[:, None])

    def shared_columns(self, chosen: Sequence[int]) -> Array:
        """Return the columns that specimens share, for unit prior deviations, shape (n, b, c).

        They are those of the factors, the nuisance, and the chosen effects, counted from 0.
        """
        parts = (self.factor_sd * self._common, self._nuisance, self._effects[..., list(chosen)])
        return np.concatenate(parts, axis=2)

    def whiten(self, scatter: Scatter, data: Array | None = None) -> Whitened:
        """Return all columns in a basis in which the errors that specimens do not share are white.

        Parameters
        ----------
        scatter
            Standard deviations.
        data
            Residuals in place of the measured ones, shape (n, b, B), see `Blocks`.
        """
        root = np.linalg.cholesky(self.covariance(scatter))
        shared = self.shared_columns(range(len(self.names)))
        given = self.data if data is None else data
        white = np.linalg.solve(root, np.concatenate([shared, given], axis=2))
        number = self._own.shape[2] + self._nuisance.shape[2]
        volume = float(np.log(np.diagonal(root, axis1=1, axis2=2)).sum())
        return Whitened(white, number, len(self.names), volume)

    def draw(self, scatter: Scatter, number: int, rng: np.random.Generator) -> Array:
        """Return random residuals without the effects' mean amplitudes, shape (n, b, number)."""
        root = np.linalg.cholesky(self.covariance(scatter))
        own = root @ rng.standard_normal((*self.data.shape[:2], number))
        columns = self.shared_columns([])
        drawn = own + columns @ rng.standard_normal((columns.shape[2], number))
        everywhere = self.blocks.stack(np.ones_like(self.residual[:, None]))
        return np.asarray(drawn * everywhere)

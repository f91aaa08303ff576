"""How probable measured curves are under a model: one Gaussian for all curves of all specimens.

Residuals of the linearised model without factors and effects, over each curve's peak force, are

    r = sum_j (a_j + s_js) g_j + J (d + b_s) + D c + w + e

with g_j the signature of effect j, a_j its amplitude and s_js what that differs by in specimen s; J
the derivatives by the log factors, d their common values, b_s the specimen's own; D what the
simulator may be wrong by, the same way in all curves (`nuisance`); w what is smooth and a curve's
own; e its noise. Standard deviations are those of `Scatter`; d's is given; that of a_j is in
proportion to the effect's typical amplitude (`PRIOR`), within its bounds. All are Gaussian (a
linear mixed model: Laird and Ware 1982). What specimens share binds them together: it is their
number, not that of points, that counts. A specimen that is taken for broken has one more error, as
large as curves are.

Noise differs between curves: that of each is in proportion to how rough its residual is, as far as
so few points can tell.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ramiefenics.discovery.blocks import Array, Blocks
from ramiefenics.discovery.scatter import Scatter
from ramiefenics.effects import Effect

MODEL_ERROR = 0.003
"""What the simulator may be wrong by, smoothly and the same way in all curves, over the peak force,
apart from what its mesh makes."""

WHITE = 0.05
"""Part of the noise, over its sd, that is not correlated at all."""

DRIFT_LENGTH = 0.2
"""Over which a curve's own smooth error is correlated, as a share of the range."""

BROKEN = 0.2
"""Standard deviation, over the peak force, of the smooth error of a broken specimen."""

PRIOR = 1.5
"""Standard deviation of an amplitude beforehand, over the typical one."""

ROUGHNESS_WEIGHT = 10.0
"""Points of which the curves' common roughness is worth, where a curve tells its own."""


@dataclass(frozen=True)
class Suspect:
    """An effect, and what it changes.

    Attributes
    ----------
    effect
        Which.
    signature
        Change of every curve over its peak, per unit of the amplitude, shape (r, m).
    """

    effect: Effect
    signature: Array


@dataclass(frozen=True)
class Evidence:
    """Likelihood of residuals; everything over each curve's peak force.

    Attributes
    ----------
    residual
        Measured minus predicted without factors and effects, shape (r, m).
    by_factors
        J, shape (r, k, m).
    nuisance
        D for deviations of unit prior, shape (r, q, m).
    factor_sd
        Prior of a common log factor: how well the moduli are known.
    blocks
        Which curves are of the same specimen.
    suspects
        Effects that there may be, by name.
    broken
        Specimens that are taken for broken.
    learned
        How many of the last columns of `nuisance` are no errors of the simulator, but a function
        that is learned inside the model.
    """

    residual: Array
    by_factors: Array
    nuisance: Array
    factor_sd: float
    blocks: Blocks
    suspects: Mapping[str, Suspect] = dataclasses.field(default_factory=dict)
    broken: frozenset[int] = frozenset()
    learned: int = 0

    @cached_property
    def names(self) -> tuple[str, ...]:
        """The suspects', in order."""
        return tuple(self.suspects)

    @cached_property
    def scale(self) -> Array:
        """Standard deviations of their amplitudes beforehand, shape (p,)."""
        return PRIOR * np.array([abs(s.effect.typical) for s in self.suspects.values()])

    @cached_property
    def bounds(self) -> Array:
        """Least and largest amplitudes over `scale`, shape (p, 2)."""
        limits = np.array([s.effect.bounds for s in self.suspects.values()]).reshape(-1, 2)
        return limits / self.scale[:, None]

    @cached_property
    def signatures(self) -> Array:
        """Of the suspects, for amplitudes of `scale`, shape (r, p, m)."""
        found = [s.signature for s in self.suspects.values()]
        stacked = np.array(found).reshape(-1, *self.residual.shape).transpose(1, 0, 2)
        return stacked * self.scale[:, None]

    @cached_property
    def roughness(self) -> Array:
        """Noise of every curve over what is typical of all, shape (r,).

        Second differences show noise and little else; their median leaves out a step or a kink.
        Those of few points are uncertain, so that their logarithm is drawn to the typical one.
        """
        rough = np.log(np.median(np.abs(np.diff(self.residual, 2, axis=1)), axis=1) + 1e-8)
        number = self.residual.shape[1]
        share = number / (number + ROUGHNESS_WEIGHT)
        return np.asarray(np.exp(share * (rough - np.median(rough))))

    @property
    def whole(self) -> list[int]:
        """Specimens that are not taken for broken."""
        return [s for s in range(self.blocks.number) if s not in self.broken]

    @cached_property
    def distance(self) -> Array:
        """Of points over the range, shape (m, m)."""
        where = np.arange(self.blocks.points) / self.blocks.points
        return np.abs(where[:, None] - where)

    def but_without(self, specimen: int) -> Evidence:
        """Return the evidence without what a specimen says: it is taken for broken."""
        return dataclasses.replace(self, broken=self.broken | {specimen})

    def blind_to(self, curves: NDArray[np.bool_]) -> Evidence:
        """Return the evidence in which certain curves, shape (r,), tell nothing of anything."""
        told = np.where(curves, 0.0, 1.0)[:, None]
        suspects = {
            name: dataclasses.replace(suspect, signature=told * suspect.signature)
            for name, suspect in self.suspects.items()
        }
        return dataclasses.replace(
            self,
            by_factors=told[..., None] * self.by_factors,
            nuisance=told[..., None] * self.nuisance,
            suspects=suspects,
        )

    def with_nuisance(self, columns: Array) -> Evidence:
        """Return the evidence with more nuisance, shape (r, q, m)."""
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
        if self.broken:
            wrong = np.isin(self.blocks.specimen, list(self.broken))
            kernels[wrong] += BROKEN**2 * self._drift
        whole = self.blocks.covariance(kernels, elsewhere=1.0)
        own = self._varying(scatter)
        whole += own @ own.transpose(0, 2, 1)
        return whole

    def covariance_slopes(self, scatter: Scatter) -> Array:
        """Return its derivatives by `Scatter.logarithms`, shape (number of these, n, b, b)."""
        own = self._varying(scatter).transpose(2, 0, 1)
        columns = 2.0 * own[..., None] * own[:, :, None, :]
        squares = (scatter.noise * self.roughness[:, None, None]) ** 2
        longer = np.exp(-self.distance / scatter.length) * self.distance / scatter.length
        drift = np.broadcast_to(2.0 * scatter.drift**2 * self._drift, (len(squares), *longer.shape))
        kernels = (2.0 * scatter.noise**2 * self._noise(scatter.length), squares * longer, drift)
        stationary = [self.blocks.covariance(kernel, elsewhere=0.0) for kernel in kernels]
        factors = len(scatter.own)
        return np.concatenate([columns[:factors], stationary, columns[factors:]])

    def _varying(self, scatter: Scatter) -> Array:
        """Return what a specimen's own factors and amplitudes make, for one sd, (n, b, c)."""
        own = self._own * np.array(scatter.own)
        if not scatter.spread:
            return own
        which = [self.names.index(name) for name in scatter.spread]
        spread = self._effects[:, :, which] * np.array(list(scatter.spread.values()))
        return np.concatenate([own, spread], axis=2)

    def _noise(self, length: float) -> Array:
        """Return the covariance of the curves' noise over its typical variance, (r, m, m)."""
        kernel = np.exp(-self.distance / length) + WHITE**2 * np.eye(self.blocks.points)
        return np.asarray(self.roughness[:, None, None] ** 2 * kernel)

    @cached_property
    def _drift(self) -> Array:
        return np.exp(-0.5 * (self.distance / DRIFT_LENGTH) ** 2)

    @cached_property
    def _own(self) -> Array:
        return self.blocks.stack(self.by_factors)

    @cached_property
    def _effects(self) -> Array:
        return self.blocks.stack(self.signatures)

    @cached_property
    def _nuisance(self) -> Array:
        return self.blocks.stack(self.nuisance)

    @cached_property
    def data(self) -> Array:
        """The residual by specimen, shape (n, b, 1)."""
        return self.blocks.stack(self.residual[:, None])

    def shared_columns(self, chosen: Sequence[int]) -> Array:
        """Return what specimens share, for deviations of unit prior, shape (n, b, c).

        Factors, nuisance, and chosen effects, counted from 0.
        """
        parts = (self.factor_sd * self._own, self._nuisance, self._effects[..., list(chosen)])
        return np.concatenate(parts, axis=2)

    def whiten(self, scatter: Scatter, data: Array | None = None) -> Whitened:
        """Return all columns in a basis where what specimens do not share is white.

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
        """Return random residuals without the effects' means, shape (n, b, number)."""
        root = np.linalg.cholesky(self.covariance(scatter))
        own = root @ rng.standard_normal((*self.data.shape[:2], number))
        columns = self.shared_columns([])
        drawn = own + columns @ rng.standard_normal((columns.shape[2], number))
        everywhere = self.blocks.stack(np.ones_like(self.residual[:, None]))
        return np.asarray(drawn * everywhere)


@dataclass(frozen=True)
class Whitened:
    """Columns whose errors are white.

    Attributes
    ----------
    columns
        What specimens share, for deviations of unit prior: factors, nuisance, effects; then data.
        Shape (n, b, c).
    shared, effects
        Numbers of columns of factors and nuisance, and of effects.
    half_log_determinant
        Of the covariance of what specimens do not share.
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
        """Return mean and covariance of factors, nuisance and chosen effects, given the data.

        Parameters
        ----------
        chosen
            Effects, counted from 0.
        """
        columns = self._chosen(chosen)
        gram = np.einsum("nbi,nbj->ij", columns, columns)
        onto = np.einsum("nbi,nb->i", columns, self.columns[..., -1])
        covariance = np.linalg.inv(np.eye(len(gram)) + gram)
        return covariance @ onto, covariance

    def left_out(self, chosen: Sequence[int]) -> Array:
        """Return the mean of the same given all specimens but one, shape (n, c)."""
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
    """What the data say of the effects' amplitudes, over `Evidence.scale`.

    Attributes
    ----------
    gram
        Precision of the amplitudes by the data alone, shape (p, p).
    onto
        Products of the signatures with the data, shape (p, B).
    log_evidence
        Of the data without effects, shape (B,).
    """

    gram: Array
    onto: Array
    log_evidence: Array

    def amplitudes(self, chosen: Sequence[int], prior: float = 1.0) -> tuple[Array, Array]:
        """Return mean and covariance of chosen amplitudes, of given prior precision."""
        which = list(chosen)
        covariance = np.linalg.inv(prior * np.eye(len(which)) + self.gram[np.ix_(which, which)])
        return covariance @ self.onto[which, 0], covariance

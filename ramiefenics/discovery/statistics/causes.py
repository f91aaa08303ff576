"""Posterior over sets of effects: which of them are present.

A priori, it is as likely as not that there is no effect; one effect is more probable than two, two
than three (`NUMBER`), and all sets of the same size are equally probable. The evidence of a set has
its amplitudes integrated out (`Evidence.scale`), within their bounds. All sets are compared at the
same linearisation.
"""

from __future__ import annotations

import dataclasses
import itertools
import math
from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.special import logsumexp, ndtr

from ramiefenics.discovery.curves.blocks import Array
from ramiefenics.discovery.statistics.evidence import Evidence
from ramiefenics.discovery.statistics.fit_scatter import fit_scatter
from ramiefenics.discovery.statistics.scatter import Scatter
from ramiefenics.discovery.statistics.whitened import Reduced

NUMBER = (0.5, 0.3, 0.15, 0.05)
"""Prior probabilities of no effect, of one, two and three effects."""

SURE = 0.95
"""Probability above which something counts as practically certain."""

NEGLIGIBLE = 0.05
"""Probability up to which an effect, or a set of effects, is not worth mentioning."""

ROUNDS = 4
"""Maximum number of estimates of the standard deviations of the best set."""

DRAWS = 400
"""Number of random errors over which probabilities are averaged."""

SMALLEST = 1e-300

Set = tuple[int, ...]
"""Indices of effects, counted from 0, in ascending order."""


@dataclass(frozen=True)
class Causes:
    """The posterior over sets of effects.

    Attributes
    ----------
    names
        Names of the suspects.
    sets
        All possible sets, the empty one first.
    log_evidence
        Log-evidence of each set, at the standard deviations that maximise it, shape (s,).
    scatter
        The most probable standard deviations of the best set.
    nothing
        The most probable standard deviations without effects.
    """

    names: tuple[str, ...]
    sets: tuple[Set, ...]
    log_evidence: Array
    scatter: Scatter
    nothing: Scatter

    @cached_property
    def probability(self) -> Array:
        """Posterior probability of each set, shape (s,)."""
        shares = np.exp(self._scores - self._scores.max())
        return np.asarray(shares / shares.sum())

    @property
    def best(self) -> tuple[str, ...]:
        """The most probable set."""
        return tuple(self.names[index] for index in self.sets[int(self.probability.argmax())])

    @property
    def none(self) -> float:
        """Probability that there is no effect."""
        return float(self.probability[0])

    def inclusion(self) -> dict[str, float]:
        """Return the posterior probability that each effect is present."""
        return {name: self.any_of([name]) for name in self.names}

    def any_of(self, names: Iterable[str]) -> float:
        """Return the posterior probability that at least one of some effects is present."""
        wanted = {self.names.index(name) for name in names}
        there = np.array([not wanted.isdisjoint(chosen) for chosen in self.sets])
        return float(self.probability[there].sum())

    def gain(self, names: Sequence[str]) -> float:
        """Return the log-evidence of a set minus that without effects.

        That of a set that is not compared, because it cannot be simulated, is minus infinity.
        """
        if self._indices(names) not in self.sets:
            return -math.inf
        return float(self.log_evidence[self.row(names)] - self.log_evidence[0])

    def score(self, names: Sequence[str]) -> float:
        """Return the log-evidence plus the log-prior of a set, up to a constant."""
        return float(self._scores[self.row(names)])

    def scored(self) -> Iterator[tuple[Set, float]]:
        """Yield all sets with their scores."""
        return zip(self.sets, map(float, self._scores), strict=True)

    def row(self, names: Sequence[str]) -> int:
        """Return the index of a set in `sets`."""
        return self.sets.index(self._indices(names))

    def _indices(self, names: Sequence[str]) -> Set:
        return tuple(sorted(self.names.index(name) for name in names))

    def averaged(self, log_evidence: Array, error: float) -> Causes:
        """Return the posterior for evidence that is not known exactly.

        Probabilities are averages over random errors.

        Parameters
        ----------
        log_evidence
            Log-evidence of each set according to several sources, of which the largest counts, and
            which err independently, shape (k, s).
        error
            Standard deviation of the error of each source.
        """
        log_prior = log_priors(self.sets, len(self.names))
        total = np.full(len(self.sets), -np.inf)
        for errors in np.random.default_rng(0).normal(0.0, error, (DRAWS, len(log_evidence))):
            scores = (log_evidence + errors[:, None]).max(axis=0) + log_prior
            total = np.logaddexp(total, scores - logsumexp(scores))
        return dataclasses.replace(self, log_evidence=total - log_prior)

    def certain(self) -> tuple[str, ...]:
        """Return the effects, at most three, that are practically certain to be present."""
        inclusion = self.inclusion()
        sure = [name for name in self.names if inclusion[name] > SURE]
        return tuple(sure[: len(NUMBER) - 1])

    @cached_property
    def _scores(self) -> Array:
        return self.log_evidence + log_priors(self.sets, len(self.names))

    def probable(self) -> dict[tuple[str, ...], float]:
        """Return the sets worth mentioning with their probabilities, the most probable first."""
        order = np.argsort(-self.probability, kind="stable")
        worth = [int(row) for row in order if self.probability[row] > NEGLIGIBLE]
        sets = [tuple(self.names[index] for index in self.sets[row]) for row in worth]
        return dict(zip(sets, map(float, self.probability[worth]), strict=True))

    def groups(self) -> list[tuple[str, ...]]:
        """Return groups of effects, of each of which at least one is practically certain.

        They are for data that have been shown to contain some effect: probabilities are those given
        that there is one. The most probable group comes first. A group of one is a cause; which
        effects of a larger group are present cannot be told. If there is no such group, all effects
        worth mentioning form one.
        """
        given = max(1.0 - self.none, SMALLEST)
        inclusion = {name: share / given for name, share in self.inclusion().items()}
        left = [name for name in inclusion if inclusion[name] > NEGLIGIBLE]
        groups = []
        while left:
            group = [max(left, key=lambda name: inclusion[name])]
            while self.any_of(group) < SURE * given and len(group) < len(left):
                others = [name for name in left if name not in group]
                group.append(max(others, key=lambda name: self.any_of([*group, name])))
            if self.any_of(group) < SURE * given:
                break
            groups.append(tuple(group))
            left = [name for name in left if name not in group]
        if not groups and left:
            groups.append(tuple(sorted(left, key=lambda name: -inclusion[name])))
        return groups


def find_causes(evidence: Evidence, impossible: Collection[tuple[str, ...]] = ()) -> Causes:
    """Compare all sets of effects.

    Standard deviations are estimated without effects; with each single effect, because differences
    between specimens that an effect causes would otherwise be taken for scatter; and for the best
    set until it stays the same. Every set is evaluated at those of these standard deviations at
    which it is most probable. The amplitude of an effect differs between specimens only in sets
    that contain the effect.

    Parameters
    ----------
    evidence
        Evidence of the curves.
    impossible
        Sets that are left out.
    """
    out = {tuple(sorted(map(evidence.names.index, names))) for names in impossible}
    sets = tuple(chosen for chosen in all_sets(len(evidence.names)) if chosen not in out)
    nothing = fit_scatter(evidence)
    tried = [nothing, *(fit_scatter(evidence, [name], nothing) for name in evidence.names)]
    values = np.array([_log_evidence(evidence, scatter, sets) for scatter in tried])
    best: tuple[str, ...] = ()
    for _ in range(ROUNDS):
        found = Causes(evidence.names, sets, values.max(axis=0), nothing, nothing)
        if found.best == best:
            break
        best = found.best
        tried.append(fit_scatter(evidence, best, nothing))
        values = np.vstack([values, _log_evidence(evidence, tried[-1], sets)])
    chosen = int(found.probability.argmax())
    scatter = tried[int(values[:, chosen].argmax())]
    return Causes(evidence.names, sets, values.max(axis=0), scatter, nothing)


def own_score(evidence: Evidence, names: Sequence[str], scatter: Scatter) -> float:
    """Return the log-evidence plus the log-prior of one set, up to a constant."""
    chosen = tuple(sorted(evidence.names.index(name) for name in names))
    prior = log_priors([chosen], len(evidence.names))
    return float((_log_evidence(evidence, scatter, [chosen]) + prior)[0])


def all_sets(number: int) -> tuple[Set, ...]:
    """Return all sets of at most three effects, the empty one first."""
    sizes = range(min(len(NUMBER) - 1, number) + 1)
    return tuple(chosen for k in sizes for chosen in itertools.combinations(range(number), k))


def log_priors(sets: Sequence[Set], number: int) -> Array:
    """Return the logarithms of the sets' prior probabilities, up to a constant."""
    each = [math.log(share / math.comb(number, k)) for k, share in enumerate(NUMBER) if k <= number]
    return np.array([each[len(chosen)] for chosen in sets])


def _log_evidence(evidence: Evidence, scatter: Scatter, sets: Sequence[Set]) -> Array:
    """Return the log-evidence of sets plus the log-prior of the scatter, shape (s,)."""
    reduced = evidence.whiten(scatter).reduce()
    gains = log_evidence_gains(reduced, evidence.bounds, sets)[:, 0]
    needed = {evidence.names.index(name) for name in scatter.spread}
    impossible = np.array([not needed.issubset(chosen) for chosen in sets])
    gains[impossible] = -np.inf
    return np.asarray(gains + reduced.log_evidence[0] + scatter.log_prior())


def log_evidence_gains(reduced: Reduced, bounds: Array, sets: Sequence[Set]) -> Array:
    """Return the gain of each set in log-evidence over no effect, shape (s, B).

    Bounds are taken into account through the marginal distributions of the amplitudes, by the prior
    and posterior probabilities of lying within them.
    """
    gains = np.zeros((len(sets), reduced.onto.shape[1]))
    by_size: dict[int, list[int]] = {}
    for row, chosen in enumerate(sets):
        by_size.setdefault(len(chosen), []).append(row)
    for size, rows in by_size.items():
        if size == 0:
            continue
        which = np.array([sets[row] for row in rows])
        precision = np.eye(size) + reduced.gram[which[:, :, None], which[:, None, :]]
        covariance = np.linalg.inv(precision)
        onto = reduced.onto[which]
        mean = covariance @ onto
        fits = 0.5 * ((onto * mean).sum(axis=1) + np.linalg.slogdet(covariance)[1][:, None])
        sd = np.sqrt(np.diagonal(covariance, axis1=1, axis2=2))[..., None]
        low, high = (bounds[which, side][..., None] for side in (0, 1))
        inside = ndtr((high - mean) / sd) - ndtr((low - mean) / sd)
        before = ndtr(high) - ndtr(low)
        gains[rows] = fits + np.log(np.maximum(inside, SMALLEST) / before).sum(axis=1)
    return gains

"""Effects that may go unnoticed: how large every suspect may be, and what imitates it."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq
from scipy.special import ndtr
from scipy.stats import truncnorm

from ramiefenics.discovery.curves.blocks import Array
from ramiefenics.discovery.statistics.causes import Causes
from ramiefenics.discovery.statistics.fit import Fit

FLAT = 1e-2
"""Prior precision of the amplitude, relative to that by `Evidence.scale`: next to nothing is known
of it."""

SIGNATURE_ERROR = 0.05
"""Relative error of a signature, because it differs at other amplitudes and on other meshes, and
may be learned."""

WAVES = 3
"""Number of cosines that make up such an error."""

QUANTILE = 1.96
"""Quantile of the normal distribution for intervals of 95 %."""

IMITATES = 0.3
"""Correlation above which something is said to imitate an effect."""

RARE = 1e-3
"""Probability relative to the most probable set up to which a set is left out of a mixture."""

SIMULATOR = "mesh and simulator"


@dataclass(frozen=True)
class Limit:
    """How large an effect may be.

    Attributes
    ----------
    low, high
        Ends of the range of amplitudes that the data do not exclude, 95 %.
    share
        Largest change of the curves by one of these amplitudes, as a root mean square over the
        curves, relative to the peak force.
    imitated_by
        Names of factors, of other effects, or of mesh and simulator that can take its place, the
        most important first.
    """

    low: float
    high: float
    share: float
    imitated_by: tuple[str, ...]


def limits(fits: Sequence[Fit], causes: Causes, factors: Sequence[str]) -> dict[str, Limit]:
    """Return how large each suspect may be, if it is present.

    Parameters
    ----------
    fits
        Fits of all sets of effects that are probable, the best one first. What follows from the
        derivatives where one of them fits is not excluded.
    causes
        Posterior over sets of effects.
    factors
        Names of the fitted factors.
    """
    found = {}
    for name in fits[0].evidence.names:
        sets = _sets_with(name, causes) or {tuple({*fits[0].chosen, name}): 1.0}
        each = [_range(fit, name, sets) for fit in fits]
        low, high = min(low for low, _ in each), max(high for _, high in each)
        change = np.sqrt((fits[0].evidence.suspects[name].signature ** 2).mean(axis=0)).max()
        share = float(max(abs(low), abs(high)) * change)
        found[name] = Limit(low, high, share, _imitators(fits[0], name, [*factors]))
    return found


def _sets_with(name: str, causes: Causes) -> dict[tuple[str, ...], float]:
    """Return the sets that contain an effect, with their probabilities if it is present."""
    index = causes.names.index(name)
    with_it = {
        tuple(causes.names[i] for i in chosen): float(probability)
        for chosen, probability in zip(causes.sets, causes.probability, strict=True)
        if index in chosen and probability > 0.0
    }
    most = max(with_it.values(), default=0.0)
    likely = {names: p for names, p in with_it.items() if p > RARE * most}
    whole = sum(likely.values())
    return {names: p / whole for names, p in likely.items()}


def _range(fit: Fit, name: str, sets: Mapping[tuple[str, ...], float]) -> tuple[float, float]:
    """Return the range of an effect's amplitude over sets that contain it."""
    evidence = fit.evidence
    reduced, index = evidence.whiten(fit.scatter).reduce(), evidence.names.index(name)
    means, variances = np.empty(len(sets)), np.empty(len(sets))
    for row, names in enumerate(sets):
        which = [index, *(evidence.names.index(other) for other in names if other != name)]
        mean, covariance = reduced.amplitudes(which, np.array([FLAT] + [1.0] * (len(which) - 1)))
        means[row], variances[row] = mean[0], covariance[0, 0]
    weights = np.array(list(sets.values()))
    scale, bounds = float(evidence.scale[index]), evidence.bounds[index]
    others = [other for other in fit.chosen if other != name]
    relative = _relative_variance(fit, name, others)
    ends = _interval(weights, means, variances, relative, *bounds)
    possible = _possible(weights, means, variances, *bounds)
    return scale * min(ends[0], possible[0]), scale * max(ends[1], possible[1])


def _relative_variance(fit: Fit, name: str, others: Sequence[str]) -> float:
    """Return the variance of an amplitude by errors of its signature, over the amplitude squared.

    The errors are the signature times cosines along the displacement, with a joint root mean square
    of `SIGNATURE_ERROR`. They are mistaken for the signature as far as they resemble it once
    everything else is fitted.
    """
    evidence = fit.evidence
    suspect = evidence.suspects[name]
    x = (np.arange(evidence.blocks.points) + 0.5) / evidence.blocks.points
    waves = [np.cos(k * np.pi * x) for k in range(WAVES + 1)]
    wrong = {
        str(k): dataclasses.replace(suspect, signature=suspect.signature * wave)
        for k, wave in enumerate(waves)
    }
    columns = evidence.signatures[:, [evidence.names.index(other) for other in others]]
    around = dataclasses.replace(evidence.with_nuisance(columns), suspects=wrong)
    scatter = dataclasses.replace(fit.scatter, spread={})
    gram = around.whiten(scatter).reduce().gram
    shares = gram[0, 1:] / max(gram[0, 0], 1e-300)
    return float(SIGNATURE_ERROR**2 * (shares**2).sum() * 2.0 / WAVES)


def _interval(
    weights: Array, means: Array, variances: Array, relative: float, least: float, most: float
) -> tuple[float, float]:
    """Return the amplitudes a within bounds that a mixture of normal distributions allows, 95 %.

    The variance is ``variance + relative a^2`` (Fieller 1954). Where nearly all of a signature is
    imitated, the remainder is no larger than the error of the signature, and it may be that no
    amplitude is excluded.
    """

    def share(a: float) -> float:
        return float(weights @ ndtr((a - means) / np.sqrt(variances + relative * a**2)))

    return _quantiles(share, least, most)


def _possible(
    weights: Array, means: Array, variances: Array, least: float, most: float
) -> tuple[float, float]:
    """Return the 95 % interval of an amplitude that is known to lie within its bounds.

    Where the mean is far beyond a bound, the interval is narrow, but larger than nothing.
    """
    sd = np.sqrt(variances)
    within = truncnorm((least - means) / sd, (most - means) / sd, loc=means, scale=sd)
    return _quantiles(lambda a: float(weights @ within.cdf(a)), least, most)


def _quantiles(share: Callable[[float], float], least: float, most: float) -> tuple[float, float]:
    """Return the ends, within bounds, of the interval of 95 % of a distribution function."""

    def quantile(wanted: float) -> float:
        if share(least) >= wanted:
            return least
        if share(most) <= wanted:
            return most
        return float(brentq(lambda a: share(a) - wanted, least, most))

    return quantile(float(ndtr(-QUANTILE))), quantile(float(ndtr(QUANTILE)))


def _imitators(fit: Fit, name: str, factors: list[str]) -> tuple[str, ...]:
    """Return the names of what is correlated with an effect, the most correlated first."""
    evidence = fit.evidence
    effects = [other for other in fit.chosen if other != name]
    chosen = [evidence.names.index(other) for other in [*effects, name]]
    precision = np.linalg.inv(evidence.whiten(fit.scatter).deviations(chosen)[1])
    precision[-1, -1] += FLAT - 1.0
    covariance = np.linalg.inv(precision)
    sd = np.sqrt(np.diag(covariance))
    correlation = np.abs(covariance[-1] / sd / sd[-1])[:-1]
    simulator = correlation[len(factors) : len(correlation) - len(effects)]
    named: Mapping[str, float] = {
        **dict(zip(factors, correlation, strict=False)),
        **dict(zip(effects, correlation[len(correlation) - len(effects) :], strict=True)),
        SIMULATOR: float(np.sqrt((simulator**2).sum())),
    }
    order = sorted(named, key=lambda other: -named[other])
    return tuple(other for other in order if named[other] > IMITATES)


def cosines(fit: Fit) -> dict[tuple[str, str], float]:
    """Return how alike signatures are, after removal of what factors and simulator can imitate.

    This is the cosine of each pair in the inner product of the inverse covariance; it is 1 or -1
    where the data cannot tell the two apart.
    """
    evidence = fit.evidence
    gram = evidence.whiten(fit.scatter).reduce().gram
    size = np.sqrt(np.maximum(np.diag(gram), 1e-300))
    alike = gram / size / size[:, None]
    names = evidence.names
    return {
        (a, b): float(alike[i, j])
        for i, a in enumerate(names)
        for j, b in enumerate(names)
        if i < j
    }

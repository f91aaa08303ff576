"""Effects that may go unnoticed: how large every suspect may be, and what imitates it."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import ndtr
from scipy.stats import truncnorm

from ramiefenics.discovery.curves.blocks import Array
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


def limits(fits: Sequence[Fit], factors: Sequence[str]) -> dict[str, Limit]:
    """Return how large each suspect may be, in addition to the effects that are fitted.

    Parameters
    ----------
    fits
        Fits of all sets of effects that are probable, the best one first. What one of them does
        not exclude is not excluded.
    factors
        Names of the fitted factors.
    """
    found = {}
    for name in fits[0].evidence.names:
        each = [_limit(fit, name, factors) for fit in fits]
        found[name] = dataclasses.replace(
            each[0],
            low=min(one.low for one in each),
            high=max(one.high for one in each),
            share=max(one.share for one in each),
        )
    return found


def _limit(fit: Fit, name: str, factors: Sequence[str]) -> Limit:
    evidence = fit.evidence
    others = [other for other in fit.chosen if other != name]
    chosen = [evidence.names.index(other) for other in [*others, name]]
    expected, covariance = evidence.whiten(fit.scatter).deviations(chosen)
    # in the last row and column, the amplitude's prior is replaced by the flat one
    precision = np.linalg.inv(covariance)
    onto = precision @ expected
    precision[-1, -1] += FLAT - 1.0
    covariance = np.linalg.inv(precision)
    expected = covariance @ onto
    index = evidence.names.index(name)
    scale, (least, most) = evidence.scale[index], evidence.suspects[name].effect.bounds
    relative = _relative_variance(fit, name, others)
    ends = _interval(float(expected[-1]), covariance[-1, -1], relative)
    possible = _possible(float(expected[-1]), covariance[-1, -1], least / scale, most / scale)
    low = max(scale * min(ends[0], possible[0]), least)
    high = min(scale * max(ends[1], possible[1]), most)
    change = np.sqrt((evidence.suspects[name].signature ** 2).mean(axis=0)).max()
    share = float(max(abs(low), abs(high)) * change)
    return Limit(low, high, share, _imitators(covariance, [*factors], others))


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


def _interval(mean: float, variance: float, relative: float) -> tuple[float, float]:
    """Return the amplitudes a for which the mean is within 1.96 standard deviations.

    The variance is ``variance + relative a^2`` (Fieller 1954). Where nearly all of a signature is
    imitated, the remainder is no larger than the error of the signature, and it may be that no
    amplitude is excluded.
    """
    z = QUANTILE**2
    rest = 1.0 - z * relative
    root = mean**2 - rest * (mean**2 - z * variance)
    if rest <= 0.0:
        return -np.inf, np.inf
    return (mean - root**0.5) / rest, (mean + root**0.5) / rest


def _possible(mean: float, variance: float, least: float, most: float) -> tuple[float, float]:
    """Return the 95 % interval of an amplitude that is known to lie within its bounds.

    Where the mean is far beyond a bound, the interval is narrow, but larger than nothing.
    """
    sd = variance**0.5
    within = truncnorm((least - mean) / sd, (most - mean) / sd, loc=mean, scale=sd)
    low, high = within.ppf(ndtr(np.array([-QUANTILE, QUANTILE])))
    return float(low), float(high)


def _imitators(covariance: Array, factors: list[str], effects: list[str]) -> tuple[str, ...]:
    """Return the names of what is correlated with the last variable, the most correlated first."""
    sd = np.sqrt(np.diag(covariance))
    correlation = np.abs(covariance[-1] / sd / sd[-1])[:-1]
    simulator = correlation[len(factors) : len(correlation) - len(effects)]
    named: Mapping[str, float] = {
        **dict(zip(factors, correlation, strict=False)),
        **dict(zip(effects, correlation[len(correlation) - len(effects) :], strict=True)),
        SIMULATOR: float(np.sqrt((simulator**2).sum())),
    }
    order = sorted(named, key=lambda name: -named[name])
    return tuple(name for name in order if named[name] > IMITATES)


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

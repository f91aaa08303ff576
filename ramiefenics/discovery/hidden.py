"""What could be there and not show: how large every suspect may be, and what imitates it."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ramiefenics.discovery.blocks import Array
from ramiefenics.discovery.evidence import Evidence
from ramiefenics.discovery.fit import Fit

FLAT = 1e-2
"""Precision of the amplitude beforehand, over that of `Evidence.scale`: next to
nothing is known of it."""

SIGNATURE_ERROR = 0.05
"""Of a signature, relative: what it differs by at other amplitudes, on other meshes, and where it
is learned."""

WAVES = 3
"""Cosines that such errors are made of."""

QUANTILE = 1.96
"""Of the normal distribution, for 95 %."""

IMITATES = 0.3
"""Correlation from which on something is said to imitate an effect."""

SIMULATOR = "mesh and simulator"


@dataclass(frozen=True)
class Limit:
    """How large an effect may be.

    Attributes
    ----------
    low, high
        Amplitudes that the data do not exclude, 95 %.
    share
        Largest change of the curves by one of these, root mean square over the curves, over the
        peak force.
    imitated_by
        Names of factors and other effects that take the place of it, the most important first.
    """

    low: float
    high: float
    share: float
    imitated_by: tuple[str, ...]


def limits(fit: Fit, factors: Sequence[str]) -> dict[str, Limit]:
    """Return how large each suspect may be, beside the effects that are fitted.

    Parameters
    ----------
    fit
        Of all effects that are there.
    factors
        Names of the fitted factors.
    """
    evidence = fit.evidence
    return {name: _limit(evidence, fit, name, factors) for name in evidence.names}


def _limit(evidence: Evidence, fit: Fit, name: str, factors: Sequence[str]) -> Limit:
    others = [other for other in fit.chosen if other != name]
    chosen = [evidence.names.index(other) for other in [*others, name]]
    expected, covariance = evidence.whiten(fit.scatter).deviations(chosen)
    # the prior of the amplitude is taken out of the last row and column
    precision = np.linalg.inv(covariance)
    onto = precision @ expected
    precision[-1, -1] += FLAT - 1.0
    covariance = np.linalg.inv(precision)
    expected = covariance @ onto
    index = evidence.names.index(name)
    scale, (least, most) = evidence.scale[index], evidence.suspects[name].effect.bounds
    relative = _relative_variance(evidence, fit, name, others)
    ends = _interval(float(expected[-1]), covariance[-1, -1], relative)
    low, high = (float(np.clip(scale * end, least, most)) for end in ends)
    change = np.sqrt((evidence.suspects[name].signature ** 2).mean(axis=0)).max()
    share = float(max(abs(low), abs(high)) * change)
    return Limit(low, high, share, _imitators(covariance, [*factors], others))


def _relative_variance(evidence: Evidence, fit: Fit, name: str, others: Sequence[str]) -> float:
    """Return what errors of its signature make of an amplitude's variance, over its square.

    The signature times cosines along the displacement, of which `SIGNATURE_ERROR` is the root mean
    square together, are mistaken for it as far as they are alike beside all else that is fitted.
    """
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

    The variance is ``variance + relative a^2`` (Fieller 1954): where nearly all of a signature is
    imitated, what is left of it is as uncertain as the signature itself, and no amplitude may be
    excluded.
    """
    z = QUANTILE**2
    rest = 1.0 - z * relative
    root = mean**2 - rest * (mean**2 - z * variance)
    if rest <= 0.0:
        return -np.inf, np.inf
    return (mean - root**0.5) / rest, (mean + root**0.5) / rest


def _imitators(covariance: Array, factors: list[str], effects: list[str]) -> tuple[str, ...]:
    """Return what is correlated with the last variable."""
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
    """Return how alike signatures are where factors and simulator have taken what they can.

    The cosine of each pair, by the inverse covariance: 1 or -1 where the data cannot tell them
    apart.
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

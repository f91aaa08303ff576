"""P-values by parametric bootstrap, with the scatter refitted to every random data set."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping, Sequence

import numpy as np

from ramiefenics.discovery.curves.blocks import Array, smooth
from ramiefenics.discovery.statistics.causes import log_evidence_gains
from ramiefenics.discovery.statistics.evidence import MODEL_ERROR, Evidence
from ramiefenics.discovery.statistics.fit import Fit
from ramiefenics.discovery.statistics.fit_scatter import fit_scatter, without_knowledge
from ramiefenics.discovery.statistics.scatter import Scatter

DRAWS = 1000
"""Maximum number of random data sets."""

EXCEEDED = 40
"""Number of random data sets exceeding the measured one after which no more are drawn, because the
probability is then known well enough (Besag and Clifford 1991)."""

STEP, FARTHEST = 0.1, 1.5
"""Step of the logarithms of standard deviations for derivatives, and their largest change in a
refit."""

MISFIT = 10.0
"""Size of the misfit that something unknown makes, as a multiple of the simulator's own error."""

FREE = 3.0
"""Standard deviation, relative to the prior one, of the changes allowed in the amplitudes of the
effects present when the misfit that these leave is tested."""

ALTERNATIVES = 3
"""Number of suspects with which standard deviations are fitted as well, because an effect by which
specimens differ is otherwise taken for scatter."""


def p_value_of_effect(
    evidence: Evidence,
    nothing: Scatter,
    rng: np.random.Generator,
    fitted: Mapping[str, float] | None = None,
) -> float:
    """Return the probability that some suspect explains as much if no effect is present.

    Parameters
    ----------
    evidence
        Evidence of the curves, with all suspects.
    nothing
        The most probable standard deviations without effects.
    rng
        Random number generator.
    fitted
        Gains in log-evidence of the suspects that have been fitted. For the measured curves, these
        replace the gains by the derivatives. For random curves the derivatives suffice, because
        without an effect the best fit cannot be far from where they were computed.
    """
    fitted = fitted or {}
    singles = [(index,) for index in range(len(evidence.names))]
    left = [index for index, name in enumerate(evidence.names) if name not in fitted]
    if not singles:
        return 1.0
    reduced = evidence.whiten(nothing).reduce()
    gains = log_evidence_gains(reduced, evidence.bounds, singles)[:, 0]
    best = [evidence.names[index] for index in np.argsort(-gains)[:ALTERNATIVES]]
    start, same = nothing.logarithms(), len(nothing.logarithms())
    moves = [fit_scatter(evidence, [n], nothing).logarithms()[:same] - start for n in best]

    def gains_of_each(scatter: Scatter, data: Array | None) -> Array:
        without = evidence.whiten(scatter, data).reduce()
        base = without.log_evidence[0] + scatter.log_prior()
        gains = log_evidence_gains(without, evidence.bounds, singles)[:, 0]
        for move in moves:
            other = scatter.moved(scatter.logarithms() + move)
            found = evidence.whiten(other, data).reduce()
            more = log_evidence_gains(found, evidence.bounds, singles)[:, 0]
            gains = np.maximum(gains, more + found.log_evidence[0] + other.log_prior() - base)
        return gains

    def best_gain(scatter: Scatter, data: Array | None) -> float:
        gains = gains_of_each(scatter, data)
        return float(max([*gains[left], *fitted.values()]) if data is None else gains.max())

    return _p_value(evidence, nothing, best_gain, rng)


def p_value_of_misfit(fit: Fit, rng: np.random.Generator) -> float:
    """Return the probability of a misfit common to all curves as large as that left by a fit.

    Parameters
    ----------
    fit
        Fit of the effects that are present; their amplitudes may change.
    rng
        Random number generator.
    """
    evidence = fit.evidence
    chosen = [evidence.names.index(name) for name in fit.chosen]
    narrow = evidence.with_nuisance(FREE * evidence.signatures[:, chosen])
    modes = (MISFIT**2 - 1.0) ** 0.5 * MODEL_ERROR * smooth(*evidence.residual.shape)
    wide = narrow.with_nuisance(modes)

    def gain(scatter: Scatter, data: Array | None) -> float:
        both = [e.whiten(scatter, data).reduce().log_evidence[0] for e in (wide, narrow)]
        return float(both[0] - both[1])

    return _p_value(narrow, fit.scatter, gain, rng)


def _p_value(
    evidence: Evidence,
    scatter: Scatter,
    statistic: Callable[[Scatter, Array | None], float],
    rng: np.random.Generator,
) -> float:
    """Return the probability of a statistic at least as large as that of the measured curves."""
    draws = evidence.draw(scatter, DRAWS, rng)
    measured, exceeded = statistic(scatter, None), 0
    for index, own in enumerate(_refitted(evidence, scatter, draws)):
        exceeded += statistic(own, draws[..., [index]]) >= measured
        if exceeded == EXCEEDED:
            return exceeded / (index + 1)
    return (1 + exceeded) / (1 + DRAWS)


def _refitted(evidence: Evidence, scatter: Scatter, draws: Array) -> Sequence[Scatter]:
    """Return the most probable standard deviations of each random data set.

    This is one step of Fisher scoring, with the covariance of the draws' derivatives as the
    information matrix.
    """
    needed = {name: evidence.suspects[name] for name in scatter.spread}
    blind = dataclasses.replace(without_knowledge(evidence), suspects=needed)
    middle = scatter.logarithms()

    def values(logarithms: Array) -> Array:
        moved = scatter.moved(logarithms)
        return np.asarray(blind.whiten(moved, draws).reduce().log_evidence)

    steps = STEP * np.eye(len(middle))
    slopes = np.array(
        [(values(middle + step) - values(middle - step)) / (2 * STEP) for step in steps]
    )
    prior_slope, precision = scatter.prior_derivatives()
    information = np.atleast_2d(np.cov(slopes)) + precision
    moves = np.linalg.solve(information, slopes + prior_slope[:, None])
    moves = np.clip(moves, -FARTHEST, FARTHEST)
    return [scatter.moved(middle + move) for move in moves.T]

"""Estimation of the most probable standard deviations."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np
from scipy.optimize import minimize

from ramiefenics.discovery.curves.blocks import Array, smooth
from ramiefenics.discovery.statistics.evidence import Evidence
from ramiefenics.discovery.statistics.scatter import Scatter

UNKNOWN = 1.0
"""Standard deviation of a log factor about which next to nothing is known."""

UNKNOWN_MISFIT = 0.1
"""Standard deviation of each cosine of a common misfit over the peak force, about which next to
nothing is known."""

WIDEST = 4.0
"""Largest difference of the logarithm of a standard deviation from its prior median."""

NARROWER = 0.3
"""Difference of logarithms by which a standard deviation is reduced where it is too large."""


def fit_scatter(
    evidence: Evidence, effects: Sequence[str] = (), start: Scatter | None = None
) -> Scatter:
    """Return the most probable standard deviations if certain effects are present.

    The common factors count as unknown (restricted maximum likelihood: Patterson and Thompson
    1971). Otherwise, where they contradict what was known of them, the specimens' own factors would
    take up the difference, as if specimens differed by more than they do.

    Amplitudes differ between specimens by no more than keeps the expected amplitude of each within
    its bounds: no section is flatter than flat.
    """
    suspects = evidence.suspects
    differ = tuple(name for name in effects if suspects[name].effect.per_specimen)
    typical = Scatter.typical(evidence.by_own.shape[1], differ)
    blind = without_knowledge(evidence)

    def loss(logarithms: Array) -> tuple[float, Array]:
        value, slope = log_evidence_slope(blind, effects, typical.moved(logarithms))
        return -value, -slope

    middle = typical.logarithms()
    first = middle.copy()
    if start is not None:
        same = len(start.own) + 3
        first[:same] = start.logarithms()[:same]
    low, high = middle - WIDEST, middle + WIDEST
    while True:
        found = minimize(
            loss,
            np.clip(first, low, high),
            jac=True,
            method="L-BFGS-B",
            bounds=np.stack([low, high], axis=1),
            options={"maxiter": 60, "ftol": 1e-7},
        ).x
        scatter = typical.moved(found)
        if not differ:
            return scatter
        beyond = np.append(np.zeros(len(found) - len(differ)), _beyond(blind, effects, scatter))
        if not np.any((beyond > 0.0) & (found > low)):
            return scatter
        high = np.where(beyond > 0.0, np.maximum(found - NARROWER, low), high)


def _beyond(evidence: Evidence, effects: Sequence[str], scatter: Scatter) -> Array:
    """Return how far beyond its bounds some specimen's expected amplitude is, shape (spread,).

    The mean counts as within them.
    """
    inverse = np.linalg.inv(evidence.covariance(scatter))
    columns = evidence.shared_columns([evidence.names.index(name) for name in effects])
    _, _, expected, residual = _fitted(columns, inverse, evidence.data)
    mean = dict(zip(effects, expected[len(expected) - len(effects) :, 0], strict=True))
    far = []
    for name, sd in scatter.spread.items():
        index = evidence.names.index(name)
        signature = evidence.shared_columns([index])[..., -1]
        low, high = evidence.bounds[index]
        each = np.clip(mean[name], low, high) + sd**2 * (signature * residual[..., 0]).sum(axis=1)
        far.append(max(each.max() - high, low - each.min()))
    return np.array(far)


def _fitted(columns: Array, inverse: Array, data: Array) -> tuple[Array, Array, Array, Array]:
    """Return weighted columns, the precision and the mean of their deviations, and the residual.

    The mean has shape (c, 1). Columns and residual are multiplied by the inverse covariance.
    """
    weighted = inverse @ columns
    gram = np.eye(columns.shape[2]) + np.tensordot(columns, weighted, axes=((0, 1), (0, 1)))
    expected = np.linalg.solve(gram, np.tensordot(weighted, data, axes=((0, 1), (0, 1))))
    return weighted, gram, expected, inverse @ data - weighted @ expected


def without_knowledge(evidence: Evidence) -> Evidence:
    """Return the evidence with next to nothing known of common factors and smooth misfits."""
    unknown = dataclasses.replace(evidence, factor_sd=max(evidence.factor_sd, UNKNOWN))
    return unknown.with_nuisance(UNKNOWN_MISFIT * smooth(*evidence.residual.shape))


def log_evidence(evidence: Evidence, effects: Sequence[str], scatter: Scatter) -> float:
    """Return the log-evidence of certain effects, plus `Scatter.log_prior`.

    Bounds of amplitudes are disregarded.
    """
    return log_evidence_slope(evidence, effects, scatter)[0]


def log_evidence_slope(
    evidence: Evidence, effects: Sequence[str], scatter: Scatter
) -> tuple[float, Array]:
    """Return the same, and its derivatives with respect to `Scatter.logarithms`.

    They follow Rasmussen and Williams 2006, Gaussian Processes for Machine Learning, Eq. 5.9; only
    the covariance of what specimens do not share depends on the logarithms.
    """
    columns = evidence.shared_columns([evidence.names.index(name) for name in effects])
    covariance = evidence.covariance(scatter)
    inverse, data = np.linalg.inv(covariance), evidence.data
    weighted, gram, _, residual = _fitted(columns, inverse, data)
    volume = sum(
        2.0 * np.log(np.diagonal(np.linalg.cholesky(matrix), axis1=-2, axis2=-1)).sum()
        for matrix in (covariance, gram)
    )
    value = -0.5 * float((residual * data).sum() + volume) + scatter.log_prior()
    shared = (weighted @ np.linalg.inv(gram)) @ weighted.transpose(0, 2, 1)
    by_covariance = 0.5 * (residual @ residual.transpose(0, 2, 1) - inverse + shared)
    slope = evidence.slopes(by_covariance, scatter)
    return value, slope + scatter.prior_derivatives()[0]

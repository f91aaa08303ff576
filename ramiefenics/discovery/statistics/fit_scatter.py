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


def fit_scatter(
    evidence: Evidence, effects: Sequence[str] = (), start: Scatter | None = None
) -> Scatter:
    """Return the most probable standard deviations if certain effects are present.

    The common factors count as unknown (restricted maximum likelihood: Patterson and Thompson
    1971). Otherwise, where they contradict what was known of them, the specimens' own factors would
    take up the difference, as if specimens differed by more than they do.
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
    found = minimize(
        loss,
        first,
        jac=True,
        method="L-BFGS-B",
        bounds=[(value - WIDEST, value + WIDEST) for value in middle],
        options={"maxiter": 60, "ftol": 1e-7},
    )
    return typical.moved(found.x)


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
    weighted = inverse @ columns
    gram = np.eye(columns.shape[2]) + np.tensordot(columns, weighted, axes=((0, 1), (0, 1)))
    expected = np.linalg.solve(gram, np.tensordot(weighted, data, axes=((0, 1), (0, 1))))
    residual = inverse @ data - weighted @ expected
    volume = sum(
        2.0 * np.log(np.diagonal(np.linalg.cholesky(matrix), axis1=-2, axis2=-1)).sum()
        for matrix in (covariance, gram)
    )
    value = -0.5 * float((residual * data).sum() + volume) + scatter.log_prior()
    shared = (weighted @ np.linalg.inv(gram)) @ weighted.transpose(0, 2, 1)
    by_covariance = 0.5 * (residual @ residual.transpose(0, 2, 1) - inverse + shared)
    slope = evidence.slopes(by_covariance, scatter)
    return value, slope + scatter.prior_derivatives()[0]

"""Degrees of freedom of estimates whose standard deviations are estimated as well."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

import numpy as np

from ramiefenics.discovery.curves.blocks import Array
from ramiefenics.discovery.statistics.fit import Fit
from ramiefenics.discovery.statistics.fit_scatter import log_evidence_slope, without_knowledge

STEP = 0.05
"""Step of logarithms of standard deviations in difference quotients."""


def degrees_of_freedom(fit: Fit, variances: Callable[[Fit], Array]) -> Array:
    """Return the degrees of freedom of Student's distribution for several estimates, shape (g,).

    The variance V of an estimate depends on standard deviations that are estimated from differences
    between specimens, and the more coefficients are fitted to these differences, the less certain V
    is. A chi-square variable with k degrees of freedom has the relative variance of V if
    ``k = 2 V^2 / var(V)`` (Satterthwaite 1946, Biometrics Bulletin 2, 110-114; for mixed models:
    Fai and Cornelius 1996, Journal of Statistical Computation and Simulation 54, 363-378). The
    result is at most one fewer than there are specimens, as for other intervals (`Fit.samples`).

    Parameters
    ----------
    fit
        The fit.
    variances
        Function of a fit that returns the variances of the estimates, shape (g,).
    """
    logarithms = fit.scatter.logarithms()

    def at(step: Array) -> Fit:
        return dataclasses.replace(fit, scatter=fit.scatter.moved(logarithms + step))

    blind = without_knowledge(fit.evidence)
    steps = STEP * np.eye(len(logarithms))
    pairs = [(at(-step), at(step)) for step in steps]
    variance = variances(fit)
    slopes = np.array([variances(b) - variances(a) for a, b in pairs]) / (2.0 * STEP)
    evidence = [[log_evidence_slope(blind, (), f.scatter)[1] for f in pair] for pair in pairs]
    curvature = -np.array([b - a for a, b in evidence]) / (2.0 * STEP)
    covariance = np.linalg.inv(_at_least(curvature, fit.scatter.prior_derivatives()[1]))
    spread = np.einsum("ig,ij,jg->g", slopes, covariance, slopes)
    most = max(len(fit.evidence.whole) - 1.0, 2.0)
    freedom = np.divide(2.0 * variance**2, spread, np.full_like(variance, most), where=spread > 0.0)
    return np.clip(freedom, 1.0, most)


def _at_least(curvature: Array, prior: Array) -> Array:
    """Return a symmetric curvature that is nowhere less than that of the prior."""
    more = 0.5 * (curvature + curvature.T) - prior
    sizes, axes = np.linalg.eigh(more)
    return np.asarray(prior + (axes * np.maximum(sizes, 0.0)) @ axes.T)

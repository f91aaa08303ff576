"""Predictions for one stalk with factors calibrated on others.

The posterior is represented by weighted points (importance sampling; Gelman et al. 2013, section
10.4). The points fill the prior evenly, each is weighted by its likelihood ``exp(-chi2 / 2)``, and
predictions are weighted quantiles. With only one or two measurements many points keep a
considerable weight, and no Markov chain is needed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ramiefenics.calibration.factors import Array
from ramiefenics.calibration.misfit import Misfit
from ramiefenics.calibration.surface import Surface

DRAWS = 131072
"""Number of points that represent the prior."""

ENOUGH = 200.0
"""Least effective number of points for the ends of an interval to be meaningful."""

LEVELS = (0.025, 0.5, 0.975)
"""Probabilities of the quantiles: the ends of a 95 % interval, and the median."""

FIFTH = 0.6
"""Coded value above which the uppermost fifth of a range from -1 to 1 begins."""


@dataclass(frozen=True)
class Weighted:
    """Points of the prior, weighted by the likelihood of the measurements.

    Attributes
    ----------
    points
        Coded points, shape (n, k).
    weights
        Weights with a sum of 1, shape (n,).
    """

    points: Array
    weights: Array

    @property
    def effective(self) -> float:
        """Effective number of points (Kong 1992)."""
        return float(1.0 / np.square(self.weights).sum())


@dataclass(frozen=True)
class Prediction:
    """Distribution of a response over weighted points.

    Attributes
    ----------
    weighted
        Weighted points.
    surface
        Response surface.
    """

    weighted: Weighted
    surface: Surface

    @cached_property
    def values(self) -> Array:
        """Response at the points, without the error of the surface, shape (n,)."""
        return self.surface.predict(self.weighted.points)

    @property
    def mean(self) -> float:
        """Weighted mean of the response."""
        return float(self.weighted.weights @ self.values)

    @cached_property
    def interval(self) -> tuple[float, float, float]:
        """Lower end, median and upper end of the 95 % interval, including the surface's error."""
        noise = np.random.default_rng(0).standard_normal(len(self.values))
        blurred = self.values + self.surface.prediction_error * noise
        return weighted_quantiles(blurred, self.weighted.weights)

    def swing(self, factor: int) -> float:
        """Return the change of the response from the lowest to the highest fifth of a factor.

        The change is the average over all other factors. It is NaN if hardly any weight is left in
        one of the two fifths.
        """
        weights, at = self.weighted.weights, self.weighted.points[:, factor]
        reach = FIFTH * float(np.abs(at).max())
        ends = [weights * (at >= reach), weights * (at <= -reach)]
        if min(end.sum() for end in ends) < 1e-4:
            return float("nan")
        upper, lower = (float(end @ self.values / end.sum()) for end in ends)
        return upper - lower


def weighted_quantiles(values: Array, weights: Array) -> tuple[float, float, float]:
    """Return lower end, median and upper end of the 95 % interval of weighted values."""
    order = np.argsort(values)
    low, middle, high = np.interp(LEVELS, np.cumsum(weights[order]), values[order])
    return float(low), float(middle), float(high)


def prior(misfit: Misfit) -> Weighted:
    """Return points of the prior with equal weights."""
    points = misfit.region.sample(DRAWS)
    return Weighted(points, np.full(len(points), 1.0 / len(points)))


def condition(
    misfit: Misfit, before: Weighted, nearest: Array | None = None
) -> tuple[Weighted, bool]:
    """Return the points weighted by the measurements, and whether these can be met.

    If the measurements are not met within their errors (95 %) at the nearest point, by default the
    best of the given ones, the differences that remain there count as an error of the model, as in
    a calibration. Otherwise the intervals would be narrow only because the fit is bad.
    """
    if nearest is None:
        nearest = before.points[misfit.of(before.points).argmin()]
    met = misfit.met(nearest)
    if not met:
        misfit = misfit.with_discrepancy(nearest)
    chi2 = misfit.of(before.points)
    weights = before.weights * np.exp(-0.5 * (chi2 - chi2.min()))
    return Weighted(before.points, weights / weights.sum()), met


def fix(before: Weighted, factors: Sequence[int], values: Array) -> Weighted:
    """Return the points with some factors, given by index, set to coded values of shape (k,)."""
    points = before.points.copy()
    points[:, list(factors)] = values[list(factors)]
    return Weighted(points, before.weights)

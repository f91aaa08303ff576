"""What is predicted of one stalk when the factors are calibrated on others.

Bayes' rule by weighted points: points fill the prior evenly, each weighs by its likelihood
``exp(-chi2 / 2)``, and predictions are weighted quantiles (importance sampling; Gelman et al. 2013,
section 10.4). With one or two measurements many points keep weight, and no chain has to mix.
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
"""Points that stand for the prior."""

ENOUGH = 200.0
"""Points that must share the weight for the ends of an interval to mean something."""

LEVELS = (0.025, 0.5, 0.975)
"""Of quantiles: a 95 % interval and its middle."""

FIFTH = 0.6
"""Coded value that cuts the outer fifth off a range from -1 to 1."""


@dataclass(frozen=True)
class Weighted:
    """Points of the prior, weighted by what was measured.

    Attributes
    ----------
    points
        Coded, shape (n, k).
    weights
        Shape (n,), of sum 1.
    """

    points: Array
    weights: Array

    @property
    def effective(self) -> float:
        """Number of points that share the weight (Kong 1992)."""
        return float(1.0 / np.square(self.weights).sum())


@dataclass(frozen=True)
class Prediction:
    """A response over weighted points.

    Attributes
    ----------
    weighted
        The points.
    surface
        The response.
    """

    weighted: Weighted
    surface: Surface

    @cached_property
    def values(self) -> Array:
        """Response at the points, without the surface's own error, shape (n,)."""
        return self.surface.predict(self.weighted.points)

    @property
    def mean(self) -> float:
        """Weighted mean."""
        return float(self.weighted.weights @ self.values)

    @cached_property
    def interval(self) -> tuple[float, float, float]:
        """Lower end, median and upper end of the 95 % interval, the surface's errors included."""
        noise = np.random.default_rng(0).standard_normal(len(self.values))
        blurred = self.values + self.surface.prediction_error * noise
        return weighted_quantiles(blurred, self.weighted.weights)

    def swing(self, factor: int) -> float:
        """Return by how much the response rises from a factor's lower fifth to its upper one.

        On average over all other factors; NaN where no weight is left in one of the fifths.
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
    """Return points of the prior, all of one weight."""
    points = misfit.region.sample(DRAWS)
    return Weighted(points, np.full(len(points), 1.0 / len(points)))


def condition(
    misfit: Misfit, before: Weighted, nearest: Array | None = None
) -> tuple[Weighted, bool]:
    """Return the points weighted by what was measured, and whether that can be met.

    If it is not met within the errors (95 %) at the nearest point, by default the best of the
    weighted ones, what is left there counts as an error of the model, as in a calibration:
    intervals would be narrow for no better reason than that the fit is bad.
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
    """Return the points with some factors, by number, at given coded values, of shape (k,)."""
    points = before.points.copy()
    points[:, list(factors)] = values[list(factors)]
    return Weighted(points, before.weights)

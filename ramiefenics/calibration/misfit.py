"""Misfit between response surfaces and measurements, in units of the error."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy import optimize, stats

from ramiefenics.calibration.factors import Array
from ramiefenics.calibration.region import Region
from ramiefenics.calibration.surface import Surface

LEVEL = 0.95
"""Confidence level of all intervals and sets."""

STARTS = 4
"""Number of starting points of a minimisation; a quadratic in a box may have several minima."""


@dataclass(frozen=True)
class Targets:
    """Measured values of the responses, to which the surfaces are fitted.

    Attributes
    ----------
    names
        Names of the m responses.
    values
        Measured values, shape (m,).
    covariance
        Covariance of their errors, shape (m, m).
    """

    names: tuple[str, ...]
    values: Array
    covariance: Array

    @property
    def errors(self) -> Array:
        """Standard errors, shape (m,)."""
        return np.sqrt(np.diag(self.covariance))


@dataclass(frozen=True)
class Misfit:
    """Chi-squared of the differences between response surfaces and targets.

    The variance of a difference is the variance of the measurement, plus the squared error of the
    surface in predicting a run left out, plus the squared discrepancy.

    Attributes
    ----------
    surfaces
        One response surface per target, in the same order.
    targets
        Measured values.
    region
        Region in which the surfaces may be trusted.
    discrepancy
        Assumed error of the model itself, per target; none by default.
    """

    surfaces: tuple[Surface, ...]
    targets: Targets
    region: Region
    discrepancy: tuple[float, ...] = ()

    @cached_property
    def _whitening(self) -> Array:
        covariance = self.targets.covariance + np.diag(
            [surface.prediction_error**2 for surface in self.surfaces]
        )
        if self.discrepancy:
            covariance = covariance + np.diag(np.square(self.discrepancy))
        return np.asarray(np.linalg.inv(np.linalg.cholesky(covariance)))

    def with_discrepancy(self, best: Array) -> Misfit:
        """Return the misfit in which the differences at a point count as an error of the model.

        This is the simplest form of the model discrepancy of Kennedy and O'Hagan (2001): an unknown
        difference between model and reality, in addition to the errors of measurement.
        """
        left = np.abs(self.predict(best[None])[0] - self.targets.values)
        return replace(self, discrepancy=tuple(float(value) for value in left))

    def predict(self, points: Array) -> Array:
        """Return all responses, shape (n, m), at coded points of shape (n, k)."""
        return np.column_stack([surface.predict(points) for surface in self.surfaces])

    def residuals(self, points: Array) -> Array:
        """Return the whitened residuals: independent, with variance 1; shape (n, m)."""
        return (self.predict(points) - self.targets.values) @ self._whitening.T

    def jacobian(self, point: Array) -> Array:
        """Return the derivatives of the whitened residuals at one point, shape (m, k)."""
        slopes = np.vstack([surface.slopes(point[None])[0] for surface in self.surfaces])
        return np.asarray(self._whitening @ slopes)

    def of(self, points: Array) -> Array:
        """Return chi-squared at coded points, shape (n,)."""
        return np.asarray(np.square(self.residuals(points)).sum(axis=1))

    def met(self, point: Array) -> bool:
        """Return whether the targets are met at a coded point within their errors (95 %).

        The degrees of freedom are the number of targets less the number of factors, but at least
        one: as many targets as there are factors can be met by adjustment alone.
        """
        free = max(1, len(self.surfaces) - self.region.dimension)
        return bool(self.of(point[None])[0] <= stats.chi2.ppf(LEVEL, free))

    def least(self, fixed: tuple[int, float] | None = None) -> tuple[Array, float]:
        """Return a point of least misfit and the misfit there.

        Parameters
        ----------
        fixed
            Index of a factor, and the coded value at which it is held.
        """
        others = [n for n in range(self.region.dimension) if fixed is None or n != fixed[0]]

        def whole(points: Array) -> Array:
            if fixed is None:
                return points
            full = np.full((*points.shape[:-1], self.region.dimension), fixed[1])
            full[..., others] = points
            return full

        def value(point: Array) -> float:
            return float(self.of(whole(point)[None])[0])

        def gradient(point: Array) -> Array:
            at = whole(point)
            slope = 2.0 * self.residuals(at[None])[0] @ self.jacobian(at)
            return np.asarray(slope[others])

        region = self.region if fixed is None else self.region.slice(fixed[1])
        if region.dimension == 0:
            return whole(np.zeros(0)), value(np.zeros(0))
        trial = region.sample(256)
        best = trial[np.argsort(self.of(whole(trial)))[:STARTS]]
        point, least = minimise(value, gradient, region, best)
        return whole(point), least


def minimise(
    function: Callable[[Array], float],
    gradient: Callable[[Array], Array],
    region: Region,
    starts: Array,
    equal: Sequence[dict[str, object]] = (),
) -> tuple[Array, float]:
    """Return the least of the minima found from several starts in a region, and its value.

    The method is sequential quadratic programming (Kraft 1988), as implemented in SciPy.

    Parameters
    ----------
    function, gradient
        Function to be minimised and its gradient at one point, shape (k,).
    region
        Region to which the search is confined.
    starts
        Starting points, shape (s, k).
    equal
        Equality constraints, in SciPy's format.
    """
    constraints = list(equal)
    if not region.is_box:
        ball = {
            "type": "ineq",
            "fun": lambda x: region.radius**2 - x @ x,
            "jac": lambda x: -2.0 * x,
        }
        constraints.append(ball)
    found = []
    for start in starts:
        with warnings.catch_warnings():
            # SLSQP warns when it has stepped out of the bounds and returns
            warnings.simplefilter("ignore", RuntimeWarning)
            at = optimize.minimize(
                function,
                start,
                jac=gradient,
                bounds=region.bounds,
                constraints=constraints,
                method="SLSQP",
                options={"ftol": 1e-10, "maxiter": 200},
            ).x
        for point in (start, region.pull_in(at[None])[0]):
            violated = max((abs(c["fun"](point)) for c in equal), default=0.0)  # type: ignore[operator]
            found.append((violated > 1e-6, function(point), point))
    _, value, point = min(found, key=lambda candidate: candidate[:2])
    return point, value

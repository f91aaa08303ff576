"""How far response surfaces are from what was measured, in units of the error."""

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
"""Of all intervals and sets."""

STARTS = 4
"""From which a minimum is sought; a quadratic in a box may have several."""


@dataclass(frozen=True)
class Targets:
    """What was measured.

    Attributes
    ----------
    names
        Of the responses, m of them.
    values
        Shape (m,).
    covariance
        Of their errors, shape (m, m).
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
    """Sum of squared distances from targets, a chi-squared.

    The variance of a distance is that of the measurement, plus the square of what the surface
    errs by in predicting a run left out, plus that of a discrepancy.

    Attributes
    ----------
    surfaces
        One per target, in their order.
    targets
        What was measured.
    region
        Where the surfaces may be trusted.
    discrepancy
        What the model itself is taken to be wrong by, per target; none by default.
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
        """Return the misfit that counts what is left at a point as the model's own error.

        That model and reality differ by something unknown, besides errors of measurement: Kennedy
        and O'Hagan (2001), here in its crudest form.
        """
        left = np.abs(self.predict(best[None])[0] - self.targets.values)
        return replace(self, discrepancy=tuple(float(value) for value in left))

    def predict(self, points: Array) -> Array:
        """Return all responses at coded points of shape (n, k), shape (n, m)."""
        return np.column_stack([surface.predict(points) for surface in self.surfaces])

    def residuals(self, points: Array) -> Array:
        """Return distances that are independent with variance 1, shape (n, m)."""
        return (self.predict(points) - self.targets.values) @ self._whitening.T

    def jacobian(self, point: Array) -> Array:
        """Return the derivatives of these at one point, shape (m, k)."""
        slopes = np.vstack([surface.slopes(point[None])[0] for surface in self.surfaces])
        return np.asarray(self._whitening @ slopes)

    def of(self, points: Array) -> Array:
        """Return chi-squared at coded points, shape (n,)."""
        return np.asarray(np.square(self.residuals(points)).sum(axis=1))

    def met(self, point: Array) -> bool:
        """Return whether the targets are met at a coded point within their errors (95 %).

        What the factors can meet by themselves proves nothing: the degrees of freedom are those
        that they leave, one at least.
        """
        free = max(1, len(self.surfaces) - self.region.dimension)
        return bool(self.of(point[None])[0] <= stats.chi2.ppf(LEVEL, free))

    def least(self, fixed: tuple[int, float] | None = None) -> tuple[Array, float]:
        """Return a point of least misfit and the misfit there.

        Parameters
        ----------
        fixed
            A factor, by number, and the value that it is to keep.
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

    Sequential quadratic programming (Kraft 1988), as in SciPy.

    Parameters
    ----------
    function, gradient
        Of one point, shape (k,).
    region
        Where to stay.
    starts
        Shape (s, k).
    equal
        Further constraints, as SciPy wants them.
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
            # that SLSQP has stepped out of the bounds, and goes back in
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

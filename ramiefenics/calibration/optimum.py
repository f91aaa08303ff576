"""The optimal parameters, and the set of all parameters that meet the targets equally well."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import stats

from ramiefenics.calibration.factors import Array
from ramiefenics.calibration.misfit import LEVEL, Misfit, minimise
from ramiefenics.calibration.region import Region
from ramiefenics.calibration.surface import Surface

SAMPLES = 16384
"""Number of points that fill the region, to estimate the set's share of it."""

NEWTON = 30
"""Number of Newton steps towards a level surface."""


@dataclass(frozen=True)
class Optimum:
    """The point of least misfit, and the set of equally good points.

    Attributes
    ----------
    best
        The point of least misfit; if there are several, the one nearest to the centre of the
        region. Coded, shape (k,).
    predicted
        Predicted responses at the best point, shape (m,).
    misfit
        Chi-squared at the best point.
    met
        Whether the targets are met at the best point within their errors (95 %). If not, the
        differences that remain there count as an error of the model at all other points.
    tolerance
        Greatest rise of chi-squared above its minimum at an equally good point: the 95 % quantile
        of chi-squared with as many degrees of freedom as parameters can be determined by the
        targets.
    good
        The best point, followed by points that evenly fill the set of equally good ones; coded,
        shape (n, k).
    share
        Share of the region's volume that the set takes up.
    """

    best: Array
    predicted: Array
    misfit: float
    met: bool
    tolerance: float
    good: Array
    share: float


def find_optimum(misfit: Misfit) -> tuple[Optimum, Misfit]:
    """Return the optimum of a misfit, and the misfit that defines the equally good points.

    The latter is the given misfit if the targets are met, otherwise the misfit that includes the
    discrepancy of the model.
    """
    best = nearest(misfit)
    least = float(misfit.of(best[None])[0])
    number, dimension = len(misfit.surfaces), misfit.region.dimension
    met = misfit.met(best)
    used = misfit if met else misfit.with_discrepancy(best)
    tolerance = float(stats.chi2.ppf(LEVEL, min(number, dimension)))
    points = misfit.region.sample(SAMPLES)
    good = used.of(points) <= float(used.of(best[None])[0]) + tolerance
    optimum = Optimum(
        best,
        misfit.predict(best[None])[0],
        least,
        met,
        tolerance,
        np.vstack([best[None], points[good]]),
        float(good.mean()),
    )
    return optimum, used


def nearest(misfit: Misfit) -> Array:
    """Return the point of least misfit, shape (k,); of several, the one nearest to the centre."""
    start, least = misfit.least()
    wanted = misfit.predict(start[None])[0]
    same = [
        {
            "type": "eq",
            "fun": lambda x, s=surface, y=value: float(s.predict(x[None])[0] - y),
            "jac": lambda x, s=surface: s.slopes(x[None])[0],
        }
        for surface, value in zip(misfit.surfaces, wanted, strict=True)
    ]
    points = misfit.region.sample(256)
    others = points[np.argsort(misfit.of(points))[:4]]
    starts = np.vstack([start[None], others])
    near, _ = minimise(lambda x: float(x @ x), lambda x: 2.0 * x, misfit.region, starts, same)
    as_good = float(misfit.of(near[None])[0]) <= least + 1e-4
    return near if as_good and near @ near < start @ start else start


def level_points(surface: Surface, value: float, region: Region, number: int) -> Array:
    """Return points of a region at which a response has a given value.

    Points that fill the region are moved along the gradient of the response by Newton's method.

    Parameters
    ----------
    surface
        Response surface.
    value
        Value of the response.
    region
        Region of the design.
    number
        Approximate number of points from which the search starts. Fewer are returned, or none, if
        not all of them reach the value within the region.
    """
    points = region.sample(number)
    for _ in range(NEWTON):
        slopes = surface.slopes(points)
        steep = np.maximum(np.square(slopes).sum(axis=1), 1e-12)
        step = ((value - surface.predict(points)) / steep)[:, None] * slopes
        length = np.linalg.norm(step, axis=1, keepdims=True)
        points = points + step * np.minimum(1.0, 0.5 * region.reach / np.maximum(length, 1e-300))
    scale = max(float(np.ptp(surface.values)), 1e-300)
    there = np.abs(surface.predict(points) - value) <= 1e-6 * scale
    return np.asarray(points[there & region.contains(points)])

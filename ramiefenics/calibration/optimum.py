"""The parameters that meet the targets, and the whole set of those that do so as well."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import stats

from ramiefenics.calibration.factors import Array
from ramiefenics.calibration.misfit import LEVEL, Misfit, minimise
from ramiefenics.calibration.region import Region
from ramiefenics.calibration.surface import Surface

SAMPLES = 16384
"""Points that fill the region, to find the set's share of it."""

NEWTON = 30
"""Steps to a level surface."""


@dataclass(frozen=True)
class Optimum:
    """Where a misfit is least, and where it is hardly more.

    Attributes
    ----------
    best
        Of all points of least misfit that nearest to the centre of the region; coded, (k,).
    predicted
        The responses there, (m,).
    misfit
        Chi-squared there.
    met
        Whether the targets are met there within their errors (95 %). If not, what is left there
        counts as an error of the model in all that is said of other points.
    tolerance
        How much more chi-squared an equally good point may have: the 95 % quantile of as many
        degrees of freedom as the targets can fix parameters.
    good
        Points that fill the set of equally good ones evenly, coded, shape (n, k).
    share
        The set's share of the region's volume.
    """

    best: Array
    predicted: Array
    misfit: float
    met: bool
    tolerance: float
    good: Array
    share: float


def find_optimum(misfit: Misfit) -> tuple[Optimum, Misfit]:
    """Return the optimum of a misfit with the set of equally good points, and the misfit by which.

    That is the given one if the targets are met, else the one with the model's discrepancy in it.
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
    """Return, of all points of least misfit, the one nearest to the centre, shape (k,)."""
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
    """Return about so many points at which a response has a value, none if it never does.

    Points that fill the region go down, or up, its gradient by Newton's method.
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

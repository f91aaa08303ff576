"""Identifiability: which parameters the data determine.

The likelihood is that of normal errors, ``exp(-chi2 / 2)``, with the responses predicted by the
response surfaces within the region of the design. The profile likelihood of a parameter is the
least chi-squared over all other parameters (Venzon and Moolgavkar 1988). If it does not rise above
the quantile on both sides, the parameter is not practically identifiable (Raue et al. 2009). The
eigenvectors of the Fisher information are combinations of parameters whose errors are uncorrelated.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from ramiefenics.calibration.factors import Array, Space
from ramiefenics.calibration.misfit import LEVEL, Misfit

RISE = float(stats.chi2.ppf(LEVEL, 1))
"""Rise of chi-squared at the ends of the interval of one parameter, 3.84 (Wilks 1938)."""

GRID = 41
"""Number of parameter values in a profile."""

ROUNDING = 1e-12
"""Fraction of the largest eigenvalue below which another one counts as zero."""

EDGE = 1e-3
"""Fraction of the region's size within which a point counts as lying on the edge."""

NARROWER = 0.5
"""Ratio of the intervals of a parameter with the others fixed and adjusted, below which the ranges
of the others, not the data, set the ends of the latter."""

NEGLIGIBLE = 0.02
"""Share of a range; an end of an interval that cuts off less than this does not count."""

DETERMINED, ABOVE, BELOW, OPEN = "determined", "bounded below", "bounded above", "not determined"


@dataclass(frozen=True)
class Profile:
    """Rise of the misfit as one parameter is varied and all others are adjusted.

    Attributes
    ----------
    at
        Coded values of the parameter, over the whole region.
    rise
        Rise of chi-squared above its least value.
    low, high
        Ends of the 95 % interval, coded; None where the interval extends to the edge of the region.
    by_others
        For the lower and the upper end, whether it exists only because the other parameters have
        reached the edge of the region and cannot compensate further, so that wider ranges of the
        others would move it far: the data alone, with the others fixed, leave less than half of the
        interval.
    at_edge
        Whether other parameters have reached the edge of the region at an end that the data set.
    """

    at: Array
    rise: Array
    low: float | None
    high: float | None
    by_others: tuple[bool, bool] = (False, False)
    at_edge: bool = False

    @property
    def verdict(self) -> str:
        """One of ``determined``, ``bounded below``, ``bounded above`` and ``not determined``."""
        below = self.low is not None and not self.by_others[0]
        above = self.high is not None and not self.by_others[1]
        if not below:
            return BELOW if above else OPEN
        return DETERMINED if above else ABOVE

    @property
    def share(self) -> float:
        """Share of the range that lies within the interval."""
        low = self.at[0] if self.low is None else self.low
        high = self.at[-1] if self.high is None else self.high
        return float((high - low) / (self.at[-1] - self.at[0]))


@dataclass(frozen=True)
class Information:
    """Fisher information at the optimum, in coded units.

    Attributes
    ----------
    eigenvalues
        Eigenvalues in descending order, shape (k,).
    directions
        Eigenvectors of unit length, one per row, shape (k, k); the entry of largest magnitude is
        positive.
    half_range
        Half the width of the region's box, `Region.reach`.
    """

    eigenvalues: Array
    directions: Array
    half_range: float

    @property
    def errors(self) -> Array:
        """Standard error along each direction, coded; infinite if the data say nothing."""
        with np.errstate(divide="ignore"):
            return np.asarray(1.0 / np.sqrt(self.eigenvalues))

    @property
    def determined(self) -> NDArray[np.bool_]:
        """Whether the 95 % interval along each direction is narrower than the region's box."""
        return np.asarray(math.sqrt(RISE) * self.errors < self.half_range)


def profile(misfit: Misfit, factor: int, best: Array) -> Profile:
    """Return the profile likelihood of one factor.

    Parameters
    ----------
    misfit
        Misfit between surfaces and targets.
    factor
        Index of the factor.
    best
        Point of least misfit, coded, shape (k,); its value of the factor is part of the profile.
    """
    reach = misfit.region.reach
    at = np.unique(np.append(np.linspace(-reach, reach, GRID), best[factor]))
    points, values = zip(*(misfit.least((factor, value)) for value in at), strict=True)
    least = np.array(values)
    rise = least - min(least.min(), float(misfit.of(best[None])[0]))
    low, high, first, last = _interval(at, rise)
    edge = (
        low is not None and _others_at_edge(misfit, factor, points[first - 1]),
        high is not None and _others_at_edge(misfit, factor, points[last + 1]),
    )
    whole = Profile(at, rise, low, high)
    fixed = np.tile(best, (len(at), 1))
    fixed[:, factor] = at
    alone = Profile(at, rise, *_interval(at, misfit.of(fixed) - (least - rise).min())[:2])
    if alone.share < NARROWER * whole.share:
        return replace(whole, by_others=edge)
    return replace(whole, at_edge=any(edge))


def _interval(at: Array, rise: Array) -> tuple[float | None, float | None, int, int]:
    """Return the ends of the interval, None at the edge, and its first and last index."""
    inside = np.flatnonzero(rise <= RISE)
    first, last = int(inside[0]), int(inside[-1])
    low = None if first == 0 else _crossing(at, rise, first, first - 1)
    high = None if last == len(at) - 1 else _crossing(at, rise, last, last + 1)
    least_cut = NEGLIGIBLE * (at[-1] - at[0])
    low = None if low is None or low - at[0] < least_cut else low
    high = None if high is None or at[-1] - high < least_cut else high
    return low, high, first, last


def _others_at_edge(misfit: Misfit, factor: int, point: Array) -> bool:
    """Return whether the adjusted factors have reached the edge of the region."""
    region, others = misfit.region, np.delete(point, factor)
    if not len(others):
        return False
    inside = 1.0 - EDGE
    at_bound = float(np.abs(others).max()) >= inside * region.reach
    return bool(at_bound or np.linalg.norm(point) >= inside * region.radius)


def _crossing(at: Array, rise: Array, inside: int, outside: int) -> float:
    """Return where the rise reaches its limit, by linear interpolation of its square root."""
    near, far = math.sqrt(max(rise[inside], 0.0)), math.sqrt(rise[outside])
    share = (math.sqrt(RISE) - near) / (far - near)
    return float(at[inside] + share * (at[outside] - at[inside]))


def information(misfit: Misfit, best: Array) -> Information:
    """Return the Fisher information ``J^T J`` of the whitened responses at a coded point."""
    jacobian = misfit.jacobian(best)
    values, vectors = np.linalg.eigh(jacobian.T @ jacobian)
    directions = vectors.T[::-1]
    largest = directions[np.arange(len(directions)), np.abs(directions).argmax(axis=1)]
    values = np.where(values < ROUNDING * values[-1], 0.0, values)
    return Information(
        values[::-1],
        directions * np.sign(largest)[:, None],
        misfit.region.reach,
    )


def in_words(
    space: Space,
    profiles: Sequence[Profile],
    found: Information,
    met: bool = True,
) -> list[str]:
    """Return which parameters the data determine, one sentence per finding.

    Parameters
    ----------
    space
        Factors with their coding.
    profiles
        Profile likelihood of each factor.
    found
        Fisher information at the optimum.
    met
        Whether the targets are met within their errors.
    """
    told = [_sentence(space, number, one, met) for number, one in enumerate(profiles)]
    determined = int(found.determined.sum())
    words = [_direction(space, row) for row in found.directions[:determined]]
    if not determined:
        told.append("Not even a combination of the parameters is determined.")
    elif determined < len(profiles):
        one = "One combination" if determined == 1 else f"{determined} combinations"
        verb = "is" if determined == 1 else "are"
        told.append(
            f"{one} of the {len(profiles)} parameters {verb} determined around the optimum: "
            f"{'; '.join(words)} (coded)."
        )
    return told


def _sentence(space: Space, number: int, found: Profile, met: bool) -> str:
    name = space.names[number]

    def natural(coded: float) -> str:
        point = np.zeros(len(space.factors))
        point[number] = coded
        return f"{space.natural(point)[number]:.4g}"

    ends = [found.at[0] if found.low is None else found.low]
    ends.append(found.at[-1] if found.high is None else found.high)
    low, high = natural(ends[0]), natural(ends[1])
    if found.verdict == OPEN and any(found.by_others):
        return (
            f"{name} is not determined by these data: it is kept between {low} and {high} only by "
            "the ranges of the other parameters, which cannot compensate any further."
        )
    if found.verdict == OPEN:
        equal = (
            "fit equally well within the errors"
            if met
            else "miss the targets equally, once the misfit that remains counts as an error"
        )
        return (
            f"{name} is not determined by these data: with the others adjusted, all values from "
            f"{low} to {high}, the ends of its range, {equal}."
        )
    if found.verdict == DETERMINED:
        others = ", ".join(other for other in space.names if other != name)
        within = f", within the ranges given for {others}" if found.at_edge else ""
        left = f"{100.0 * found.share:.0f} % of its range"
        return f"{name} is determined{within}: {low} to {high} (95 %), which is {left}."
    side = f"at least {low}" if found.verdict == ABOVE else f"at most {high}"
    return (
        f"{name} is bounded on one side only: {side} (95 %); on the other side only the ranges of "
        "the parameters limit it."
    )


def _direction(space: Space, row: Array) -> str:
    parts = [
        f"{value:+.2f} {name}"
        for value, name in zip(row, space.names, strict=True)
        if abs(value) >= 0.05
    ]
    return " ".join(parts).removeprefix("+")

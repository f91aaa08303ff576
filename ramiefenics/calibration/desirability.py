"""Desirability: several goals for responses as one number (Derringer and Suich 1980)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import optimize

from ramiefenics.calibration.factors import Array, Space
from ramiefenics.calibration.region import Region
from ramiefenics.calibration.responses import response
from ramiefenics.calibration.surface import Surface
from ramiefenics.specification import BendingTest, SpecificationError
from ramiefenics.specification.checks import check_choice, check_number

KINDS = ("target", "maximum", "minimum")


@dataclass(frozen=True)
class Goal:
    """A goal for a response.

    Attributes
    ----------
    kind
        ``target``, ``maximum`` or ``minimum``.
    low
        Lower limit of the acceptable range. The desirability of a maximum is 0 up to here; that of
        a minimum is 1.
    high
        Upper limit of the acceptable range. The desirability of a maximum is 1 from here on; that
        of a minimum is 0.
    target
        Best value, for the kind ``target``.
    exponent
        Exponent of the desirability (s and t, or r, in the paper): above 1 to penalise small
        deviations, below 1 to tolerate them.
    """

    kind: str
    low: float
    high: float
    target: float | None = None
    exponent: float = 1.0

    def __post_init__(self) -> None:
        """Check the kind and the order of the numbers."""
        check_choice(self, "kind", KINDS)
        check_number(self, "low")
        check_number(self, "high", above=self.low)
        check_number(self, "exponent", above=0.0)
        if self.target is not None:
            check_number(self, "target")
        inside = self.target is not None and self.low < self.target < self.high
        if self.kind == "target" and not inside:
            raise SpecificationError("target", self.target, "must lie between low and high")

    def desirability(self, value: Array) -> Array:
        """Return the desirability, 0 to 1, of responses (Derringer and Suich, Eqs. 4 and 5)."""
        if self.kind == "maximum":
            share = (value - self.low) / (self.high - self.low)
        elif self.kind == "minimum":
            share = (self.high - value) / (self.high - self.low)
        else:
            assert self.target is not None  # checked above
            falling = (self.high - value) / (self.high - self.target)
            share = np.minimum((value - self.low) / (self.target - self.low), falling)
        return np.asarray(np.clip(share, 0.0, 1.0) ** self.exponent)


@dataclass(frozen=True)
class Desired:
    """The most desirable parameters.

    Attributes
    ----------
    space
        Factors of the surfaces, with their coding.
    surfaces, goals
        Surfaces of the responses that have a goal, and these goals.
    best
        The most desirable point, coded, shape (k,).
    desirability
        Overall desirability at that point; 0 if no point meets all goals.
    test
        Specification at that point.
    """

    space: Space
    surfaces: tuple[Surface, ...]
    goals: tuple[Goal, ...]
    best: Array
    desirability: float
    test: BendingTest

    def of(self, points: Array) -> Array:
        """Return the overall desirability, shape (n,), at coded points of shape (n, k)."""
        return overall(self.surfaces, self.goals, points)

    def in_words(self) -> str:
        """Return the most desirable point as a sentence."""
        if self.desirability == 0.0:
            return "No point of the region meets all goals: the desirability is 0 everywhere."
        at = self.space.natural(self.best)
        values = ", ".join(f"{n} = {v:.4g}" for n, v in zip(self.space.names, at, strict=True))
        there = ", ".join(
            f"{response(s.response).title} {s.predict(self.best[None])[0]:.4g} "
            f"{response(s.response).unit}"
            for s in self.surfaces
        )
        return f"Most desirable point ({self.desirability:.3g} of 1): {values}, with {there}."

    def numbers(self) -> dict[str, Any]:
        """Return the most desirable point and its desirability."""
        best = self.space.natural(self.best)
        return {
            "natural": dict(zip(self.space.names, best, strict=True)),
            "desirability": self.desirability,
        }


def overall(surfaces: Sequence[Surface], goals: Sequence[Goal], points: Array) -> Array:
    """Return the geometric mean of all desirabilities at coded points of shape (n, k)."""
    desirability = [g.desirability(s.predict(points)) for s, g in zip(surfaces, goals, strict=True)]
    return np.asarray(np.prod(desirability, axis=0) ** (1.0 / len(desirability)))


def most_desirable(
    surfaces: Sequence[Surface], goals: Sequence[Goal], region: Region, seed: int = 0
) -> tuple[Array, float]:
    """Return the most desirable point of a region, coded, and its overall desirability.

    The search uses differential evolution (Storn and Price 1997), because desirabilities have
    kinks and flat parts, and then a simplex (Nelder and Mead 1965). The desirability is 0 if no
    point meets all goals.
    """

    def loss(point: Array) -> float:
        return -float(overall(surfaces, goals, region.pull_in(point[None]))[0])

    rough = optimize.differential_evolution(
        loss, region.bounds, seed=seed, init="sobol", popsize=20, tol=1e-8, polish=False
    )
    options = {"xatol": 1e-6, "fatol": 1e-10, "maxiter": 2000}
    found = optimize.minimize(loss, rough.x, method="Nelder-Mead", options=options)
    return region.pull_in(found.x[None])[0], -float(found.fun)

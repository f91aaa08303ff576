"""Designs of experiments in coded units."""

from __future__ import annotations

import functools
import itertools
import math
import string
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pandas as pd
import pyDOE3
from scipy.stats import qmc

from ramiefenics.calibration.factors import Array, Space
from ramiefenics.calibration.region import Region, sobol_points
from ramiefenics.specification import SpecificationError
from ramiefenics.specification.checks import check_choice, check_integer

FULL_CUBE = 4
"""Largest number of factors for which a central composite design has all corners of the cube.

With more factors it has half of the corners, a fraction of resolution V or more, which still tells
all two-factor interactions apart (Box and Hunter 1961).
"""

MOST_FACTORS = 10
"""Largest number of factors of a central composite design: 532 runs and the centre points."""


@dataclass(frozen=True)
class Design:
    """A design of experiments.

    Attributes
    ----------
    kind
        Name of the kind of design, as text.
    coded
        Points to simulate, in coded units, shape (n, k).
    alpha
        Distance of the axial points from the centre; None if there are none.
    """

    kind: str
    coded: Array
    alpha: float | None = None

    @property
    def region(self) -> Region:
        """Region in which a response surface may be trusted; without axial points the whole box."""
        if self.alpha is None:
            number = self.coded.shape[1]
            return Region(number, 1.0, math.sqrt(number))
        return Region.of(self.coded)

    def table(self, space: Space) -> pd.DataFrame:
        """Return one row per run: its number, the coded values and the natural values."""
        natural = space.natural(self.coded)
        table = pd.DataFrame({"run": np.arange(1, len(self.coded) + 1)})
        for column, name in enumerate(space.names):
            table[f"{name}_coded"] = self.coded[:, column]
        for column, name in enumerate(space.names):
            table[name] = natural[:, column]
        return table


def central_composite(number: int, alpha: str | float = "rotatable", centres: int = 6) -> Design:
    """Return a central composite design (Box and Wilson 1951).

    Parameters
    ----------
    number
        Number of factors, 2 to 10.
    alpha
        Distance of the axial points from the centre: a number, or ``face`` for 1, or ``rotatable``
        for the fourth root of the number of corners (Box and Hunter 1957), for which the variance
        of a prediction depends only on the distance from the centre.
    centres
        Number of centre points.

    Raises
    ------
    SpecificationError
        If one of the arguments is invalid.
    """
    if not 2 <= number <= MOST_FACTORS:
        allowed = f"must be 2 to {MOST_FACTORS} for a central composite design"
        raise SpecificationError("factors", number, f"{allowed}; screen the factors first")
    if centres < 0:
        raise SpecificationError("centres", centres, "must be 0 or more")
    words = list(string.ascii_lowercase[:number])
    if number > FULL_CUBE:
        words[-1] = "".join(words[:-1])
    cube = pyDOE3.fracfact(" ".join(words))
    distance = _axial_distance(alpha, len(cube))
    axes = [s * distance * row for row, s in itertools.product(np.eye(number), (-1.0, 1.0))]
    points = np.vstack([cube, axes, np.zeros((centres, number))])
    return Design("central composite", np.asarray(points, dtype=np.float64), distance)


def _axial_distance(alpha: str | float, corners: int) -> float:
    if alpha == "rotatable":
        return float(corners**0.25)
    if alpha == "face":
        return 1.0
    if isinstance(alpha, bool) or not isinstance(alpha, (int, float)) or not 0.0 < alpha < math.inf:
        raise SpecificationError("alpha", alpha, "must be 'rotatable', 'face' or a number above 0")
    return float(alpha)


def plackett_burman(number: int) -> Design:
    """Return a two-level design for main effects (Plackett and Burman 1946).

    The number of runs is the next multiple of 4 above the number of factors. All columns are
    orthogonal. Main effects are aliased with interactions.

    Raises
    ------
    SpecificationError
        If there is no factor, or the number of runs is not 4, 12 or 20 times a power of two.
    """
    if number < 1:
        raise SpecificationError("factors", number, "must be at least 1")
    try:
        points = np.asarray(pyDOE3.pbdesign(number), dtype=np.float64)
    except (AssertionError, ValueError):
        allowed = "must have 4, 12 or 20 times a power of two as the next multiple of 4"
        raise SpecificationError("factors", number, allowed) from None
    return Design("Plackett-Burman", points)


@functools.cache  # a study makes its design several times, and this one takes a second
def latin_hypercube(number: int, runs: int, seed: int = 0) -> Design:
    """Return a Latin hypercube of low discrepancy in [-1, 1] (McKay, Beckman and Conover 1979)."""
    _check_runs(runs)
    sampler = qmc.LatinHypercube(number, seed=seed, optimization="random-cd")
    return Design("Latin hypercube", np.asarray(2.0 * sampler.random(runs) - 1.0))


def sobol(number: int, runs: int, seed: int = 0) -> Design:
    """Return the first points of a scrambled Sobol sequence in [-1, 1] (Sobol 1967; Owen 1998).

    Sequences are best balanced if the number of runs is a power of two.
    """
    _check_runs(runs)
    return Design("Sobol", sobol_points(number, runs, seed))


def _check_runs(runs: int) -> None:
    if runs < 2:
        raise SpecificationError("runs", runs, "must be at least 2")


KINDS = ("central_composite", "plackett_burman", "latin_hypercube", "sobol")


@dataclass(frozen=True)
class DesignChoice:
    """Choice of a design, as written in a study.

    Attributes
    ----------
    kind
        Kind of design, one of `KINDS`.
    alpha
        Distance of the axial points from the centre, see `central_composite`.
    centres
        Number of repeats of the centre, see `central_composite`.
    ends
        For a central composite design, what `low` and `high` of the factors are: the ``axial``
        points, so that no run lies outside the range, or the corners of the ``cube``.
    runs
        Number of runs of a Latin hypercube or a Sobol sequence.
    seed
        Seed of its random numbers.
    """

    kind: str = "central_composite"
    alpha: str | float = "rotatable"
    centres: int = 6
    ends: str = "axial"
    runs: int = 20
    seed: int = 0

    def __post_init__(self) -> None:
        """Check choices and numbers."""
        check_choice(self, "kind", KINDS)
        check_choice(self, "ends", ("axial", "cube"))
        check_integer(self, "centres", 0)
        check_integer(self, "runs", 2)
        check_integer(self, "seed", 0)

    def make(self, number: int) -> Design:
        """Return the design for a given number of factors."""
        if self.kind == "central_composite":
            return central_composite(number, self.alpha, self.centres)
        if self.kind == "plackett_burman":
            return plackett_burman(number)
        random: Callable[..., Design] = sobol if self.kind == "sobol" else latin_hypercube
        return random(number, self.runs, self.seed)

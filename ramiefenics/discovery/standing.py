"""Stalks that stand for others like them, where a change of the specification is simulated.

What a suspect changes of the force, in proportion to it, is nearly the same for stalks of nearly
the same proportions. So it is simulated for a few, and carried over to the others.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.interpolate import Akima1DInterpolator

from ramiefenics.discovery.blocks import Array
from ramiefenics.runs.curve import REMEMBERED, normalised
from ramiefenics.specification import BendingTest, SpecificationError
from ramiefenics.surrogate.coordinates import Path, coordinates, numbers, rest_of

NEAR = 0.3
"""Largest difference of a coordinate, for lengths and moduli of its logarithm, between a stalk and
one that stands for it."""

ALIKE = 0.1
"""Largest part of a change that is not in proportion to the other's, over the change."""

LARGER = 2.0
"""Largest ratio of changes."""

ROUNDING = 1e-9
"""Difference of logarithms that is none."""


@dataclass(frozen=True)
class Place:
    """A normalised specification as coordinates, and what else there is of it.

    Attributes
    ----------
    rest
        All but the numbers, as text.
    paths
        Where the numbers are.
    at
        Coordinates, shape (d,).
    log_factor
        Logarithm of the factor to its forces.
    """

    rest: str
    paths: tuple[Path, ...]
    at: Array
    log_factor: float

    @classmethod
    @functools.lru_cache(maxsize=REMEMBERED)
    def of(cls, test: BendingTest) -> Place:
        """Return that of a specification."""
        test, factor = normalised(test)
        values = numbers(test)
        paths = tuple(values)
        return cls(rest_of(test), paths, coordinates(values, paths), math.log(factor))

    def same_kind(self, other: Place) -> bool:
        """Return whether they differ by numbers only."""
        return self.rest == other.rest and self.paths == other.paths

    def is_at(self, other: Place) -> bool:
        """Return whether they differ by the factor to their forces at most."""
        return self.same_kind(other) and not (self.at - other.at).any()

    def near(self, other: Place) -> bool:
        """Return whether they differ by little."""
        return self.same_kind(other) and bool(np.abs(self.at - other.at).max() < NEAR)


@dataclass(frozen=True)
class Standing:
    """Which curve stands for which, where all are changed.

    Attributes
    ----------
    by
        The one that stands for each, itself where none else does, shape (r,).
    size
        The change of each over that of the one that stands for it, shape (r,).
    """

    by: NDArray[np.intp]
    size: Array

    @classmethod
    def of(cls, before: Sequence[Place], after: Sequence[Place]) -> Standing:
        """Choose, where possible those in the middle.

        Parameters
        ----------
        before, after
            The specifications of all curves, as they are and changed.
        """
        by, size = np.arange(len(before)), np.ones(len(before))
        left = _from_the_middle(before)
        while left:
            first, *others = left
            left = []
            for i in others:
                found = _size((before[i], after[i]), (before[first], after[first]))
                if found is None:
                    left.append(i)
                else:
                    by[i], size[i] = first, found
        return cls(by, size)

    @property
    def chosen(self) -> list[int]:
        """Those that stand for themselves."""
        return [i for i, j in enumerate(self.by) if i == j]

    def changes(
        self, curves: Sequence[pd.DataFrame], shares: Mapping[int, tuple[Array, Array]]
    ) -> list[Array]:
        """Return changes of all forces, N.

        Parameters
        ----------
        curves
            As they are.
        shares
            Of those that are chosen: displacements (mm), and the change over the force there.
        """
        each = zip(curves, self.by, self.size, strict=True)
        return [
            size * curve["force_N"].to_numpy() * np.interp(curve["displacement_mm"], *shares[i])
            for curve, i, size in each
        ]


def change_of(before: pd.DataFrame, after: pd.DataFrame) -> tuple[Array, Array]:
    """Return displacements, mm, and what has changed over the force there.

    Raises
    ------
    SpecificationError
        Where there is no force at all.
    """
    x, force = _loaded(before, "displacement_mm", "force_N")
    there = after["displacement_mm"]
    changed = Akima1DInterpolator(there, after["force_N"])(np.minimum(x, there.iloc[-1]))
    return x, changed / force - 1.0


def slope_of(curve: pd.DataFrame, name: str) -> tuple[Array, Array]:
    """Return displacements, mm, and the derivative in a column over the force there.

    Raises
    ------
    SpecificationError
        Where there is no force at all.
    """
    x, force, slope = _loaded(curve, "displacement_mm", "force_N", name)
    return x, slope / force


def _loaded(curve: pd.DataFrame, *columns: str) -> Array:
    loaded = curve.loc[curve["force_N"] > 0.0, list(columns)]
    if loaded.empty:
        raise SpecificationError(
            "force_N", float(curve["force_N"].max()), "must be above 0 somewhere on a curve"
        )
    return loaded.to_numpy().T


def _from_the_middle(places: Sequence[Place]) -> list[int]:
    """Return their numbers, those first that are nearest to the mean of those near them."""
    away = np.zeros(len(places))
    for i, place in enumerate(places):
        near = [other.at for other in places if place.near(other)]
        away[i] = np.abs(place.at - np.mean(near, axis=0)).max()
    return [int(i) for i in np.argsort(away, kind="stable")]


def _size(of: tuple[Place, Place], to: tuple[Place, Place]) -> float | None:
    """Return one change over another; None where the other does not stand for it."""
    (before, after), (other_before, other_after) = of, to
    if not before.near(other_before) or not after.same_kind(other_after):
        return None
    scaled, other_scaled = (b.log_factor - a.log_factor for a, b in (of, to))
    if before.paths != after.paths:  # there are other parts
        alike = abs(scaled - other_scaled) < ROUNDING and after.near(other_after)
        return 1.0 if alike else None
    change, other = after.at - before.at, other_after.at - other_before.at
    if not other.any():  # it differs by other things than numbers, or needs no simulation
        alike = not change.any() and scaled == other_scaled
        return 1.0 if alike and after.rest != before.rest else None
    change, other = np.append(change, scaled), np.append(other, other_scaled)
    size = float(change @ other / (other @ other))
    apart = np.linalg.norm(change - size * other)
    alike = 1.0 / LARGER < size < LARGER and apart <= ALIKE * np.linalg.norm(change)
    return size if alike else None

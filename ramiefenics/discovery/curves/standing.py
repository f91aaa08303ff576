"""Representative stalks, for which a change of the specification is simulated.

The relative change of the force by a suspect is nearly the same for stalks of nearly the same
proportions. It is therefore simulated for a few stalks, and carried over to the others.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.interpolate import Akima1DInterpolator

from ramiefenics.discovery.curves.blocks import Array
from ramiefenics.runs.curve import REMEMBERED, normalised
from ramiefenics.specification import BendingTest, SpecificationError
from ramiefenics.specification.replacing import Path
from ramiefenics.surrogate.coordinates import coordinates, numbers, rest_of
from ramiefenics.surrogate.smoothing import smoothed

NEAR = 0.3
"""Largest difference of a coordinate (for lengths and moduli, the logarithm) between a stalk and
one that stands for it."""

ALIKE = 0.1
"""Largest part of a change that is not in proportion to another one, relative to the change."""

LARGER = 2.0
"""Largest ratio between the sizes of two changes."""


@dataclass(frozen=True)
class Place:
    """Coordinates of a normalised specification, and the rest of it.

    Attributes
    ----------
    rest
        Everything but the numbers, as text.
    paths
        Paths of the numbers within the specification.
    at
        Coordinates, shape (d,).
    log_factor
        Logarithm of the factor on its forces.
    """

    rest: str
    paths: tuple[Path, ...]
    at: Array
    log_factor: float

    @classmethod
    @functools.lru_cache(maxsize=REMEMBERED)
    def of(cls, test: BendingTest) -> Place:
        """Return the place of a specification."""
        test, factor = normalised(test)
        values = numbers(test)
        paths = tuple(values)
        return cls(rest_of(test), paths, coordinates(values, paths), math.log(factor))

    def same_kind(self, other: Place) -> bool:
        """Return whether two places differ only in numbers."""
        return self.rest == other.rest and self.paths == other.paths

    def is_at(self, other: Place) -> bool:
        """Return whether two places differ at most in the factor on their forces."""
        return self.same_kind(other) and not (self.at - other.at).any()

    def near(self, other: Place) -> bool:
        """Return whether two places differ only in numbers, and by less than `NEAR`."""
        return self.same_kind(other) and bool(np.abs(self.at - other.at).max() < NEAR)


@dataclass(frozen=True)
class Standing:
    """Which curve stands for which, where all are changed.

    Attributes
    ----------
    by
        Index of the curve that stands for each; its own where no other does, shape (r,).
    size
        Change of each specification relative to that of the one that stands for it, shape (r,).
    """

    by: NDArray[np.intp]
    size: Array

    @classmethod
    def of(cls, before: Sequence[Place], after: Sequence[Place]) -> Standing:
        """Choose representatives, where possible in the middle of those that they stand for.

        Parameters
        ----------
        before, after
            Specifications of all curves, before and after the change.
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
        """Indices of the curves that stand for themselves."""
        return [i for i, j in enumerate(self.by) if i == j]


def change_of(before: pd.DataFrame, after: pd.DataFrame) -> tuple[Array, Array]:
    """Return displacements, mm, and the relative change of the force there.

    Raises
    ------
    SpecificationError
        If the force is above zero nowhere.
    """
    x, force = _loaded(before, "displacement_mm", "force_N")
    there = after["displacement_mm"]
    changed = Akima1DInterpolator(there, after["force_N"])(np.minimum(x, there.iloc[-1]))
    return x, changed / force - 1.0


def slope_of(curve: pd.DataFrame, name: str) -> tuple[Array, Array]:
    """Return displacements, mm, and the derivative in a column, smoothed, relative to the force.

    Raises
    ------
    SpecificationError
        If the force is above zero nowhere.
    """
    x, force, slope = _loaded(curve, "displacement_mm", "force_N", name)
    return x, smoothed(x, force, slope) / force


def _loaded(curve: pd.DataFrame, *columns: str) -> Array:
    loaded = curve.loc[curve["force_N"] > 0.0, list(columns)]
    if loaded.empty:
        raise SpecificationError(
            "force_N", float(curve["force_N"].max()), "must be above 0 somewhere on the curve"
        )
    return loaded.to_numpy().T


def _from_the_middle(places: Sequence[Place]) -> list[int]:
    """Return the indices of places, those nearest to the mean of their neighbours first."""
    away = np.zeros(len(places))
    kinds: dict[tuple[str, tuple[Path, ...]], list[int]] = {}
    for i, place in enumerate(places):
        kinds.setdefault((place.rest, place.paths), []).append(i)
    for indices in kinds.values():
        at = np.array([places[i].at for i in indices])
        for i in indices:
            near = np.abs(at - places[i].at).max(axis=1) < NEAR
            away[i] = np.abs(places[i].at - at[near].mean(axis=0)).max()
    return [int(i) for i in np.argsort(away, kind="stable")]


def _size(of: tuple[Place, Place], to: tuple[Place, Place]) -> float | None:
    """Return the size of one change relative to another; None if that does not stand for it.

    A factor on all forces is left out, as it is known without any simulation.
    """
    (before, after), (other_before, other_after) = of, to
    if not before.near(other_before) or not after.same_kind(other_after):
        return None
    if before.paths != after.paths:  # the numbers are not the same ones
        return 1.0 if after.near(other_after) else None
    change, other = after.at - before.at, other_after.at - other_before.at
    if not other.any():  # more than numbers changes, or no simulation is needed
        return 1.0 if not change.any() and after.rest != before.rest else None
    size = float(change @ other / (other @ other))
    apart = np.linalg.norm(change - size * other)
    alike = 1.0 / LARGER < size < LARGER and apart <= ALIKE * np.linalg.norm(change)
    return size if alike else None

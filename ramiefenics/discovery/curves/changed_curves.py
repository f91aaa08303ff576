"""Curves of changed stalks, from those before the change and simulations of a few."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from ramiefenics.discovery.curves.blocks import Array
from ramiefenics.discovery.curves.standing import Place, Standing, change_of, slope_of
from ramiefenics.runs.curve import normalised, stiffer
from ramiefenics.specification import BendingTest, SpecificationError
from ramiefenics.specification.replacing import Path, replaced
from ramiefenics.surrogate.coordinates import Direction, numbers
from ramiefenics.surrogate.directions import combinations, components, spanning


@dataclass(frozen=True)
class Nearby:
    """Differences between a representative and the stalks for which it stands.

    Attributes
    ----------
    directions
        Directions along which the representative's curve is differentiated.
    weights
        Weights with which they add up to the differences, shape (n, q).
    """

    directions: tuple[Direction, ...]
    weights: Array

    @classmethod
    def of(cls, paths: Sequence[Path], apart: Array, size: Array) -> Nearby:
        """Choose the directions for differences of coordinates, see `spanning`."""
        directions = spanning(paths, apart, size)
        return cls(directions, combinations(apart, components(directions, paths)))

    def known(self, curve: pd.DataFrame) -> bool:
        """Return whether a curve has the derivatives."""
        return all(one.name in curve for one in self.directions)

    def changes(self, curve: pd.DataFrame, at_mm: Array) -> Array:
        """Return the changes of the logarithm of the force to the stalks, shape (n, m)."""
        slopes = [_relative_slope(curve, one.name, at_mm) for one in self.directions]
        return np.asarray(self.weights @ np.reshape(slopes, (-1, len(at_mm))))


@dataclass(frozen=True)
class Represented:
    """Stalks for which one of them stands, where all are changed.

    Attributes
    ----------
    stalks
        Their indices.
    sizes
        Changes relative to that of the representative, shape (n,).
    before, after
        What leads from the representative to these stalks before and after the change.
    """

    stalks: tuple[int, ...]
    sizes: Array
    before: Nearby
    after: Nearby

    @classmethod
    def of(
        cls, first: int, stalks: Sequence[int], sizes: Array, places: Sequence[tuple[Place, Place]]
    ) -> Represented:
        """Find what leads from the representative, ``first``, to all stalks, itself included."""
        whole = places[first][1].at - places[first][0].at if (sizes != 1.0).any() else 0.0
        nearby = []
        for part, excess in ((0, 0.0), (1, np.outer(sizes - 1.0, whole))):
            at = np.array([places[i][part].at for i in stalks])
            apart = at - places[first][part].at - excess
            nearby.append(Nearby.of(places[first][part].paths, apart, np.abs(at).max(axis=0)))
        return cls(tuple(stalks), sizes, *nearby)

    def ratios(
        self, before: pd.DataFrame, after: pd.DataFrame, factor: float
    ) -> tuple[Array, Array]:
        """Return displacements, mm, and the ratios of the forces of all stalks there, (n, m).

        Factors on all moduli, which are each stalk's own, are left out of the ratios.

        Parameters
        ----------
        before, after
            Curves of the representative.
        factor
            Change of its forces by such a factor.
        """
        x, share = change_of(*_as_far(before, after))
        ratios = 1.0 + self.sizes[:, None] * ((1.0 + share) / factor - 1.0)
        if self.before.known(before) and self.after.known(after):
            ratios *= np.exp(self.after.changes(after, x) - self.before.changes(before, x))
        return x, ratios


@dataclass(frozen=True)
class Carried:
    """Changes of specifications: which are simulated, and how they are carried over to the others.

    The logarithm of the ratio of forces after and before a change is linear in the differences
    between a representative and the stalks for which it stands, where the derivatives of its curves
    are known. Otherwise the ratio is the same.

    Attributes
    ----------
    scaling
        Relative change of all forces of every stalk by a factor on all of its moduli.
    represented
        Stalks that change by more than such a factor, by the index of the one that stands for them.
    """

    scaling: Array
    represented: Mapping[int, Represented]

    @classmethod
    def of(cls, before: Sequence[BendingTest], after: Sequence[BendingTest]) -> Carried:
        """Choose which stalks are simulated.

        Parameters
        ----------
        before, after
            Specifications before and after the change.
        """
        places = [
            (Place.of(one), Place.of(other)) for one, other in zip(before, after, strict=True)
        ]
        scaling = np.expm1([other.log_factor - one.log_factor for one, other in places])
        moved = np.array([i for i, (one, other) in enumerate(places) if not one.is_at(other)])
        standing = Standing.of([places[i][0] for i in moved], [places[i][1] for i in moved])
        represented = {}
        for first in standing.chosen:
            own = standing.by == first
            stalks = [int(i) for i in moved[own]]
            i = int(moved[first])
            represented[i] = Represented.of(i, stalks, standing.size[own], places)
        return cls(scaling, represented)

    def changed(
        self, curves: Sequence[pd.DataFrame], simulated: Mapping[int, tuple[pd.DataFrame, ...]]
    ) -> list[pd.DataFrame]:
        """Return the changed curves.

        Their derivatives change in proportion to the forces and, where those of both curves of the
        representative are known, as its derivatives do relative to its forces.

        Parameters
        ----------
        curves
            Curves before the change: ``displacement_mm``, ``force_N``, and derivatives.
        simulated
            Curves before and after the change of the stalks that stand for others, by index.

        Raises
        ------
        SpecificationError
            If a changed stalk does not get as far as the unchanged one.
        """
        found = [
            curve.assign(**curve.drop(columns="displacement_mm") * (1.0 + share))
            for curve, share in zip(curves, self.scaling, strict=True)
        ]
        for first, represented in self.represented.items():
            before, after = simulated[first]
            x, ratios = represented.ratios(before, after, 1.0 + self.scaling[first])
            names = curves[first].columns.intersection(before.columns).intersection(after.columns)
            more = {
                str(name): _relative_slope(after, name, x) - _relative_slope(before, name, x)
                for name in names[2:]
            }
            for i, ratio in zip(represented.stalks, ratios, strict=True):
                at = curves[i]["displacement_mm"].to_numpy()
                whole = found[i].drop(columns="displacement_mm")
                whole = whole.mul(np.interp(at, x, ratio), axis=0)
                for name, slope in more.items():
                    whole[name] += whole["force_N"] * np.interp(at, x, slope)
                found[i] = curves[i].assign(**whole)
        return found


def following(before: Sequence[BendingTest], after: Sequence[BendingTest]) -> list[BendingTest]:
    """Return specifications changed only in the numbers by which they differ among themselves.

    Curves are learned as functions of the numbers by which specimens differ, such as diameters, so
    this part of a change needs few simulations, or none.

    Parameters
    ----------
    before, after
        Specifications before and after the whole change.
    """
    values: dict[tuple[Path, ...], list[Mapping[Path, float]]] = {}
    normal = [numbers(normalised(test)[0]) for test in before]
    for old in normal:
        values.setdefault(tuple(old), []).append(old)
    varied = {
        paths: [path for path in paths if len({one[path] for one in alike}) > 1]
        for paths, alike in values.items()
    }
    each = zip(before, after, normal, strict=True)
    return [_following(test, other, varied[tuple(old)]) for test, other, old in each]


def _following(test: BendingTest, other: BendingTest, varied: Sequence[Path]) -> BendingTest:
    """Return a specification with some numbers of another one, and its overall stiffness."""
    (here, _), (there, factor) = normalised(test), normalised(other)
    old, new = numbers(here), numbers(there)
    changed = {path: new[path] for path in varied if path in new and new[path] != old[path]}
    if not changed or old.keys() != new.keys():
        return test
    try:
        return stiffer(replaced(here, changed), factor)
    except SpecificationError:  # these numbers are not possible without others
        return test


def _as_far(curve: pd.DataFrame, changed: pd.DataFrame) -> tuple[pd.DataFrame, pd.DataFrame]:
    wanted, reached = (c["displacement_mm"].iloc[-1] for c in (curve, changed))
    if reached < wanted - 1e-9:
        allowed = f"must be reached, but the simulation ends at {reached:.2f} mm"
        raise SpecificationError("displacement_mm", float(wanted), allowed)
    return curve, changed


def _relative_slope(curve: pd.DataFrame, name: str, at_mm: Array) -> Array:
    """Return the derivative in a column relative to the force, at displacements."""
    return np.interp(at_mm, *slope_of(curve, name)).astype(float)

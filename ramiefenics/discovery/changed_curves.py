"""Curves of changed stalks, from those before the change and simulations of a few."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from ramiefenics.discovery.blocks import Array
from ramiefenics.discovery.standing import Place, Standing, change_of
from ramiefenics.runs.curve import normalised, stiffer
from ramiefenics.specification import BendingTest, SpecificationError
from ramiefenics.specification.replacing import Path, replaced
from ramiefenics.surrogate.coordinates import numbers


@dataclass(frozen=True)
class Carried:
    """Changes of specifications: which are simulated, and how they are carried over to the others.

    Attributes
    ----------
    scaling
        Relative change of all forces of every stalk by a factor on all of its moduli.
    moved
        Indices of stalks that change by more than such a factor.
    standing
        Which of these stalks stands for which.
    """

    scaling: Array
    moved: tuple[int, ...]
    standing: Standing

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
        moved = tuple(i for i, (one, other) in enumerate(places) if not one.is_at(other))
        standing = Standing.of([places[i][0] for i in moved], [places[i][1] for i in moved])
        return cls(scaling, moved, standing)

    @property
    def chosen(self) -> list[int]:
        """Indices of the stalks that are simulated."""
        return [self.moved[k] for k in self.standing.chosen]

    def changed(
        self, curves: Sequence[pd.DataFrame], simulated: Mapping[int, tuple[pd.DataFrame, ...]]
    ) -> list[pd.DataFrame]:
        """Return the changed curves; derivatives change in proportion to the forces.

        Parameters
        ----------
        curves
            Curves before the change: ``displacement_mm``, ``force_N``, and derivatives.
        simulated
            Curves before and after the change of the stalks that are chosen, by index.

        Raises
        ------
        SpecificationError
            If a changed stalk does not get as far as the unchanged one.
        """
        shares = [np.full(len(c), s) for c, s in zip(curves, self.scaling, strict=True)]
        by = {
            k: change_of(*_as_far(*simulated[i]))
            for k, i in zip(self.standing.chosen, self.chosen, strict=True)
        }
        changes = self.standing.changes([curves[i] for i in self.moved], by)
        for i, change in zip(self.moved, changes, strict=True):
            force = curves[i]["force_N"].to_numpy()
            shares[i] = np.divide(change, force, out=np.zeros_like(change), where=force > 0.0)
        return [
            curve.assign(**curve.drop(columns="displacement_mm").mul(1.0 + share, axis=0))
            for curve, share in zip(curves, shares, strict=True)
        ]


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

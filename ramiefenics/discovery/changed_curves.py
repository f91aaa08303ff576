"""Curves of stalks that are changed, from those they had and simulations of a few."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import pandas as pd

from ramiefenics.discovery.blocks import Array
from ramiefenics.discovery.standing import Place, Standing, change_of
from ramiefenics.specification import BendingTest, SpecificationError


def changed_curves(
    curves: Sequence[pd.DataFrame],
    before: Sequence[BendingTest],
    after: Sequence[BendingTest],
    simulated: Callable[[Sequence[BendingTest]], Sequence[pd.DataFrame]],
) -> list[pd.DataFrame]:
    """Return what becomes of curves where specifications are changed.

    Derivatives change as the forces do.

    Parameters
    ----------
    curves
        ``displacement_mm``, ``force_N``, and derivatives.
    before, after
        Their specifications, as they are and changed.
    simulated
        Returns the curves of some specifications.

    Raises
    ------
    SpecificationError
        If a changed stalk does not get as far as the unchanged one.
    """
    places = [(Place.of(one), Place.of(other)) for one, other in zip(before, after, strict=True)]
    shares = [_scaling(curve, *pair) for curve, pair in zip(curves, places, strict=True)]
    moved = [i for i, (one, other) in enumerate(places) if not one.is_at(other)]
    if moved:
        standing = Standing.of([places[i][0] for i in moved], [places[i][1] for i in moved])
        chosen = [moved[k] for k in standing.chosen]
        answers = simulated([after[i] for i in chosen])
        by = {
            k: change_of(curves[i], _as_far(curves[i], answer))
            for k, i, answer in zip(standing.chosen, chosen, answers, strict=True)
        }
        changes = standing.changes([curves[i] for i in moved], by)
        for i, change in zip(moved, changes, strict=True):
            shares[i] = _over(change, curves[i])
    return [
        curve.assign(**curve.drop(columns="displacement_mm").mul(1.0 + share, axis=0))
        for curve, share in zip(curves, shares, strict=True)
    ]


def _scaling(curve: pd.DataFrame, before: Place, after: Place) -> Array:
    """Return what forces change by, over the force, where all moduli are scaled."""
    return np.full(len(curve), np.expm1(after.log_factor - before.log_factor))


def _over(change: Array, curve: pd.DataFrame) -> Array:
    force = curve["force_N"].to_numpy()
    return np.divide(change, force, out=np.zeros_like(change), where=force > 0.0)


def _as_far(curve: pd.DataFrame, changed: pd.DataFrame) -> pd.DataFrame:
    wanted, reached = (c["displacement_mm"].iloc[-1] for c in (curve, changed))
    if reached < wanted - 1e-9:
        allowed = f"must be reached, but the simulation ends at {reached:.2f} mm"
        raise SpecificationError("displacement_mm", float(wanted), allowed)
    return changed

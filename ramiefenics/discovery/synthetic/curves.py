"""Force curves of synthetic data sets, on meshes finer than those that analyse them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pandas as pd

from ramiefenics.discovery.curves.blocks import Array
from ramiefenics.discovery.curves.meshes import on_mesh
from ramiefenics.discovery.curves.observed import far_enough, recorded
from ramiefenics.discovery.curves.standing import change_of
from ramiefenics.runs.curve import CurveTask, Mapper, simulated
from ramiefenics.specification import BendingTest, MeshRecipe, Target

MESH = MeshRecipe(
    name="hidden",
    order=2,
    serendipity=True,
    angular_elements=14,
    side_growth=1.25,
    wall_elements=3,
    bore_growth=1.3,
    rind_elements=1,
    contact_size=0.025,
    contact_zone=0.06,
    growth=0.3,
    coarse_size=0.2,
)
"""Mesh recipe that differs from those that `discover` uses, and is finer, because real stalks have
no mesh."""

FINEST = replace(
    MESH,
    name="finest",
    angular_elements=22,
    side_growth=1.3,
    wall_elements=5,
    bore_growth=1.35,
)
"""Mesh recipe on which one stalk is simulated as well, to correct the forces on `MESH`. These are
too high by 5 % of the peak at 14 mm, where the section flattens and the bent sides of the void need
many cells, and by 0.3 % on average up to 10 mm; on `FINEST`, by 1 % and 0.2 %, compared with a mesh
that takes five times as long."""

STEEPEST = 0.1
"""Fall of the force per mm, relative to its peak, that regular curves do not have. On `FINEST` the
bore of half of the stalks folds into creases, from 12 to 14 mm on, at the sides of the flattened
void, and the force falls by 1 to 2 % each time. When it does depends on the cells."""

TREND_MM = 3.0
"""Range before such a fall from which the correction of the forces is extrapolated."""

ROW_MM = 0.05
"""Distance of the rows of a curve."""


def recorded_rows(
    stalks: Sequence[Sequence[BendingTest]],
    shown: Sequence[BendingTest],
    finest: MeshRecipe,
    ends: Sequence[float],
    runs: Mapper,
    unloaded: bool,
) -> list[tuple[Array, Array]]:
    """Return the recorded displacements of every test, up to its end, and the forces there.

    Those of unloading follow if wanted. The forces of every stalk are corrected by what the finest
    mesh changes of the tests `shown`.
    """
    tests = [test for own in stalks for test in own]
    finely = [on_mesh(test, finest) for test in shown]
    tasks = [CurveTask(far_enough(t, t.protocol.travel_mm)) for t in (*tests, *shown, *finely)]
    all_curves = simulated(runs, tasks)
    curves, both = all_curves[: len(tests)], all_curves[len(tests) :]
    pairs = zip(both[: len(shown)], both[len(shown) :], strict=True)
    shares = [_regular_change(*pair) for pair in pairs] * len(stalks)
    there = []
    for test, curve, share, end in zip(tests, curves, shares, ends, strict=True):
        at = np.linspace(0.0, end, 1 + round(end / ROW_MM))
        there.append((at, recorded(test, _corrected(curve, share), at)))
    if not unloaded:
        return there
    whole = []
    for test, curve, end in zip(tests, curves, ends, strict=True):
        travel = curve["displacement_mm"].to_numpy()
        displacement, _ = test.machine.recorded(travel, curve["force_N"].to_numpy())
        # the indenter turns at the last recorded displacement
        turn = float(np.interp(end, displacement, travel))
        protocol = replace(
            test.protocol, travel_mm=turn, save_every_mm=turn, then=(Target(to_mm=0.0),)
        )
        whole.append(replace(test, protocol=protocol))
    back = simulated(runs, [CurveTask(test) for test in whole])
    return [
        (
            np.append(at, at[-2::-1]),
            np.append(force, recorded(test, _corrected(curve, share), at[:-1])[::-1]),
        )
        for (at, force), test, curve, share in zip(there, whole, back, shares, strict=True)
    ]


def _regular_change(before: pd.DataFrame, after: pd.DataFrame) -> tuple[Array, Array]:
    """Return `change_of` up to where the force falls steeply, and its trend from there on."""
    at, force = (after[name].to_numpy() for name in ("displacement_mm", "force_N"))
    falls = np.diff(force) < -STEEPEST * force.max() * np.diff(at)
    if not falls.any():
        return change_of(before, after)
    first = int(falls.argmax())
    x, share = change_of(before, after.iloc[: first + 1])
    near = (x > at[first] - TREND_MM) & (x <= at[first])
    trend = np.polyval(np.polyfit(x[near], share[near], 1), x)
    return x, np.where(x <= at[first], share, trend)


def _corrected(curve: pd.DataFrame, share: tuple[Array, Array]) -> pd.DataFrame:
    factor = 1.0 + np.interp(curve["displacement_mm"], *share)
    return curve.assign(force_N=factor * curve["force_N"])

"""Prediction of curves of loading and of unloading together."""

from __future__ import annotations

import copy
import dataclasses
from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import TypeAlias

import numpy as np
import pandas as pd

from ramiefenics.discovery.curves.blocks import Array
from ramiefenics.discovery.curves.linearised import LOADED, Linearised, Model
from ramiefenics.discovery.curves.mesh_changes import MeshChanges
from ramiefenics.discovery.curves.observed import Observed
from ramiefenics.discovery.curves.prediction import Predictor
from ramiefenics.effects import Effect
from ramiefenics.runs.curve import Change, CurveTask, Mapper
from ramiefenics.specification import BendingTest
from ramiefenics.surrogate.coordinates import Direction


class UnloadingPredictor(Predictor):
    """Predictor of curves of unloading, which are simulated together with the loading before.

    The indenter turns at the measured displacement. Only when curves are confirmed is the
    deflection of the machine at that point subtracted; otherwise the indenter moves as far as the
    recorded displacement, so that an error of the machine needs no simulation.
    """

    def task(
        self, test: BendingTest, factors: tuple[Change, ...] = (), smooth: bool = False
    ) -> CurveTask:
        """Return the task of a curve, without derivatives."""
        protocol = dataclasses.replace(test.protocol, save_every_mm=test.protocol.travel_mm)
        return CurveTask(dataclasses.replace(test, protocol=protocol))

    def exact_tasks(self, tests: Sequence[BendingTest]) -> list[CurveTask]:  # noqa: D102
        forces = self._observed.turn_N
        if forces is None:
            return super().exact_tasks(tests)
        found = []
        for test, force in zip(tests, forces, strict=True):
            travel = test.machine.travel_mm(test.protocol.travel_mm, float(force))
            protocol = dataclasses.replace(test.protocol, travel_mm=float(travel))
            found.append(self.task(dataclasses.replace(test, protocol=protocol)))
        return found

    def _by_changes(
        self,
        changes: Sequence[Change],
        tests: Sequence[BendingTest],
        curves: Sequence[pd.DataFrame],
        force: Array,
    ) -> Array:
        return np.zeros((len(force), len(changes), force.shape[1]))


class BothWays:
    """Predictor of what the machine of a data set records of loading and unloading.

    Relative to the force, derivatives of unloading by factors are taken to be those of the loading
    at the same displacement, as for an elastic stalk without friction; they only guide the fit.

    Parameters
    ----------
    tests, observed, runs
        As for `Predictor`; a curve of unloading follows that of its loading.
    """

    def __init__(self, tests: Sequence[BendingTest], observed: Observed, runs: Mapper) -> None:
        back = np.array([bool(test.protocol.then) for test in tests])
        loading, unloading = np.flatnonzero(~back), np.flatnonzero(back)
        self._rows = (loading, unloading)
        self._before = np.searchsorted(loading, unloading) - 1
        self._at = tuple(observed.at_mm[rows] for rows in self._rows)
        kinds = (Predictor, UnloadingPredictor)
        self._parts = tuple(
            kind([tests[row] for row in rows], observed.of(rows), runs)
            for kind, rows in zip(kinds, self._rows, strict=True)
        )

    def rephrased(self, tests: Sequence[BendingTest], runs: Mapper | None = None) -> BothWays:
        """Return a predictor for other specifications, see `Predictor.rephrased`."""
        other = copy.copy(self)
        other._parts = tuple(
            part.rephrased([tests[row] for row in rows], runs)
            for part, rows in zip(self._parts, self._rows, strict=True)
        )
        return other

    @property
    def mesh_changes(self) -> MeshChanges:
        """What finer meshes change of the forces of loading."""
        return self._parts[0].mesh_changes

    def share_mesh_changes(self, first: MeshChanges) -> None:
        """Let a mesh change all curves alike, see `Predictor.share_mesh_changes`."""
        for part in self._parts:
            part.share_mesh_changes(first)

    def linearise(
        self,
        model: Model,
        suspects: Mapping[str, Effect],
        smooth: bool = False,
        roughly: bool = False,
        along: Mapping[str, Direction] = MappingProxyType({}),
    ) -> Linearised:
        """Find every curve with its derivatives, see `Predictor.linearise`.

        Unloading is simulated without derivatives, so all suspects are found by steps there.
        """
        loading, unloading = self._parts
        there = loading.linearise(model, suspects, smooth, roughly, along)
        back = unloading.linearise(model, suspects, smooth, roughly)
        names = [name for name in there.by_effects if name in back.by_effects]
        by_effects = {n: self._merged(there.by_effects[n], back.by_effects[n]) for n in names}
        return Linearised(
            model,
            self._merged(there.force, back.force),
            self._merged(there.mesh_correction, back.mesh_correction),
            self._merged(there.by_own, self._in_proportion(there.by_own, there, back)),
            self._merged(there.by_common, self._in_proportion(there.by_common, there, back)),
            self._merged(there.by_mesh, back.by_mesh),
            by_effects,
            {**back.refused, **there.refused},
        )

    def confirm(self, curves: Linearised, tolerance: float = 0.0) -> Linearised:
        """Return the same curves with all forces simulated, see `Predictor.confirm`."""
        there, back = (part.confirm(curves, tolerance) for part in self._parts)
        return dataclasses.replace(
            curves,
            force=self._merged(there.force, back.force),
            mesh_correction=self._merged(there.mesh_correction, back.mesh_correction),
            by_mesh=self._merged(there.by_mesh, back.by_mesh),
        )

    def _merged(self, there: Array, back: Array) -> Array:
        """Return the values of all curves, in the order of the tests."""
        whole = np.empty((len(there) + len(back), *there.shape[1:]))
        for rows, values in zip(self._rows, (there, back), strict=True):
            whole[rows] = values
        return whole

    def _in_proportion(self, by_factors: Array, there: Linearised, back: Linearised) -> Array:
        """Return derivatives of unloading, shape (u, k, m), given those of the loading."""
        found = np.empty_like(back.by_own)
        for row, of in enumerate(self._before):
            force, slopes = there.force[of], by_factors[of]
            shares = np.zeros_like(slopes)
            np.divide(slopes, force, out=shares, where=force > LOADED * force.max())
            at, known = self._at[1][row], self._at[0][of]
            each = np.array([np.interp(at, known, share) for share in shares])
            found[row] = each * back.force[row]
        return found


Predicting: TypeAlias = Predictor | BothWays


def predictor_of(tests: Sequence[BendingTest], observed: Observed, runs: Mapper) -> Predicting:
    """Return a predictor for curves, some of which may be of unloading."""
    back = any(test.protocol.then for test in tests)
    return BothWays(tests, observed, runs) if back else Predictor(tests, observed, runs)

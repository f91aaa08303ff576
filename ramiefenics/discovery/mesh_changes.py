"""What finer meshes change of the forces, and forces without discretisation error."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from functools import cached_property

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ramiefenics.discovery.blocks import Array, smooth
from ramiefenics.discovery.linearised import Model
from ramiefenics.discovery.meshes import finer, limit, on_mesh
from ramiefenics.discovery.signatures import first_possible
from ramiefenics.discovery.standing import Place, Standing, change_of
from ramiefenics.effects import Effect
from ramiefenics.runs.curve import CurveTask, Mapper, simulated
from ramiefenics.specification import BendingTest, Machine


class MeshChanges:
    """Relative changes that two finer meshes make of forces, by which these are extrapolated.

    The changes are those at displacements of the indenter; machine and seating are applied
    afterwards, to the extrapolated forces. What an effect adds to the change by the first finer
    mesh is found on the first curve on which it acts, and taken to be proportional to the
    amplitude.

    Parameters
    ----------
    tests
        Specifications of the curves.
    at_mm
        Displacements at which the changes are known, shape (r, m).
    task
        Returns the task of a curve.
    runs
        Computes tasks for curves.
    """

    def __init__(
        self,
        tests: Sequence[BendingTest],
        at_mm: Array,
        task: Callable[[BendingTest], CurveTask],
        runs: Mapper,
    ) -> None:
        self._tests, self._at, self._task, self._runs = list(tests), at_mm, task, runs
        self._by_effect: dict[str, Array] = {}

    def of(self, tests: Sequence[BendingTest], runs: Mapper) -> MeshChanges:
        """Return the same changes for other specifications; those by effects are found anew."""
        other = MeshChanges(tests, self._at, self._task, runs)
        other._first, other._last = self._first, self._last
        return other

    @cached_property
    def _first(self) -> Array:
        """Relative changes of the curves' forces on a finer mesh, shape (r, m)."""
        return self._changes_of(self._tests, self._at)[0]

    @cached_property
    def _last(self) -> Array:
        """Further changes on a mesh that is finer again, relative to the same forces, (r, m)."""
        first, second = self._changes_of(self._tests, self._at, meshes=3)
        return second - first

    def learn(self, model: Model) -> None:
        """Find what effects add to the mesh changes per amplitude, shape (r, m) each."""
        for name, (effect, _) in model.effects.items():
            if name not in self._by_effect:
                step, changed = self._first_with(effect)
                first = self._first_of(effect)
                change = self._changes_of(changed, self._at[[first]])[0][0]
                more = change - self._first[first]
                self._by_effect[name] = more / step * self._acts_on(effect)[:, None]

    def _first_with(self, effect: Effect) -> tuple[float, list[BendingTest]]:
        """Return a possible amplitude of an effect, and the first specification with it."""
        first = self._tests[self._first_of(effect)]
        return first_possible(effect.typical, lambda amplitude: [effect.apply(first, amplitude)])

    def _acts_on(self, effect: Effect) -> NDArray[np.bool_]:
        return np.array([effect.acts_on(test) for test in self._tests])

    def _first_of(self, effect: Effect) -> int:
        """Return the index of the first curve on which an effect acts."""
        return int(self._acts_on(effect).argmax())

    def _changes_of(self, tests: Sequence[BendingTest], at_mm: Array, meshes: int = 2) -> Array:
        """Return relative changes of forces on finer meshes, from the first on.

        The displacements have shape (n, m), the changes have shape (meshes - 1, n, m).
        """
        standing, tasks = self._on_meshes(tests, meshes)
        curves = iter(simulated(self._runs, tasks))
        own = {i: [next(curves) for _ in range(meshes)] for i in standing.chosen}
        each = [(own[i], at) for i, at in zip(standing.by, at_mm, strict=True)]
        return np.array(
            [
                [np.interp(at, *change_of(some[0], some[k])) for some, at in each]
                for k in range(1, meshes)
            ]
        )

    def _on_meshes(
        self, tests: Sequence[BendingTest], meshes: int = 2
    ) -> tuple[Standing, list[CurveTask]]:
        """Return which of the first curves stand for others, and their tasks on all meshes."""
        some = [[dataclasses.replace(test, machine=Machine()) for test in tests]]
        while len(some) < meshes:
            some.append([on_mesh(test, finer(test.numerics.mesh)) for test in some[-1]])
        standing = Standing.of(*([Place.of(test) for test in these] for these in some[:2]))
        return standing, [self._task(these[i]) for i in standing.chosen for these in some]

    def tasks(self, model: Model) -> list[CurveTask]:
        """Return the tasks on several meshes that a model is about to need."""
        known = "_last" in self.__dict__
        wanted = [] if known else self._on_meshes(self._tests, meshes=3)[1]
        for effect, _ in model.effects.values():
            if effect.name not in self._by_effect:
                wanted += self._on_meshes(self._first_with(effect)[1])[1]
        return wanted

    @property
    def deviations(self) -> Array:
        """Relative deviations from the extrapolated forces, shape (r, q, m).

        Together they have the standard deviation of the extrapolation, on average over
        displacements: the distance to the limit may vary along the curve, but smoothly.
        """
        modes = smooth(*self._last.shape)
        modes /= np.sqrt((modes**2).sum(axis=1).mean())
        return limit()[1] * modes * self._last[:, None]

    def extrapolated(self, curves: Sequence[pd.DataFrame], model: Model) -> list[pd.DataFrame]:
        """Return all curves, extrapolated to vanishing cell size."""
        multiple, found = limit()[0], []
        changes = self._first + multiple * self._last
        for name, (_, amplitude) in model.effects.items():
            if name in self._by_effect:
                changes = changes + multiple * amplitude * self._by_effect[name]
        for at, curve, change in zip(self._at, curves, changes, strict=True):
            travel = curve["displacement_mm"].to_numpy()
            factor = 1.0 + np.interp(travel, at, change)
            # this is much faster than a product of data frames
            scaled = pd.DataFrame(factor[:, None] * curve.to_numpy(), columns=curve.columns)
            found.append(scaled.assign(displacement_mm=travel))
        return found

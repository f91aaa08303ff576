"""What finer meshes change of the forces, and forces without discretisation error."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Iterator, Sequence
from functools import cached_property
from typing import TypeAlias

import numpy as np
import pandas as pd

from ramiefenics.discovery.curves.blocks import Array, smooth
from ramiefenics.discovery.curves.linearised import Model
from ramiefenics.discovery.curves.meshes import finer, limit, on_mesh
from ramiefenics.discovery.curves.standing import Place, Standing, change_of
from ramiefenics.runs.curve import CurveTask, Mapper, simulated
from ramiefenics.specification import BendingTest, Machine
from ramiefenics.specification.cylinder import Arrangement

Amplitudes: TypeAlias = dict[str, float]

ALIKE = 0.2
"""Difference of amplitudes, relative to the larger one, up to which what effects add to the changes
is taken to be the same. Typical amplitudes add up to 1 % of the force, a few tenths on average."""

AFFORDABLE = "quarter"
"""Domain of stalks with effects that are simulated on the finest mesh. A larger one takes minutes,
and what effects add there to the change by the finest mesh is neglected."""


class MeshChanges:
    """Relative changes that two finer meshes make of forces, by which these are extrapolated.

    The changes are those at displacements of the indenter; machine and seating are applied
    afterwards, to the extrapolated forces. What effects add to the changes is found for all effects
    of a model together, at their amplitudes, because it is not the sum of what each adds: damaged
    fibres in a stalk that pith keeps from flattening are strained far more than in a hollow one,
    and the more the finer the mesh. It is found on one curve of each fixture on which they act, as
    the difference from the changes of the same curve without them, on the finest mesh only where
    that is `AFFORDABLE`.

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
        self._more: dict[frozenset[str], tuple[Amplitudes, Array]] = {}

    def of(self, tests: Sequence[BendingTest], runs: Mapper) -> MeshChanges:
        """Return the same changes for other specifications; those by effects are found anew."""
        other = MeshChanges(tests, self._at, self._task, runs)
        other._without, other._chosen = self._without, self._chosen
        return other

    def as_of(self, first: MeshChanges) -> MeshChanges:
        """Return changes of these curves that are those of another's first, by share of travel."""
        other = MeshChanges(self._tests, self._at, self._task, self._runs)
        known = first._at[0] / first._at[0].max()
        travel_mm = np.array([test.protocol.travel_mm for test in self._tests])
        shares = self._at / travel_mm[:, None]
        other._without = np.array([np.interp(shares, known, own[0]) for own in first._without])
        other._chosen = []  # none is simulated
        return other

    @cached_property
    def _without(self) -> Array:
        """Relative changes of the forces without effects, shape (2, r, m).

        The second are further changes on a mesh that is finer again, relative to the same forces.
        """
        return self._changes_of(self._tests, self._at, meshes=3)

    @cached_property
    def _chosen(self) -> list[int]:
        """Indices of the curves whose changes without effects are their own."""
        return self._on_meshes(self._tests, 2)[0].chosen

    def learn(self, model: Model) -> None:
        """Find what the effects of a model, at its amplitudes, add to the changes."""
        if self._knows(model):
            return
        more = np.zeros_like(self._without)
        for curves, one, changed in self._changed(model):
            at, meshes = self._at[[one]], _meshes_for(changed)
            own = self._without[:, [one]]
            if one not in self._chosen:
                own = self._changes_of([self._tests[one]], at, 3)
            more[: meshes - 1, curves] = self._changes_of([changed], at, meshes) - own[: meshes - 1]
        self._more[frozenset(model.effects)] = (_amplitudes(model), more)

    def _knows(self, model: Model) -> bool:
        known, _ = self._more.get(frozenset(model.effects), ({}, None))
        now = _amplitudes(model)
        return known.keys() == now.keys() and all(
            math.isclose(now[name], known[name], rel_tol=ALIKE) for name in now
        )

    def _changed(self, model: Model) -> Iterator[tuple[list[int], int, BendingTest]]:
        """Return curves on which the same effects act, one of them, and that with these effects.

        All are of the same fixture. It is one whose changes without effects are its own, if there
        is one.
        """
        effects = [effect for effect, _ in model.effects.values()]
        acting: dict[tuple[Arrangement, tuple[bool, ...]], list[int]] = {}
        for i, test in enumerate(self._tests):
            which = tuple(effect.acts_on(test) for effect in effects)
            if any(which):
                acting.setdefault((test.fixture, which), []).append(i)
        for curves in acting.values():
            one = next((i for i in curves if i in self._chosen), curves[0])
            yield curves, one, model.test(self._tests[one], np.zeros(len(model.factors)))

    def _changes_of(self, tests: Sequence[BendingTest], at_mm: Array, meshes: int) -> Array:
        """Return relative changes of forces on finer meshes, each beyond the one before.

        The displacements have shape (n, m), the changes have shape (meshes - 1, n, m).
        """
        standing, tasks = self._on_meshes(tests, meshes)
        curves = iter(simulated(self._runs, tasks))
        own = {i: [next(curves) for _ in range(meshes)] for i in standing.chosen}
        each = [(own[i], at) for i, at in zip(standing.by, at_mm, strict=True)]
        changes = [
            [np.interp(at, *change_of(some[0], some[k])) for some, at in each]
            for k in range(1, meshes)
        ]
        return np.diff(changes, axis=0, prepend=0.0)

    def _on_meshes(
        self, tests: Sequence[BendingTest], meshes: int
    ) -> tuple[Standing, list[CurveTask]]:
        """Return which of the first curves stand for others, and their tasks on all meshes."""
        some = [[dataclasses.replace(test, machine=Machine()) for test in tests]]
        while len(some) < meshes:
            some.append([on_mesh(test, finer(test.numerics.mesh)) for test in some[-1]])
        standing = Standing.of(*([Place.of(test) for test in these] for these in some[:2]))
        return standing, [self._task(these[i]) for i in standing.chosen for these in some]

    def tasks(self, model: Model) -> list[CurveTask]:
        """Return the tasks on several meshes that a model is about to need, the longest first.

        A task on the finest mesh takes as long as ten others. If it began last, other cores would
        wait for it.
        """
        wanted = [] if "_without" in self.__dict__ else self._on_meshes(self._tests, 3)[1]
        if not self._knows(model):
            for _, one, changed in self._changed(model):
                wanted += self._on_meshes([changed], _meshes_for(changed))[1]
                if one not in self._chosen:
                    wanted += self._on_meshes([self._tests[one]], 3)[1]
        return sorted(wanted, key=lambda task: task.test.numerics.mesh.contact_size)

    def _with(self, model: Model) -> Array:
        """Return relative changes of a model's forces, as `_without`.

        What its effects add is as known last, at whatever amplitudes; nothing where not known yet.
        """
        _, more = self._more.get(frozenset(model.effects), ({}, 0.0))
        return self._without + more

    def deviations(self, model: Model) -> Array:
        """Return relative deviations from the extrapolated forces, shape (r, q, m).

        Together they have the standard deviation of the extrapolation, on average over
        displacements: the distance to the limit may vary along the curve, but smoothly.
        """
        last = self._with(model)[1]
        modes = smooth(*last.shape)
        modes /= np.sqrt((modes**2).sum(axis=1).mean())
        return limit()[1] * modes * last[:, None]

    def extrapolated(self, curves: Sequence[pd.DataFrame], model: Model) -> list[pd.DataFrame]:
        """Return all curves, extrapolated to vanishing cell size."""
        first, last = self._with(model)
        changes, found = first + limit()[0] * last, []
        for at, curve, change in zip(self._at, curves, changes, strict=True):
            travel = curve["displacement_mm"].to_numpy()
            factor = 1.0 + np.interp(travel, at, change)
            # this is much faster than a product of data frames
            scaled = pd.DataFrame(factor[:, None] * curve.to_numpy(), columns=curve.columns)
            found.append(scaled.assign(displacement_mm=travel))
        return found


def _meshes_for(changed: BendingTest) -> int:
    return 3 if changed.numerics.domain == AFFORDABLE else 2


def _amplitudes(model: Model) -> Amplitudes:
    return {name: amplitude for name, (_, amplitude) in model.effects.items()}

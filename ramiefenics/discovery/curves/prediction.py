"""Simulated curves of a model with factors and effects, and their derivatives."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from types import MappingProxyType

import numpy as np
import pandas as pd

from ramiefenics.discovery.curves.blocks import Array
from ramiefenics.discovery.curves.changed_curves import Carried, following
from ramiefenics.discovery.curves.linearised import Linearised, Model
from ramiefenics.discovery.curves.mesh_changes import MeshChanges
from ramiefenics.discovery.curves.observed import Observed, far_enough, read
from ramiefenics.discovery.curves.signatures import Signatures
from ramiefenics.effects import Effect
from ramiefenics.runs import Done
from ramiefenics.runs.curve import Change, CurveTask, Mapper
from ramiefenics.specification import BendingTest, SpecificationError
from ramiefenics.surrogate import LearnedCurves
from ramiefenics.surrogate.coordinates import Direction

TOE = 0.2
"""Share of the travel that the toe of a simulated curve may take up where measured toes are cut
off."""


class Predictor:
    """Predictor of what the machine of a data set records.

    Real stalks have no mesh, so all forces are extrapolated to vanishing cell size, see
    `MeshChanges`.

    Parameters
    ----------
    tests, observed
        Specifications of the curves, and the measured curves with which they are compared.
    runs
        Computes tasks for curves.

    Attributes
    ----------
    runs
        Computes tasks for curves.
    mesh_changes
        What finer meshes change of the forces.
    """

    def __init__(self, tests: Sequence[BendingTest], observed: Observed, runs: Mapper) -> None:
        self._tests, self._observed = list(tests), observed
        self._specimen = observed.blocks.specimen
        self._at = observed.at_mm
        self.runs = runs
        self.mesh_changes = MeshChanges(tests, observed.at_mm, self.task, runs)

    def rephrased(self, tests: Sequence[BendingTest], runs: Mapper | None = None) -> Predictor:
        """Return a predictor for other specifications that a finer mesh changes in the same way.

        Parameters
        ----------
        tests
            Specifications of the curves that replace the present ones.
        runs
            Computes tasks instead of the present one; None to keep that.
        """
        other = type(self)(tests, self._observed, self.runs if runs is None else runs)
        other.mesh_changes = self.mesh_changes.of(tests, other.runs)
        return other

    def share_mesh_changes(self, first: MeshChanges) -> None:
        """Take the mesh to change all curves as it changes another predictor's first curve."""
        self.mesh_changes = self.mesh_changes.as_of(first)

    def linearise(
        self,
        model: Model,
        suspects: Mapping[str, Effect],
        smooth: bool = False,
        roughly: bool = False,
        along: Mapping[str, Direction] = MappingProxyType({}),
    ) -> Linearised:
        """Find every curve with derivatives with respect to log factors and amplitudes.

        Curves without effects are simulated with derivatives by the log factors. What effects
        change of these curves is simulated for representative stalks only, except for changes of
        the numbers by which specimens differ. The same holds for derivatives by amplitudes, see
        `signatures`; an error of the machine needs no simulation.

        Parameters
        ----------
        model, suspects
            Model around which to linearise, and effects whose signatures are wanted.
        smooth
            Whether to refuse a stalk that jumps.
        roughly
            Whether to leave out what the model's effects add to the change on a finer mesh, where
            that is not known yet.
        along
            Directions in which suspects that the model does not contain change the specifications,
            by name. Their derivatives are found with those by log factors, without steps.

        Raises
        ------
        SpecificationError
            If an effect of the model has no meaning for a specimen, or no derivative by its
            amplitude is found; or if a simulation of the model does not reach the end, or jumps
            although that is to be refused.
        """
        needed = dataclasses.replace(model, effects={}) if roughly else model
        typical = model.typical
        stepped = {name: effect for name, effect in suspects.items() if name not in along}
        by_amplitudes = Signatures(self, typical, stepped)
        soon = self.mesh_changes.tasks(needed)
        raw, typical_raw, answers = self._raw(
            (model, typical), smooth, soon, by_amplitudes.carrying, tuple(along.values())
        )
        self.mesh_changes.learn(needed)
        tests, curves = self.tests(model), self.mesh_changes.extrapolated(raw, model)
        force = self.read(tests, curves)
        by_own = self._by_changes(model.factors, tests, curves, force)
        by_mesh = self._by_mesh(model, tests, curves, force)
        by_cells = force - self.read(tests, raw)
        tests, curves = self.tests(typical), self.mesh_changes.extrapolated(typical_raw, typical)
        typical_force = self.read(tests, curves)
        size = force.sum(axis=1, keepdims=True) / typical_force.sum(axis=1, keepdims=True)
        changes: tuple[Change, ...] = (*model.factors, *along.values())
        by_typical = self._by_changes(changes, tests, curves, typical_force)
        by_common = size[..., None] * by_typical[:, : len(model.factors)]
        by_effects, refused = by_amplitudes.found(typical_raw, answers)
        by_effects |= zip(along, by_typical[:, len(model.factors) :].swapaxes(0, 1), strict=True)
        for name, (_, amplitude) in model.effects.items():
            if name in refused:
                unknown = f"has no derivative there: {refused[name].rstrip('.')}"
                raise SpecificationError(name, amplitude, unknown)
        by_effects = {name: size * change for name, change in by_effects.items()}
        return Linearised(model, force, by_cells, by_own, by_common, by_mesh, by_effects, refused)

    def _raw(
        self,
        models: tuple[Model, Model],
        smooth: bool,
        soon: Sequence[CurveTask],
        carrying: Sequence[CurveTask],
        along: tuple[Direction, ...],
    ) -> tuple[list[pd.DataFrame], list[pd.DataFrame], Mapping[CurveTask, Done[pd.DataFrame]]]:
        """Return the curves of two models as simulated, with derivatives by the log factors.

        Those of the second model also have derivatives along some directions. The outcomes of tasks
        that are needed soon are returned as well, because all simulations that do not depend on one
        another are done together.
        """
        alike = np.array_equal(models[0].log_factors, models[1].log_factors)
        different = models[:1] if alike else models
        tests = [self.tests(model) for model in different]
        without = [
            following(self.tests(dataclasses.replace(model, effects={})), some)
            for model, some in zip(different, tests, strict=True)
        ]
        before, after = [t for some in without for t in some], [t for some in tests for t in some]
        carried, factors = Carried.of(before, after), models[0].factors
        first = {
            i: (
                self.task(before[i], (*factors, *near.before.directions), smooth),
                self.carrying(after[i], (*factors, *near.after.directions)),
            )
            for i, near in carried.represented.items()
        }
        every: tuple[Change, ...] = (*factors, *along)
        number = len(tests[0])
        wanted = [factors] * (len(before) - number) + [every] * number
        tasks = [
            first[i][0] if i in first else self.task(test, changes, smooth)
            for i, (test, changes) in enumerate(zip(before, wanted, strict=True))
        ]
        changed = [task for _, task in first.values()]
        answers = self._answers([*soon, *tasks], [*changed, *carrying])
        names = ["displacement_mm", "force_N", *(change.name for change in every)]
        curves = [answers[task].result().filter(names) for task in tasks]
        pairs = {i: tuple(answers[task].result() for task in pair) for i, pair in first.items()}
        raw = carried.changed(curves, pairs)
        return raw[:number], raw[-number:], answers

    def _answers(
        self, tasks: Sequence[CurveTask], carrying: Sequence[CurveTask]
    ) -> dict[CurveTask, Done[pd.DataFrame]]:
        """Return the outcomes of tasks.

        Those for curves that represent others are repeated without derivatives if they are refused,
        because each derivative of a stalk that jumps takes two more simulations.
        """
        asked = dict.fromkeys([*tasks, *carrying])
        answers = dict(zip(asked, self.runs.map([*asked]), strict=True))
        refused = [task for task in dict.fromkeys(carrying) if task.factors and answers[task].error]
        plain = [self.task(task.test) for task in refused]
        return answers | dict(zip(refused, self.runs.map(plain) if plain else (), strict=True))

    def confirm(self, curves: Linearised, tolerance: float = 0.0) -> Linearised:
        """Return the same linearised curves with the forces of every curve simulated.

        Parameters
        ----------
        curves
            Linearised curves.
        tolerance
            Expected error of a curve, relative to its peak, below which it need not be simulated.
        """
        tests = self.tests(curves.model)
        tasks = self.exact_tasks(tests)
        soon = self.mesh_changes.tasks(curves.model)
        if isinstance(self.runs, LearnedCurves):
            answers = self.runs.map([*soon, *tasks], tolerance)
        else:
            answers = self.runs.map([*soon, *tasks])
        raw = [done.result() for done in answers[len(soon) :]]
        self.mesh_changes.learn(curves.model)
        extrapolated = self.mesh_changes.extrapolated(raw, curves.model)
        force = self.read(tests, extrapolated)
        by_cells = force - self.read(tests, raw)
        by_mesh = self._by_mesh(curves.model, tests, extrapolated, force)
        return dataclasses.replace(curves, force=force, mesh_correction=by_cells, by_mesh=by_mesh)

    def tests(self, model: Model) -> list[BendingTest]:
        """Return the specifications of all curves, with factors and effects."""
        each = model.log_factors[self._specimen]
        return [model.test(test, own) for test, own in zip(self._tests, each, strict=True)]

    def task(
        self, test: BendingTest, factors: tuple[Change, ...] = (), smooth: bool = False
    ) -> CurveTask:
        """Return the task of a curve over the range of the data, with derivatives."""
        travel = float(self._at.max())  # the same for all, so that curves can be learned
        straight = [part for part in self._observed.straight_mm or () if part is not None]
        if straight:  # these parts may extend beyond the range that is compared
            travel = (1.0 + TOE) * max(travel, *(end for _, end in straight))
        protocol = dataclasses.replace(
            test.protocol, travel_mm=travel, save_every_mm=travel, then=()
        )
        return CurveTask(dataclasses.replace(test, protocol=protocol), factors, smooth)

    def carrying(self, test: BendingTest, factors: tuple[Change, ...]) -> CurveTask:
        """Return the task of a curve that represents others, see `_answers`."""
        return dataclasses.replace(self.task(test, factors, smooth=True), strict=True)

    def exact_tasks(self, tests: Sequence[BendingTest]) -> list[CurveTask]:
        """Return the tasks of all curves, with the indenter's true paths in the machine."""
        tasks, end = [self.task(test) for test in tests], float(self._at.max())
        return [dataclasses.replace(task, test=far_enough(task.test, end)) for task in tasks]

    def _by_changes(
        self,
        changes: Sequence[Change],
        tests: Sequence[BendingTest],
        curves: Sequence[pd.DataFrame],
        force: Array,
    ) -> Array:
        """Return derivatives with respect to changes that the curves have, shape (r, k, m)."""
        found = [
            self.slopes_by(tests, curves, force, [curve[change.name] for curve in curves])
            for change in changes
        ]
        return np.stack(found, axis=1)

    def _by_mesh(
        self,
        model: Model,
        tests: Sequence[BendingTest],
        curves: Sequence[pd.DataFrame],
        force: Array,
    ) -> Array:
        """Return derivatives with respect to deviations of the mesh correction, shape (r, q, m)."""
        by_mesh = []
        for deviation in self.mesh_changes.deviations(model).transpose(1, 0, 2):
            errors = [
                curve["force_N"] * np.interp(curve["displacement_mm"], at, share)
                for curve, at, share in zip(curves, self._at, deviation, strict=True)
            ]
            by_mesh.append(self.slopes_by(tests, curves, force, errors))
        return np.stack(by_mesh, axis=1)

    def slopes_by(
        self,
        tests: Sequence[BendingTest],
        curves: Sequence[pd.DataFrame],
        force: Array,
        changes: Sequence[pd.Series | Array],
    ) -> Array:
        """Return the changes of recorded forces, (r, m), by small changes of the indenter's forces.

        The recorded forces are passed too, shape (r, m), because many changes are of the same
        curves.
        """
        small = 1e-3
        moved = [
            curve.assign(force_N=curve["force_N"] + small * change)
            for curve, change in zip(curves, changes, strict=True)
        ]
        return (self.read(tests, moved) - force) / small

    def read(self, tests: Sequence[BendingTest], curves: Sequence[pd.DataFrame]) -> Array:
        """Return the recorded forces read off the first curves, shape (len(tests), m)."""
        straight = self._observed.straight_mm or [None] * len(self._at)
        each = zip(tests, curves, self._at, straight, strict=False)
        return np.array([read(*one) for one in each])

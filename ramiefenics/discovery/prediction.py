"""Simulated curves of a model with factors and effects, and their derivatives."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import pandas as pd

from ramiefenics.discovery.blocks import Array
from ramiefenics.discovery.factors import Factor, apply_factors
from ramiefenics.discovery.meshes import finer, limit, on_mesh
from ramiefenics.discovery.observed import Observed, read
from ramiefenics.effects import Effect
from ramiefenics.runs import Done
from ramiefenics.runs.curve import Change, CurveTask, Mapper, normalised, simulated
from ramiefenics.specification import BendingTest, Machine, SpecificationError
from ramiefenics.surrogate.coordinates import (
    Direction,
    coordinates,
    is_logarithmic,
    numbers,
    rest_of,
)

DERIVATIVE_SHARE = 0.25
"""Step, over the typical amplitude, of the derivative by the amplitude of an effect that is there;
where it is not there, that is the typical amplitude."""

SMOOTH_MODES = 5
"""Cosines along the displacement that a smooth error is made of."""


@dataclass(frozen=True)
class Model:
    """A point around which curves are linearised.

    Attributes
    ----------
    factors
        What is fitted.
    log_factors
        Their values for every specimen, shape (n, k).
    effects
        By name, what has been added to the baseline, with its amplitude.
    """

    factors: tuple[Factor, ...]
    log_factors: Array
    effects: Mapping[str, tuple[Effect, float]] = dataclasses.field(default_factory=dict)

    def test(self, test: BendingTest, log_factors: Array) -> BendingTest:
        """Return a specification with factors and effects."""
        test = apply_factors(test, self.factors, [float(value) for value in log_factors])
        for effect, amplitude in self.effects.values():
            test = effect.apply(test, amplitude)
        return test

    def amplitude(self, name: str) -> float:
        """Return that of an effect; zero if it is not there."""
        return self.effects[name][1] if name in self.effects else 0.0

    def changed(self, effect: Effect, amplitude: float) -> Model:
        """Return the model with another amplitude of an effect."""
        effects = {**self.effects, effect.name: (effect, amplitude)}
        return dataclasses.replace(self, effects=effects)


@dataclass(frozen=True)
class Linearised:
    """Predictions of a model and how they change; forces in N, r curves, m displacements.

    Attributes
    ----------
    model
        Which.
    force
        Predicted for vanishing cells, shape (r, m).
    mesh_correction
        What that is more than on the mesh of the simulations, shape (r, m).
    by_factors
        Derivatives by the log factors, shape (r, k, m).
    by_mesh
        Smooth deviations from the expected correction, each with its standard deviation,
        shape (r, q, m).
    by_effects
        By name, the derivative by the amplitude, per unit of it, shape (r, m).
    refused
        By name, why there is none.
    """

    model: Model
    force: Array
    mesh_correction: Array
    by_factors: Array
    by_mesh: Array
    by_effects: Mapping[str, Array]
    refused: Mapping[str, str]


SMALL = 1e-3
"""Step, over the typical amplitude, of what an effect changes in a specification."""


@dataclass(frozen=True)
class Along:
    """What an effect that is not there changes: numbers, and all forces in proportion.

    Attributes
    ----------
    direction
        Of the numbers of the normalised specification, see `normalised`, per typical amplitude.
    scale
        Change of the logarithm of the factor to its forces.
    """

    direction: Direction
    scale: float

    @classmethod
    def of(cls, effect: Effect, test: BendingTest) -> Along | None:
        """Return it; None if the effect changes more than numbers, or none of these."""
        base, factor = normalised(test)
        moved, moved_factor = normalised(effect.apply(test, SMALL * effect.typical))
        before, after = numbers(base), numbers(moved)
        paths = tuple(path for path in before if before[path] != after.get(path))
        from_zero = any(is_logarithmic(path) and before[path] <= 0.0 for path in paths)
        alike = before.keys() == after.keys() and rest_of(base) == rest_of(moved)
        if not paths or from_zero or not alike:
            return None
        change = (coordinates(after, paths) - coordinates(before, paths)) / SMALL
        direction = Direction(effect.name, paths, tuple(map(float, change)))
        return cls(direction, float(np.log(moved_factor / factor)) / SMALL)


class Predictor:
    """Predicts what a data set's machine records.

    Real stalks have no mesh: all forces are extrapolated to vanishing cells, by what a finer mesh
    changes of every curve as specified, relatively and at the same place of the indenter. What
    an effect adds to that change is found on the first curve, and is in proportion to the
    amplitude.

    Parameters
    ----------
    tests, observed
        Specifications of the curves, and where these are compared.
    runs
        Answers tasks for curves.
    """

    def __init__(self, tests: Sequence[BendingTest], observed: Observed, runs: Mapper) -> None:
        self._tests, self._observed = list(tests), observed
        self._specimen = observed.blocks.specimen
        self._at = observed.at_mm
        self._runs = runs
        self._by_effect: dict[str, Array] = {}

    def rephrased(self, tests: Sequence[BendingTest], runs: Mapper | None = None) -> Predictor:
        """Return a predictor for specifications whose forces a finer mesh changes as these'.

        Parameters
        ----------
        tests
            Specifications of the curves in place of the first ones.
        runs
            Answers tasks in place of the first.
        """
        other = Predictor(tests, self._observed, self._runs if runs is None else runs)
        other._mesh_changes = self._mesh_changes
        return other

    def linearise(self, model: Model, suspects: Mapping[str, Effect]) -> Linearised:
        """Simulate every curve with derivatives by the log factors, and by amplitudes.

        The latter are differences. For an error of the machine, that needs no other simulation.

        Raises
        ------
        SpecificationError
            If an effect of the model has no meaning for a specimen, or a simulation of the model
            does not reach the end.
        """
        tests = self._with(model)
        steps = {name: _step(effect, model) for name, effect in suspects.items()}
        moved, refused = self._moved(model, suspects, steps)
        along = self._along(model, tests, {name: suspects[name] for name in moved})
        moved = {name: some for name, some in moved.items() if name not in along}
        tasks = [
            self._task(test, (*model.factors, *(some[i].direction for some in along.values())))
            for i, test in enumerate(tests)
        ]
        beside = [self._task(t) for some in moved.values() for t in some]
        done = self._runs.map([*tasks, *beside])  # the longest first, so that all end together
        raw = [each.result() for each in done[: len(tasks)]]
        curves = self._extrapolated(raw, model)
        force = self._read(tests, curves)
        by_effects = {}
        for number, (name, some) in enumerate(moved.items(), start=1):
            answers = done[number * len(tasks) : (number + 1) * len(tasks)]
            try:
                there = self._moved_force(model, suspects[name], steps[name], some, answers)
                by_effects[name] = (there - force) / steps[name]
            except SpecificationError as error:
                refused[name] = str(error)
        for name, changes in along.items():
            slopes = [
                curve[name] + change.scale * curve["force_N"]
                for change, curve in zip(changes, curves, strict=True)
            ]
            by_effects[name] = self._slopes_by(tests, curves, slopes) / suspects[name].typical
        by_factors, by_mesh = self._slopes(model, tests, curves)
        by_cells = force - self._read(tests, raw)
        return Linearised(model, force, by_cells, by_factors, by_mesh, by_effects, refused)

    def confirm(self, curves: Linearised, runs: Mapper) -> Linearised:
        """Return the same with the forces of every curve simulated, none of them learned."""
        tests = self._with(curves.model)
        raw = simulated(runs, [self._task(test) for test in tests])
        force = self._read(tests, self._extrapolated(raw, curves.model))
        by_cells = force - self._read(tests, raw)
        return dataclasses.replace(curves, force=force, mesh_correction=by_cells)

    def _with(self, model: Model) -> list[BendingTest]:
        each = model.log_factors[self._specimen]
        return [model.test(test, own) for test, own in zip(self._tests, each, strict=True)]

    def _moved(
        self, model: Model, suspects: Mapping[str, Effect], steps: Mapping[str, float]
    ) -> tuple[dict[str, list[BendingTest]], dict[str, str]]:
        """Return specifications with each amplitude changed, and why there are none."""
        moved, refused = {}, {}
        for name, effect in suspects.items():
            amplitude = model.amplitude(name) + steps[name]
            try:
                moved[name] = self._with(model.changed(effect, amplitude))
            except SpecificationError as error:
                refused[name] = str(error)
        return moved, refused

    def _moved_force(
        self,
        model: Model,
        effect: Effect,
        step: float,
        tests: Sequence[BendingTest],
        answers: Sequence[Done[pd.DataFrame]],
    ) -> Array:
        raw = [answer.result() for answer in answers]
        if effect.name in model.effects:  # only then is its own change by the mesh known
            model = model.changed(effect, model.amplitude(effect.name) + step)
        return self._read(tests, self._extrapolated(raw, model))

    def _along(
        self, model: Model, tests: Sequence[BendingTest], suspects: Mapping[str, Effect]
    ) -> dict[str, list[Along]]:
        """Return the effects that change numbers only: derivatives by these are cheap.

        Not those of the model, far from whose amplitudes they would tell little.
        """
        found = {}
        for name, effect in suspects.items():
            if name not in model.effects:
                changes = [Along.of(effect, test) for test in tests]
                if all(change is not None for change in changes):
                    found[name] = [change for change in changes if change is not None]
        return found

    def _task(self, test: BendingTest, factors: tuple[Change, ...] = ()) -> CurveTask:
        travel = float(self._at.max())  # the same for all, so that they learn from one another
        protocol = dataclasses.replace(
            test.protocol, travel_mm=travel, save_every_mm=travel, then=()
        )
        return CurveTask(dataclasses.replace(test, protocol=protocol), factors)

    def _slopes(
        self, model: Model, tests: Sequence[BendingTest], curves: Sequence[pd.DataFrame]
    ) -> tuple[Array, Array]:
        """Return derivatives by the log factors, and by deviations of the mesh's correction."""
        by_factors = [
            self._slopes_by(tests, curves, [curve[factor.name] for curve in curves])
            for factor in model.factors
        ]
        by_mesh = []
        for deviation in self._mesh_deviations.transpose(1, 0, 2):
            errors = [
                curve["force_N"] * np.interp(curve["displacement_mm"], at, share)
                for curve, at, share in zip(curves, self._at, deviation, strict=True)
            ]
            by_mesh.append(self._slopes_by(tests, curves, errors))
        return np.stack(by_factors, axis=1), np.stack(by_mesh, axis=1)

    def _slopes_by(
        self,
        tests: Sequence[BendingTest],
        curves: Sequence[pd.DataFrame],
        changes: Sequence[pd.Series],
    ) -> Array:
        """Return what changes of the indenter's forces make of the recorded ones, (r, m)."""
        each = zip(tests, curves, changes, self._at, strict=True)
        return np.array([_slope(*one) for one in each])

    @cached_property
    def _mesh_changes(self) -> Array:
        """Relative changes of the curves' forces on a finer mesh, shape (r, m).

        At displacements of the indenter: what machine and seating make of them, they make of the
        forces.
        """
        return self._changes_of(self._tests)

    def _change_by(self, effect: Effect) -> Array:
        """Return what an effect adds to the first curve's change, per amplitude, shape (m,)."""
        if effect.name not in self._by_effect:
            changed = effect.apply(self._tests[0], effect.typical)
            more = self._changes_of([changed])[0] - self._mesh_changes[0]
            self._by_effect[effect.name] = more / effect.typical
        return self._by_effect[effect.name]

    def _changes_of(self, tests: Sequence[BendingTest]) -> Array:
        """Return relative changes of the first curves' forces on a finer mesh."""
        plain = [dataclasses.replace(test, machine=Machine()) for test in tests]
        finely = [on_mesh(test, finer(test.numerics.mesh)) for test in plain]
        tasks = [self._task(test) for some in (plain, finely) for test in some]
        curves = simulated(self._runs, tasks)
        coarse = self._read(plain, curves[: len(plain)])
        fine = self._read(finely, curves[len(plain) :])
        return np.where(coarse > 0.0, fine / np.where(coarse > 0.0, coarse, 1.0) - 1.0, 0.0)

    @property
    def _mesh_deviations(self) -> Array:
        """Relative deviations from the extrapolated forces, shape (r, q, m).

        Together they have the extrapolation's standard deviation, on average over displacements:
        how far the limit is may change along the curve, but smoothly.
        """
        modes = smooth(*self._mesh_changes.shape)
        modes /= np.sqrt((modes**2).sum(axis=1).mean())
        return limit()[1] * modes * self._mesh_changes[:, None]

    def _extrapolated(self, curves: Sequence[pd.DataFrame], model: Model) -> list[pd.DataFrame]:
        """Return all curves for vanishing cells."""
        changes, found = self._mesh_changes, []
        for effect, amplitude in model.effects.values():
            changes = changes + amplitude * self._change_by(effect)
        for at, curve, change in zip(self._at, curves, changes, strict=True):
            factor = 1.0 + limit()[0] * np.interp(curve["displacement_mm"], at, change)
            forces = curve.drop(columns="displacement_mm").mul(factor, axis=0)
            found.append(curve[["displacement_mm"]].join(forces))
        return found

    def _read(self, tests: Sequence[BendingTest], curves: Sequence[pd.DataFrame]) -> Array:
        """Read the first curves, shape (len(tests), m)."""
        return np.array([read(t, c, a) for t, c, a in zip(tests, curves, self._at, strict=False)])


def smooth(curves: int, points: int) -> Array:
    """Return cosines of unit size, the same for all curves, shape (r, modes, m)."""
    x = (np.arange(points) + 0.5) / points
    modes = np.array([np.cos(k * np.pi * x) for k in range(SMOOTH_MODES)])
    return np.broadcast_to(modes, (curves, *modes.shape)).copy()


def _slope(test: BendingTest, curve: pd.DataFrame, change: pd.Series, at_mm: Array) -> Array:
    """Return what a small change of the indenter's forces makes of the recorded ones."""
    small = 1e-3
    moved = curve.assign(force_N=curve["force_N"] + small * change)
    return (read(test, moved, at_mm) - read(test, curve, at_mm)) / small


def _step(effect: Effect, model: Model) -> float:
    """Return a step of the amplitude that stays within the bounds."""
    if effect.name not in model.effects:
        return effect.typical
    step = DERIVATIVE_SHARE * effect.typical
    low, high = effect.bounds
    return step if low <= model.amplitude(effect.name) + step <= high else -step

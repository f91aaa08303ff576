"""Measured and simulated curves on the same displacements, and derivatives of the latter."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import pandas as pd
from scipy.interpolate import Akima1DInterpolator

from ramiefenics.discovery.evidence import Array
from ramiefenics.discovery.factors import Factor, apply_factors
from ramiefenics.discovery.meshes import finer, limit, on_mesh
from ramiefenics.discovery.verdict import smooth
from ramiefenics.effects import Effect
from ramiefenics.measured import Dataset
from ramiefenics.measured.noise import level
from ramiefenics.runs.curve import CurveTask, Mapper, simulated
from ramiefenics.specification import BendingTest, Machine, SpecificationError

POINTS_OF_A_LINE = 21
"""On predicted curves, around every displacement."""

DERIVATIVE_SHARE = 0.25
"""Step, over the typical amplitude, of an effect's derivative at an amplitude other than zero."""


@dataclass(frozen=True)
class Observed:
    """Measured curves, reduced.

    Attributes
    ----------
    at_mm
        Displacements, shape (m,).
    force_N
        Shape (n, m) for n specimens.
    peak_N
        Largest measured force of each specimen, to which its noise refers, shape (n,).
    """

    at_mm: Array
    force_N: Array
    peak_N: Array


def observe(dataset: Dataset) -> Observed:
    """Reduce measured curves: a straight line through the points around each displacement.

    Raises
    ------
    SpecificationError
        If a curve begins after the first displacement.
    """
    dataset.check_starts()
    at = dataset.at_mm
    half = _half(at)
    force = np.array([[level(s.curve, d, half) for d in at] for s in dataset.specimens])
    return Observed(at, force, force.max(axis=1))


def _half(at_mm: Array) -> float:
    """Return how far around a displacement points of a curve count there, mm."""
    return float(at_mm[1] - at_mm[0]) / 2.0


def _reading(at_mm: Array) -> tuple[Array, Array]:
    """Return where to evaluate predicted curves, and weights, shape (m, points).

    Together they put a straight line through the points around each displacement, as is done with
    measured curves: at a kink, such as the end of a gap, that is not the curve's own value.
    """
    offsets = _half(at_mm) * np.linspace(-1.0, 1.0, POINTS_OF_A_LINE)
    inside = at_mm[:, None] + offsets <= at_mm[-1] + 1e-9
    number = inside.sum(axis=1, keepdims=True)
    middle = (inside * offsets).sum(axis=1, keepdims=True) / number
    around = inside * (offsets - middle)
    weights = inside / number - middle * around / (around**2).sum(axis=1, keepdims=True)
    return np.minimum(at_mm[:, None] + offsets, at_mm[-1]), weights


@dataclass(frozen=True)
class Model:
    """A point around which curves are linearised.

    Attributes
    ----------
    factors
        What is fitted.
    log_factors
        Their values.
    effect, amplitude
        What has been added to the baseline, if anything.
    """

    factors: tuple[Factor, ...]
    log_factors: tuple[float, ...]
    effect: Effect | None = None
    amplitude: float = 0.0

    def test(self, test: BendingTest, amplitude: float | None = None) -> BendingTest:
        """Return a specimen's specification according to this model."""
        test = apply_factors(test, self.factors, self.log_factors)
        if self.effect is None:
            return test
        return self.effect.apply(test, self.amplitude if amplitude is None else amplitude)

    def at(self, log_factors: Array, amplitude: float) -> Model:
        """Return the model with other parameters."""
        values = tuple(float(value) for value in log_factors)
        return dataclasses.replace(self, log_factors=values, amplitude=amplitude)


@dataclass(frozen=True)
class Linearised:
    """Predictions of a model and how they change; forces in N, n specimens, m displacements.

    Attributes
    ----------
    model
        Which.
    force
        Predicted for vanishing cells, shape (n, m).
    mesh_correction
        What that is more than on the mesh of the simulations, shape (n, m).
    by_factors
        Derivatives by the log factors, shape (n, k, m).
    by_mesh
        Smooth deviations from the expected correction, each with its standard deviation,
        shape (n, q, m).
    by_effect
        Derivative by the amplitude, per unit of it, shape (n, m); None without effect.
    """

    model: Model
    force: Array
    mesh_correction: Array
    by_factors: Array
    by_mesh: Array
    by_effect: Array | None


class Simulator:
    """Predicts what a data set's machine records.

    Real stalks have no mesh: all forces are extrapolated to vanishing cells, by what a finer mesh
    changes of every specimen as specified, relatively and at the same place of the indenter. What
    an effect adds to that change is found on the first specimen, and is in proportion to the
    amplitude.

    Parameters
    ----------
    dataset
        Specimens and range.
    at_mm
        Displacements.
    runs
        Answers tasks for curves.
    """

    def __init__(self, dataset: Dataset, at_mm: Array, runs: Mapper) -> None:
        self._specimens = dataset.specimens
        self._at = at_mm
        self._points_mm, self._weights = _reading(at_mm)
        self._runs = runs
        self._by_effect: dict[str, Array] = {}

    def _task(self, test: BendingTest, factors: tuple[Factor, ...] = ()) -> CurveTask:
        travel = float(self._at[-1])
        protocol = dataclasses.replace(
            test.protocol, travel_mm=travel, save_every_mm=travel, then=()
        )
        return CurveTask(dataclasses.replace(test, protocol=protocol), factors)

    def _curves(self, tasks: Sequence[CurveTask]) -> list[pd.DataFrame]:
        return simulated(self._runs, tasks)

    def linearise(self, model: Model) -> Linearised:
        """Simulate every specimen with derivatives by the log factors, and by the amplitude.

        The latter is a difference. For an error of the machine, that needs no other simulation.

        Raises
        ------
        SpecificationError
            If the effect has no meaning for a specimen, or a simulation does not reach the end.
        """
        tests = [model.test(specimen.test) for specimen in self._specimens]
        beside, step = [], 0.0
        if model.effect is not None:
            step = _step(model.effect, model.amplitude)
            beside = [model.test(s.test, model.amplitude + step) for s in self._specimens]
        tasks = [self._task(test, model.factors) for test in tests]
        # the longest first, so that all workers end together
        done = self._curves([*tasks, *map(self._task, beside)])
        raw, moved = done[: len(tests)], done[len(tests) :]
        curves = self._extrapolated(raw, model.effect, model.amplitude)
        force = self._predictions(tests, curves)
        slopes, by_mesh = [], []
        for test, curve, deviations in zip(tests, curves, self._mesh_deviations, strict=True):
            slopes.append([self._slope(test, curve, curve[f.name]) for f in model.factors])
            wrong = [np.interp(curve["displacement_mm"], self._at, d) for d in deviations]
            by_mesh.append([self._slope(test, curve, curve["force_N"] * error) for error in wrong])
        by_effect = None
        if beside:
            moved = self._extrapolated(moved, model.effect, model.amplitude + step)
            by_effect = (self._predictions(beside, moved) - force) / step
        by_cells = force - self._predictions(tests, raw)
        return Linearised(model, force, by_cells, np.array(slopes), np.array(by_mesh), by_effect)

    @cached_property
    def _mesh_changes(self) -> Array:
        """Relative changes of the specimens' forces on a finer mesh, shape (n, m).

        At displacements of the indenter: what machine and seating make of them, they make of the
        forces.
        """
        return self._changes_of([s.test for s in self._specimens])

    def _change_by(self, effect: Effect) -> Array:
        """Return what an effect adds to the first specimen's change, per amplitude, shape (m,)."""
        if effect.name not in self._by_effect:
            changed = effect.apply(self._specimens[0].test, effect.typical)
            more = self._changes_of([changed])[0] - self._mesh_changes[0]
            self._by_effect[effect.name] = more / effect.typical
        return self._by_effect[effect.name]

    def _changes_of(self, tests: Sequence[BendingTest]) -> Array:
        """Return relative changes of forces on a finer mesh, shape (len(tests), m)."""
        plain = [dataclasses.replace(test, machine=Machine()) for test in tests]
        finely = [on_mesh(test, finer(test.numerics.mesh)) for test in plain]
        curves = self._curves([*map(self._task, [*plain, *finely])])
        coarse, fine = np.split(self._predictions([*plain, *finely], curves), 2)
        return np.where(coarse > 0.0, fine / np.where(coarse > 0.0, coarse, 1.0) - 1.0, 0.0)

    @property
    def _mesh_deviations(self) -> Array:
        """Relative deviations from the extrapolated forces, shape (n, q, m).

        Together they have the extrapolation's standard deviation, on average over displacements:
        how far the limit is may change along the curve, but smoothly.
        """
        modes = smooth(*self._mesh_changes.shape)
        modes /= np.sqrt((modes**2).sum(axis=1).mean())
        return limit()[1] * modes * self._mesh_changes[:, None]

    def _extrapolated(
        self, curves: Sequence[pd.DataFrame], effect: Effect | None, amplitude: float
    ) -> list[pd.DataFrame]:
        """Return the curves of all specimens for vanishing cells."""
        changes, found = self._mesh_changes, []
        if effect is not None:
            changes = changes + amplitude * self._change_by(effect)
        for curve, change in zip(curves, changes, strict=True):
            at = curve["displacement_mm"].to_numpy()
            factor = 1.0 + limit()[0] * np.interp(at, self._at, change)
            forces = curve.drop(columns="displacement_mm").mul(factor, axis=0)
            found.append(curve[["displacement_mm"]].join(forces))
        return found

    def confirm(self, curves: Linearised, runs: Mapper) -> Linearised:
        """Return the same with the forces of every specimen simulated, none of them learned."""
        model = curves.model
        tests = [model.test(specimen.test) for specimen in self._specimens]
        raw = simulated(runs, [*map(self._task, tests)])
        extrapolated = self._extrapolated(raw, model.effect, model.amplitude)
        force = self._predictions(tests, extrapolated)
        by_cells = force - self._predictions(tests, raw)
        return dataclasses.replace(curves, force=force, mesh_correction=by_cells)

    def signature(self, base: Linearised, effect: Effect) -> Array:
        """Return the change of every curve by the effect's typical amplitude, per unit of it.

        Raises
        ------
        SpecificationError
            If the effect has no meaning for a specimen, or a simulation does not reach the end.
        """
        model = dataclasses.replace(base.model, effect=effect)
        tests = [model.test(s.test, effect.typical) for s in self._specimens]
        curves = self._curves([*map(self._task, tests)])
        curves = self._extrapolated(curves, effect, effect.typical)
        return (self._predictions(tests, curves) - base.force) / effect.typical

    def _predictions(self, tests: Sequence[BendingTest], curves: Sequence[pd.DataFrame]) -> Array:
        return np.array([self._read(t, c) for t, c in zip(tests, curves, strict=True)])

    def _read(self, test: BendingTest, curve: pd.DataFrame) -> Array:
        """Read the force off a simulated curve as off a measured one, N, shape (m,)."""
        points = recorded(test, curve, self._points_mm.ravel()).reshape(self._weights.shape)
        return np.asarray((self._weights * points).sum(axis=1))

    def _slope(self, test: BendingTest, curve: pd.DataFrame, change: pd.Series) -> Array:
        """Return what a small change of the indenter's forces makes of the recorded ones."""
        small = 1e-3
        moved = curve.assign(force_N=curve["force_N"] + small * change)
        return (self._read(test, moved) - self._read(test, curve)) / small


def recorded(test: BendingTest, curve: pd.DataFrame, at_mm: Array) -> Array:
    """Return the recorded force at recorded displacements, N.

    Raises
    ------
    SpecificationError
        If the simulated curve ends before, or goes back: a soft machine unloads by more than the
        indenter goes on.
    """
    travel, pressed = curve["displacement_mm"].to_numpy(), curve["force_N"].to_numpy()
    displacement, force = test.machine.recorded(travel, pressed)
    if np.any(np.diff(displacement) <= 0.0):
        names = ("compliance_mm_per_N", "bedding_compliance_mm_per_N")
        worst = max(names, key=lambda name: getattr(test.machine, name))
        allowed = "must be low enough for the recorded displacement to increase throughout"
        raise SpecificationError(f"machine.{worst}", getattr(test.machine, worst), allowed)
    if displacement[-1] < at_mm[-1] - 1e-9:
        allowed = f"must be reached, but the simulation ends at {displacement[-1]:.2f} mm"
        raise SpecificationError("displacement_mm", float(at_mm[-1]), allowed)
    inside = np.minimum(at_mm, displacement[-1])
    found = Akima1DInterpolator(displacement, force)(inside)
    return np.where(at_mm <= displacement[0], force[0], found)


def _step(effect: Effect, amplitude: float) -> float:
    """Return a step of the amplitude that stays within the bounds."""
    step = DERIVATIVE_SHARE * effect.typical
    low, high = effect.bounds
    return step if low <= amplitude + step <= high else -step

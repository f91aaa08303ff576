"""Measured and simulated curves on the same displacements, and derivatives of the latter."""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import pandas as pd
from scipy.interpolate import Akima1DInterpolator

from ramiefenics.discovery.evidence import Array
from ramiefenics.discovery.factors import Factor, apply_factors
from ramiefenics.discovery.meshes import finer, limit, on_mesh
from ramiefenics.discovery.runs import Runs, Task
from ramiefenics.discovery.verdict import smooth
from ramiefenics.effects import Effect
from ramiefenics.measured import Dataset
from ramiefenics.measured.noise import level
from ramiefenics.specification import BendingTest, Machine, SpecificationError

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
    half = float(at[1] - at[0]) / 2.0
    force = np.array([[level(s.curve, d, half) for d in at] for s in dataset.specimens])
    return Observed(at, force, force.max(axis=1))


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
    changes of every specimen as specified, relatively and at the same place of the indenter.

    Parameters
    ----------
    dataset
        Specimens and range.
    at_mm
        Displacements.
    runs
        Does the simulations.
    """

    def __init__(self, dataset: Dataset, at_mm: Array, runs: Runs) -> None:
        self._specimens = dataset.specimens
        self._at = at_mm
        self._runs = runs

    def _task(self, test: BendingTest, factors: tuple[Factor, ...] = ()) -> Task:
        travel = float(self._at[-1])
        protocol = dataclasses.replace(test.protocol, travel_mm=travel, save_every_mm=travel)
        return Task(dataclasses.replace(test, protocol=protocol), factors)

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
        done = self._runs.curves([*tasks, *map(self._task, beside)])
        raw = self._predictions(tests, done[: len(tests)])
        done = self._extrapolated(done)
        curves, moved = done[: len(tests)], done[len(tests) :]
        force = self._predictions(tests, curves)
        slopes, by_mesh = [], []
        for test, curve, deviations in zip(tests, curves, self._mesh_deviations, strict=True):
            slopes.append([self._slope(test, curve, curve[f.name]) for f in model.factors])
            wrong = [np.interp(curve["displacement_mm"], self._at, d) for d in deviations]
            by_mesh.append([self._slope(test, curve, curve["force_N"] * error) for error in wrong])
        by_effect = (self._predictions(beside, moved) - force) / step if beside else None
        return Linearised(model, force, force - raw, np.array(slopes), np.array(by_mesh), by_effect)

    @cached_property
    def _mesh_changes(self) -> Array:
        """Relative changes of the specimens' forces on a finer mesh, shape (n, m).

        At displacements of the indenter: what machine and seating make of them, they make of the
        forces.
        """
        plain = [dataclasses.replace(s.test, machine=Machine()) for s in self._specimens]
        tests = [*plain, *(on_mesh(test, finer(test.numerics.mesh)) for test in plain)]
        curves = self._runs.curves([*map(self._task, tests)])
        coarse, fine = np.split(self._predictions(tests, curves), 2)
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

    def _extrapolated(self, curves: Sequence[pd.DataFrame]) -> list[pd.DataFrame]:
        """Return curves of all specimens, once or several times over, for vanishing cells."""
        found = []
        for curve, change in zip(curves, itertools.cycle(self._mesh_changes), strict=False):
            at = curve["displacement_mm"].to_numpy()
            factor = 1.0 + limit()[0] * np.interp(at, self._at, change)
            forces = curve.drop(columns="displacement_mm").mul(factor, axis=0)
            found.append(curve[["displacement_mm"]].join(forces))
        return found

    def signature(self, base: Linearised, effect: Effect) -> Array:
        """Return the change of every curve by the effect's typical amplitude, per unit of it.

        Raises
        ------
        SpecificationError
            If the effect has no meaning for a specimen, or a simulation does not reach the end.
        """
        model = dataclasses.replace(base.model, effect=effect)
        tests = [model.test(s.test, effect.typical) for s in self._specimens]
        curves = self._extrapolated(self._runs.curves([*map(self._task, tests)]))
        return (self._predictions(tests, curves) - base.force) / effect.typical

    def _predictions(self, tests: Sequence[BendingTest], curves: Sequence[pd.DataFrame]) -> Array:
        return np.array([recorded(t, c, self._at) for t, c in zip(tests, curves, strict=True)])

    def _slope(self, test: BendingTest, curve: pd.DataFrame, change: pd.Series) -> Array:
        """Return what a small change of the indenter's forces makes of the recorded ones."""
        small = 1e-3
        moved = curve.assign(force_N=curve["force_N"] + small * change)
        return (recorded(test, moved, self._at) - recorded(test, curve, self._at)) / small


def recorded(test: BendingTest, curve: pd.DataFrame, at_mm: Array) -> Array:
    """Return the force at displacements of the machine, N.

    Raises
    ------
    SpecificationError
        If the simulated curve ends before, or goes back: a soft machine unloads by more than the
        indenter goes on.
    """
    force = curve["force_N"].to_numpy()
    displacement = test.machine.displacement(curve["displacement_mm"].to_numpy(), force)
    if np.any(np.diff(displacement) <= 0.0):
        compliance = test.machine.compliance_mm_per_N
        allowed = "must be low enough for the recorded displacement to increase throughout"
        raise SpecificationError("machine.compliance_mm_per_N", compliance, allowed)
    if displacement[-1] < at_mm[-1] - 1e-9:
        allowed = f"must be reached, but the simulation ends at {displacement[-1]:.2f} mm"
        raise SpecificationError("displacement_mm", float(at_mm[-1]), allowed)
    inside = np.minimum(at_mm, displacement[-1])
    found = Akima1DInterpolator(displacement, force)(inside)
    return np.where(at_mm <= displacement[0], 0.0, found)


def _step(effect: Effect, amplitude: float) -> float:
    """Return a step of the amplitude that stays within the bounds."""
    step = DERIVATIVE_SHARE * effect.typical
    low, high = effect.bounds
    return step if low <= amplitude + step <= high else -step

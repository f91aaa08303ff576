"""Curves learned from few simulations, for stalks with a closed-form force."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from formula import AT_MM, Formula
from formula import force_N as formula_N
from scipy.optimize import approx_fprime

from ramiefenics import BendingTest, SpecificationError, override, ramie
from ramiefenics.discovery.curves.factors import Factor, apply_factors, factors
from ramiefenics.runs import Done
from ramiefenics.runs.curve import Change, CurveTask, Mapper
from ramiefenics.surrogate import LearnedCurves
from ramiefenics.surrogate.coordinates import Direction
from ramiefenics.surrogate.pool import CLOSE_TOLERANCE, TOLERANCE
from ramiefenics.surrogate.process import Observed, Process
from ramiefenics.surrogate.smoothing import smoothed

X_MM = np.linspace(0.0, 14.0, 29)


def force_N(test: BendingTest) -> np.ndarray:
    """Return the force on a layered beam whose section flattens; all parameters act nonlinearly."""
    radii = np.array(test.stalk.radii_mm)
    elastic = [layer.material.elastic for layer in test.stalk.layers]
    bending = 12.0 * np.pi * np.dot([e.E_Z_MPa for e in elastic], np.diff(radii**4))
    ring = np.dot([e.E_X_MPa for e in elastic], np.diff(radii) ** 3) / radii.mean()
    flattening = bending / test.fixture.span_mm**3 / (40.0 * ring)
    damage = sum(layer.material.large_strain.fibre_damage for layer in test.stalk.layers)
    x = X_MM * test.stalk.stiffness_factor
    return bending / test.fixture.span_mm**3 * x / (1.0 + flattening * x**2 / 100.0 + damage * x)


def slope(test: BendingTest, change: Change) -> np.ndarray:
    """Return a derivative, one-sided where a parameter is at its limit."""
    ends = []
    for amount in (-1e-5, 1e-5):
        with suppress(SpecificationError):
            ends.append((amount, force_N(change.apply(test, amount))))
    (low, before), (high, after) = ends if len(ends) == 2 else ((0.0, force_N(test)), *ends)
    return (after - before) / (high - low)


class Beams(Mapper):
    """Stand-in for `Runs` that counts tasks and records the requested derivatives."""

    def __init__(self) -> None:
        self.asked = 0
        self.directions: list[Change] = []

    def map(self, tasks: Sequence[CurveTask]) -> list[Done[pd.DataFrame]]:
        self.asked += len(tasks)
        self.directions += [factor for task in tasks for factor in task.factors]
        return [self._done(task) for task in tasks]

    def _done(self, task: CurveTask) -> Done[pd.DataFrame]:
        force = force_N(task.test)
        slopes = {factor.name: slope(task.test, factor) for factor in task.factors}
        return Done(pd.DataFrame({"displacement_mm": X_MM, "force_N": force, **slopes}))


class Breaking(Beams):
    """Beams of which those above a diameter break, and those far above it are refused."""

    def _done(self, task: CurveTask) -> Done[pd.DataFrame]:
        outer = task.test.stalk.outer_diameter_mm
        if outer > 16.5:
            return Done(None, SpecificationError("stalk", outer, "must be thinner"))
        done = super()._done(task)
        return Done(done.result()[X_MM <= 7.0]) if outer > 15.5 else done


def stalks(number: int, seed: int = 0) -> list[BendingTest]:
    rng = np.random.default_rng(seed)
    sizes = rng.normal((14.4, 7.4, 0.67), (0.6, 0.4, 0.05), (number, 3))
    return [ramie(*size) for size in sizes]


def of_own_moduli(tests: Sequence[BendingTest]) -> list[BendingTest]:
    """Return stalks whose moduli differ as well."""
    rng, used = np.random.default_rng(5), factors(tests[0])
    return [apply_factors(test, used, rng.normal(0.0, 0.05, len(used))) for test in tests]


def misses(tests: Sequence[BendingTest], curves: Sequence[pd.DataFrame], factor: Factor | None):
    """Return errors of the force or a derivative, relative to the peak."""
    found = []
    for test, curve in zip(tests, curves, strict=True):
        true = force_N(test)
        column, expected = "force_N", true
        if factor is not None:
            column = factor.name
            expected = (force_N(factor.apply(test, 1e-5)) - true) / 1e-5
        read = np.interp(X_MM, curve["displacement_mm"], curve[column])
        found.append(np.sqrt(((read - expected) ** 2).mean()) / true.max())
    return np.array(found)


def test_many_stalks_take_few_simulations() -> None:
    tests, beams = stalks(100), Beams()
    used = factors(tests[0])
    learned = LearnedCurves(beams)
    curves = [done.result() for done in learned.map([CurveTask(t, used) for t in tests])]
    assert learned.asked == 100
    assert learned.simulated == beams.asked < 20
    assert 0.0 < learned.error <= TOLERANCE
    errors = misses(tests, curves, None)
    assert np.sqrt((errors**2).mean()) < TOLERANCE
    assert np.quantile(errors, 0.95) < TOLERANCE  # two standard deviations
    for factor in used:  # a change of a tenth is as accurate
        assert 0.1 * np.quantile(misses(tests, curves, factor), 0.95) < TOLERANCE


def test_each_is_simulated_where_that_is_asked_for() -> None:
    tests, beams = stalks(30), Beams()
    learned = LearnedCurves(beams)
    learned.map([CurveTask(test, factors(tests[0])) for test in tests])
    before = beams.asked
    assert before < 20
    curves = [done.result() for done in learned.map([CurveTask(t) for t in tests], tolerance=0.0)]
    assert beams.asked == 30
    for test, curve in zip(tests, curves, strict=True):
        assert curve["force_N"].to_numpy() == pytest.approx(force_N(test), rel=1e-9)


def test_near_simulations_what_is_learned_is_as_good() -> None:
    """The moduli of these stalks differ; those that never did are not known well enough nearby."""
    tests, beams = of_own_moduli(stalks(30)), Beams()
    used = factors(tests[0])
    learned = LearnedCurves(beams)
    learned.map([CurveTask(test, used) for test in tests])
    learned.map([CurveTask(test) for test in tests], tolerance=0.0)
    before = beams.asked
    moved = [used[0].apply(used[3].apply(test, -0.04), 0.04) for test in tests]
    answers = learned.map([CurveTask(test) for test in moved], CLOSE_TOLERANCE)
    assert beams.asked < before + 6
    errors = misses(moved, [done.result() for done in answers], None)
    assert np.quantile(errors, 0.95) < CLOSE_TOLERANCE  # two standard deviations


def test_different_families_are_simulated_at_the_same_time() -> None:
    (test,), beams = stalks(1), Beams()
    kinds = [
        override(test, [f"numerics.mesh={name}"]) for name in ("screening", "standard", "fine")
    ]
    calls: list[int] = []

    class Counted(Beams):
        def map(self, tasks: Sequence[CurveTask]) -> list[Done[pd.DataFrame]]:
            calls.append(len(tasks))
            return beams.map(tasks)

    LearnedCurves(Counted()).map([CurveTask(kind) for kind in kinds])
    assert calls == [3]


def test_what_moves_on_takes_few_more() -> None:
    tests, beams = stalks(40), Beams()
    used = factors(tests[0])
    learned = LearnedCurves(beams)
    learned.map([CurveTask(test, used) for test in tests])
    before = beams.asked
    moved = [used[0].apply(used[3].apply(test, -0.3), 0.2) for test in tests]
    damaged = [
        override(test, ["stalk.layers.phloem.material.large_strain.fibre_damage=0.01"])
        for test in moved
    ]
    for changed in (moved, damaged):
        curves = [done.result() for done in learned.map([CurveTask(t, used) for t in changed])]
        assert misses(changed, curves, None).max() < 2.0 * TOLERANCE
    assert beams.asked - before < 12
    again = learned.map([CurveTask(test, used) for test in moved])
    assert beams.asked - before < 12
    assert len(again) == 40


@pytest.mark.parametrize("seed", range(6))
def test_numbers_that_did_not_differ_yet_are_not_taken_for_linear(seed: int) -> None:
    """Curves of thicker stalks are the same except for a factor, and tell nothing about moduli."""

    class Formulas(Formula):
        def map(self, tasks: Sequence[CurveTask]) -> list[Done[pd.DataFrame]]:
            self.asked += len(tasks)
            return super().map(tasks)

    tests, formulas = stalks(40, seed), Formulas()
    used = factors(tests[0])
    learned = LearnedCurves(formulas)
    learned.map([CurveTask(test, used) for test in tests])
    batch = np.random.default_rng(seed).normal(0.0, 0.2, len(used))
    moved = of_own_moduli([apply_factors(test, used, batch) for test in tests])
    curves = [done.result() for done in learned.map([CurveTask(test, used) for test in moved])]
    assert formulas.asked < 12
    upto = AT_MM <= 14.0
    for test, curve in zip(moved, curves, strict=True):
        true = formula_N(test)[upto]
        read = np.interp(AT_MM[upto], curve["displacement_mm"], curve["force_N"])
        assert np.sqrt(((read - true) ** 2).mean()) < TOLERANCE * true.max()


def test_numbers_that_only_go_together_are_changed_together() -> None:
    """If both coefficients of friction are equal, neither may change alone."""
    both = tuple(("fixture", "friction", kind) for kind in ("static", "dynamic"))
    gripping = Direction("gripping", both, (0.3, 0.3))
    stalks = [
        override(
            ramie(14.0 + 0.05 * k, 7.3, 0.67),
            ["fixture.friction.static=0.3", "fixture.friction.dynamic=0.3"],
        )
        for k in range(6)
    ]
    asked = [CurveTask(test, (*factors(test), gripping)) for test in stalks]
    curves = [done.result() for done in LearnedCurves(Beams()).map(asked)]
    assert misses(stalks, curves, None).max() < TOLERANCE
    for curve in curves:  # friction has no effect on these forces
        assert np.abs(curve["gripping"]).max() < 1e-6 * curve["force_N"].max()


def test_far_away_is_simulated() -> None:
    tests, beams = stalks(30), Beams()
    used = factors(tests[0])
    learned = LearnedCurves(beams)
    learned.map([CurveTask(test, used) for test in tests])
    before = beams.asked
    giant = ramie(40.0, 10.0, 4.0)
    (done,) = learned.map([CurveTask(giant, used)])
    assert beams.asked == before + 1
    assert done.result()["force_N"].to_numpy() == pytest.approx(force_N(giant), rel=1e-9)


def test_few_curves_without_derivatives_are_simulated_plainly() -> None:
    tests, beams = stalks(8), Beams()
    learned = LearnedCurves(beams)
    curves = [done.result() for done in learned.map([CurveTask(test) for test in tests])]
    assert beams.asked == 8
    assert learned.error == 0.0
    assert misses(tests, curves, None).max() < 1e-9


def test_early_ends_and_failures_are_not_learned() -> None:
    """Stalks near a broken one are simulated themselves."""
    tests = sorted(stalks(60), key=lambda test: test.stalk.outer_diameter_mm)
    tests = [*tests, ramie(17.0, 7.4, 0.67)]
    used = factors(tests[0])
    learned = LearnedCurves(Breaking())
    done = learned.map([CurveTask(test, used) for test in tests])
    assert isinstance(done[-1].error, SpecificationError)
    for test, one in zip(tests[:-1], done[:-1], strict=True):
        broken = test.stalk.outer_diameter_mm > 15.5
        assert (one.result()["displacement_mm"].iloc[-1] < 8.0) == broken


def test_where_many_curves_are_rough_all_are_refused() -> None:
    thick = [ramie(16.6 + 0.01 * k, 7.4, 0.67) for k in range(60)]
    tests, beams = [*stalks(60), *thick], Breaking()
    tests = [test for test in tests if not 15.5 < test.stalk.outer_diameter_mm < 16.5]
    used, learned = factors(tests[0]), LearnedCurves(beams)
    done = learned.map([CurveTask(test, used, smooth=True) for test in tests])
    assert all(isinstance(one.error, SpecificationError) for one in done)
    assert beams.asked < len(tests)
    # curves that may jump are simulated nevertheless
    kept = learned.map([CurveTask(test, used) for test in tests[:-60]])
    assert all(one.error is None for one in kept)


class Jumping(Beams):
    """Beams of which those above a diameter fail if jumps are not allowed.

    Attributes
    ----------
    drop
        Share of the force that is lost in the jump.
    expensive
        Number of simulations of a jump with derivatives, each of which takes many others.
    """

    drop = 0.0
    expensive = 0

    def _done(self, task: CurveTask) -> Done[pd.DataFrame]:
        if task.test.stalk.outer_diameter_mm > 15.5:
            if task.smooth:
                return Done(None, RuntimeError("it jumps"))
            self.expensive += bool(task.factors)
            curve = super()._done(task).result()
            return Done(curve.assign(force_N=(1.0 - self.drop) * curve["force_N"]))
        return super()._done(task)


def test_a_few_rough_curves_are_simulated_plainly() -> None:
    tests = [test for test in stalks(60) if test.stalk.outer_diameter_mm < 15.4]
    tests.append(ramie(15.8, 7.4, 0.67))
    used, beams = factors(tests[0]), Jumping()
    done = LearnedCurves(beams).map([CurveTask(test, used, smooth=True) for test in tests])
    curves = [one.result() for one in done]
    assert misses(tests, curves, None).max() < 2.0 * TOLERANCE
    for factor in used:  # learned from the others
        assert misses(tests, curves, factor).max() < 0.02
    assert beams.expensive == 0
    # it is differentiated nevertheless where its force is unlike that of the others
    beams.drop = 0.5
    done = LearnedCurves(beams).map([CurveTask(test, used, smooth=True) for test in tests[-8:]])
    assert done[-1].result()["force_N"].to_numpy() == pytest.approx(0.5 * force_N(tests[-1]))
    assert beams.expensive == 1


def test_only_rough_curves_are_refused_where_all_are_strict() -> None:
    tests = [ramie(15.8, 7.4, 0.67), *stalks(2)]
    used, beams = factors(tests[0]), Jumping()
    done = LearnedCurves(beams).map([CurveTask(test, used, True, strict=True) for test in tests])
    assert isinstance(done[0].error, RuntimeError)
    for test, one in zip(tests[1:], done[1:], strict=True):
        assert one.result()["force_N"].to_numpy() == pytest.approx(force_N(test))
    assert beams.expensive == 0


def test_numbers_of_one_sign_are_not_mixed() -> None:
    """Damages of two layers are at least zero: one cannot grow while the other falls below it."""
    layers = [("stalk", "layers", k, "material", "large_strain", "fibre_damage") for k in (0, 1)]
    damages = [Direction(f"layer_{path[2]}", (path,), (0.3,)) for path in layers]
    tests, beams = stalks(20), Beams()
    tests += [damages[k % 2].apply(test, 0.3) for k, test in enumerate(tests)]
    used = (*factors(tests[0]), *damages)
    learned = LearnedCurves(beams)
    curves = [one.result() for one in learned.map([CurveTask(t, used, smooth=True) for t in tests])]
    assert misses(tests, curves, None).max() < 2.0 * TOLERANCE
    for direction in beams.directions:
        assert not set(layers) < set(direction.paths)


def test_other_meshes_are_another_family() -> None:
    tests, beams = stalks(30), Beams()
    learned = LearnedCurves(beams)
    used = factors(tests[0])
    learned.map([CurveTask(test, used) for test in tests])
    before = beams.asked
    finer = [override(test, ["numerics.mesh.angular_elements=24"]) for test in tests]
    learned.map([CurveTask(test, used) for test in finer])
    assert beams.asked > before


def observations(number: int, seed: int) -> Observed:
    """Return values and gradients of two smooth functions of two variables."""
    rng = np.random.default_rng(seed)
    at, along, value, run = [], [], [], []
    for index in range(number):
        p, q = point = rng.uniform(-1.0, 1.0, 2)
        wave, ridge = np.sin(p + 2.0 * q), np.exp(0.5 * p * q)
        gradients = np.array(
            [
                [np.cos(p + 2.0 * q), 0.5 * q * ridge],
                [2.0 * np.cos(p + 2.0 * q), 0.5 * p * ridge],
            ]
        )
        at += [point] * 3
        along += [np.zeros(2), *np.eye(2)]
        value += [np.array([wave, ridge]), *gradients]
        run += [index] * 3
    return Observed(np.array(at), np.array(along), np.array(value), np.array(run))


def test_gradient_of_the_likelihood_is_that_of_differences() -> None:
    process = Process(observations(6, 1))
    there = np.log([0.9, 1.6, 2e-3, 1e-2])
    _, gradient = process._cost(there)
    differences = approx_fprime(there, lambda p: process._cost(p)[0], 1e-6)
    assert gradient == pytest.approx(differences, rel=1e-3, abs=1e-3)


def test_left_out_is_what_the_others_predict() -> None:
    """A process with the same lengths and noise, but without the run, has the same error there."""
    observed = observations(8, 2)
    process = Process(observed)
    errors, deviations = process.left_out()
    parameters = np.log([*process.lengths, process._noise[0], process._noise[1]])
    out = observed.run == 3
    rest = Process(
        Observed(observed.at[~out], observed.along[~out], observed.value[~out], observed.run[~out])
    )
    rest._set(parameters)
    here = observed.at[out][:1]
    missed = observed.value[out][:1] - rest.mean(here)
    assert errors[3] == pytest.approx(missed[0], rel=1e-5, abs=1e-9)
    # the deviation includes the noise of the omitted value; scales are those of all runs
    scale = np.sqrt(process._scale2 / rest._scale2)
    with_noise = np.sqrt(rest.sd(here)[0] ** 2 + process._noise[0] ** 2 * rest._scale2)
    assert deviations[3] == pytest.approx(scale * with_noise, rel=1e-5)


def test_what_one_run_alone_tells_cannot_be_left_out() -> None:
    """Only the last run depends on the second variable; without it the slope is unknown."""
    observed = observations(6, 5)
    at = observed.at.copy()
    at[:, 1] = 0.0
    kept = (observed.along[:, 1] == 0.0) | (observed.run == 5)
    alone = Process(
        Observed(at[kept], observed.along[kept], observed.value[kept], observed.run[kept])
    )
    errors, deviations = alone.left_out()
    told = [True] * 5 + [False]
    assert np.isfinite(errors).all(axis=1).tolist() == told
    assert np.isfinite(deviations).all(axis=1).tolist() == told


def test_process_knows_what_it_does_not() -> None:
    """At points between and beyond the runs, errors are as large as their deviations."""
    process = Process(observations(10, 3))
    rng = np.random.default_rng(4)
    at = rng.uniform(-1.3, 1.3, (200, 2))
    p, q = at.T
    errors = process.mean(at) - np.column_stack([np.sin(p + 2.0 * q), np.exp(0.5 * p * q)])
    ratio = np.sqrt(((errors / np.maximum(process.sd(at), 1e-9)) ** 2).mean(axis=0))
    assert np.all(ratio < 3.0)
    assert np.abs(errors[np.abs(at).max(axis=1) < 1.0]).max() < 0.02


def test_a_change_in_place_of_a_number_keeps_the_rest() -> None:
    test = ramie(14.4, 7.4, 0.67)
    other = replace(test, fixture=replace(test.fixture, span_mm=90.0))
    learned = LearnedCurves(Beams())
    one, two = learned.map([CurveTask(test), CurveTask(other)])
    assert one.result()["force_N"].iloc[-1] < two.result()["force_N"].iloc[-1]


def test_what_is_off_at_a_single_step_is_left_out_of_a_derivative() -> None:
    """What varies linearly, relative to the force, stays as it is."""
    x = np.append(np.linspace(0.0, 2.0, 5), np.linspace(3.0, 14.0, 12))
    force, relative = x / (1.0 + 0.05 * x), 0.3 + 0.02 * x
    assert smoothed(x, force, relative * force) == pytest.approx(relative * force, abs=1e-12)
    for at in (2.0, 8.0, 13.0):
        off = relative + np.where(x == at, 0.1, 0.0)
        assert smoothed(x, force, off * force) == pytest.approx(relative * force, rel=0.02)

"""Force curves of all runs of a design, simulated or learned from simulations of some."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd
from scipy.interpolate import Akima1DInterpolator

from ramiefenics.calibration.responses import Response
from ramiefenics.model.laws import check_law
from ramiefenics.runs import KeptRun, Runs, Simulation
from ramiefenics.runs.curve import CurveTask
from ramiefenics.solve.peak import find_peak
from ramiefenics.solve.result import BendingResult
from ramiefenics.specification import BendingTest
from ramiefenics.surrogate import TIME, Effort, LearnedCurves, simulations_to_learn

TOLERANCE = 0.005
"""Largest expected error of a learned curve, relative to its peak, at first."""

STATED = 0.015
"""Largest error of learned curves where they are checked, two standard deviations relative to their
peaks. Simulations scatter by a third of it, as the number of cells depends on the specification,
and response surfaces over wide ranges miss by two thirds of it."""

CHECKS = 10
"""Number of learned curves that are simulated as a check."""

ENDS = 1e-9
"""Distance, mm, within which a curve has reached the end of the travel."""


@dataclass(frozen=True)
class Outcome:
    """Outcome of a run of the design.

    Attributes
    ----------
    test
        Specification of the run.
    run
        Stored simulation; None if it failed with an error, or if the curve was learned.
    error
        Message of that error; empty if there was none.
    learned
        Learned curve up to the end of the travel, ``displacement_mm`` of the indenter and
        ``force_N``; None if the run was simulated.
    """

    test: BendingTest
    run: KeptRun | None = None
    error: str = ""
    learned: pd.DataFrame | None = None

    @property
    def result(self) -> BendingResult | None:
        """Result of the simulation; None if it failed, or if the curve was learned."""
        return None if self.run is None else self.run.result

    @property
    def recorded(self) -> tuple[pd.Series[float], pd.Series[float]] | None:
        """Displacement and force that the machine records; None if there is no curve."""
        curve = self.learned if self.result is None else self.result.curve
        if curve is None:
            return None
        displacement, force = self.test.machine.recorded(curve["displacement_mm"], curve["force_N"])
        return displacement, force

    def response(self, wanted: Response) -> float:
        """Return a response of the run; NaN if it cannot be computed."""
        if self.result is not None:
            return wanted.of_result(self.result)
        if self.learned is None:
            return np.nan
        x, force = (self.learned[name].to_numpy() for name in ("displacement_mm", "force_N"))
        return wanted.of_loading(self.learned, find_peak(x, force), self.test.machine)

    @property
    def ending(self) -> str:
        """``completed``, or the reason why the simulation did not complete."""
        if self.learned is not None:
            return "completed"
        if self.result is None:
            return f"failed: {self.error}"
        return "completed" if self.result.completed else self.result.ending.reason


@dataclass(frozen=True)
class Campaign:
    """All runs of a design.

    Attributes
    ----------
    outcomes
        Outcomes of the requested tests, in the same order.
    simulated
        Number of simulations that had not been done before.
    effort
        Number of curves and of the simulations that they took.
    """

    outcomes: tuple[Outcome, ...]
    simulated: int
    effort: Effort

    @property
    def distinct(self) -> int:
        """Number of distinct tests."""
        return len({id(outcome) for outcome in self.outcomes})


def run_campaign(tests: Sequence[BendingTest], runs: Runs | None = None) -> Campaign:
    """Simulate those tests that have not been simulated before, and equal ones only once.

    Parameters
    ----------
    tests
        Specifications to simulate.
    runs
        Runs the simulations; by default on all cores, with results kept in the user's cache.

    Raises
    ------
    SpecificationError
        If the law does not accept the constants of a layer; nothing is simulated in that case.
    KeyboardInterrupt, BrokenExecutor
        See `Runs.map`.
    """
    for test in tests:
        check_law(test)
    runs = Runs() if runs is None else runs
    before = runs.computed
    done = runs.map([Simulation(test) for test in tests])
    # equal tests share one outcome
    outcomes = {
        id(d): Outcome(test, d.value, "" if d.error is None else str(d.error))
        for test, d in zip(tests, done, strict=True)
    }
    effort = Effort(len(outcomes), len(outcomes), 0.0)
    return Campaign(tuple(outcomes[id(d)] for d in done), runs.computed - before, effort)


def design_campaign(
    tests: Sequence[BendingTest], runs: Runs, on_stage: Callable[[str, int], None], direct: bool
) -> Campaign:
    """Learn the curves of a design where that takes less time and is wanted; else simulate all.

    Parameters and errors are those of `calibrate`, but for

    tests
        Specifications of all runs of the design.
    """
    expected = None if direct else simulations_to_learn(tests)
    on_stage("simulating", expected or len(set(tests)))
    return learn_campaign(tests, runs) if expected else run_campaign(tests, runs)


def learn_campaign(tests: Sequence[BendingTest], runs: Runs) -> Campaign:
    """Learn the curves of tests, as far as they complete their travel; simulate the others.

    A few of the learned curves are simulated as a check. If they are not exact enough, more is
    simulated, and all tests are where that would take less time than learning.

    Parameters and errors are those of `run_campaign`.
    """
    for test in tests:
        check_law(test)
    before, learned = runs.computed, LearnedCurves(runs)
    distinct, tolerance = list(dict.fromkeys(tests)), TOLERANCE
    tasks = [CurveTask(test) for test in distinct]
    while TIME * learned.simulated < len(tasks):
        error = _checked(tasks, learned, tolerance)
        if error <= STATED:
            curves = [done.value for done in learned.map(tasks, tolerance)]
            outcomes = {
                test: Outcome(test, learned=curve)
                for test, curve in zip(distinct, curves, strict=True)
                if curve is not None and _complete(curve, test)
            }
            left = [test for test in distinct if test not in outcomes]
            outcomes |= dict(zip(left, run_campaign(left, runs).outcomes, strict=True))
            effort = Effort(len(tasks), learned.simulated + len(left), max(error, learned.error))
            return Campaign(tuple(map(outcomes.__getitem__, tests)), runs.computed - before, effort)
        tolerance /= 2.0
    return run_campaign(tests, runs)


def _checked(tasks: Sequence[CurveTask], learned: LearnedCurves, tolerance: float) -> float:
    """Learn curves; return the error of some that are then simulated, relative to their peaks.

    It is twice the root mean square over these curves, each with the larger of its root mean
    square over displacements and of the error of its maximum.
    """
    curves = [done.value for done in learned.map(tasks, tolerance)]
    unknown = [i for i, task in enumerate(tasks) if not learned.has_simulated(task)]
    chosen = np.random.default_rng(0).permutation(unknown)[:CHECKS].astype(int)
    errors = [0.0]
    checks = learned.map([tasks[i] for i in chosen], 0.0)
    for i, check in zip(chosen, checks, strict=True):
        curve, simulated = curves[i], check.value
        if curve is None or simulated is None or not _complete(simulated, tasks[i].test):
            continue  # simulated by itself in any case
        x, force = (simulated[name].to_numpy() for name in ("displacement_mm", "force_N"))
        top = find_peak(x, force).force_N
        read = Akima1DInterpolator(curve["displacement_mm"], curve["force_N"])(x)
        apart = float(np.sqrt(((read - force) ** 2).mean()))
        errors.append(max(apart, abs(float(curve["force_N"].max()) - top)) / top)
    return 2.0 * float(np.sqrt(np.mean(np.square(errors))))


def _complete(curve: pd.DataFrame, test: BendingTest) -> bool:
    return bool(curve["displacement_mm"].iloc[-1] > test.protocol.travel_mm - ENDS)

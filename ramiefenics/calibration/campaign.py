"""Simulation of all runs of a design."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ramiefenics.model.laws import check_law
from ramiefenics.runs import KeptRun, Runs, Simulation
from ramiefenics.solve.result import BendingResult
from ramiefenics.specification import BendingTest


@dataclass(frozen=True)
class Outcome:
    """Outcome of a simulation.

    Attributes
    ----------
    test
        Specification that was simulated.
    run
        Stored simulation; None if it failed with an error.
    error
        Message of that error; empty if there was none.
    """

    test: BendingTest
    run: KeptRun | None
    error: str = ""

    @property
    def result(self) -> BendingResult | None:
        """Result of the simulation; None if it failed."""
        return None if self.run is None else self.run.result

    @property
    def ending(self) -> str:
        """``completed``, or the reason why the simulation did not complete."""
        if self.result is None:
            return f"failed: {self.error}"
        return "completed" if self.result.completed else self.result.ending.reason


@dataclass(frozen=True)
class Campaign:
    """All simulations of a design.

    Attributes
    ----------
    outcomes
        Outcomes of the requested tests, in the same order.
    simulated
        Number of simulations that had not been done before.
    """

    outcomes: tuple[Outcome, ...]
    simulated: int

    @property
    def distinct(self) -> int:
        """Number of distinct tests."""
        return len({id(outcome) for outcome in self.outcomes})

    @property
    def cpu_s(self) -> float:
        """Processor time of all distinct simulations, whenever they were done, s."""
        runs = {id(o): o.run.cpu_s for o in self.outcomes if o.run is not None}
        return sum(runs.values())


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
    return Campaign(tuple(outcomes[id(d)] for d in done), runs.computed - before)

"""Many simulations on any executor, each kept on disk as soon as it is done."""

from __future__ import annotations

import os
import warnings
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import BrokenExecutor, Executor, as_completed
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from joblib.externals.loky import ProcessPoolExecutor
from mpi4py import MPI

from ramiefenics.kept import KeptRun, KeptRuns
from ramiefenics.model.laws import check_law
from ramiefenics.solve.result import BendingResult
from ramiefenics.specification import BendingTest, SpecificationWarning


@dataclass(frozen=True)
class Outcome:
    """What came of a simulation.

    Attributes
    ----------
    test
        The specification.
    run
        None if it failed with an error.
    error
        Why; empty if it did not.
    """

    test: BendingTest
    run: KeptRun | None
    error: str = ""

    @property
    def result(self) -> BendingResult | None:
        """The simulation, if there is one."""
        return None if self.run is None else self.run.result

    @property
    def ending(self) -> str:
        """Return ``completed``, or why not."""
        if self.result is None:
            return f"failed: {self.error}"
        return "completed" if self.result.completed else self.result.ending.reason


@dataclass(frozen=True)
class Campaign:
    """All simulations of a design.

    Attributes
    ----------
    outcomes
        One per test asked for, in their order.
    simulated
        How many had not been done before.
    """

    outcomes: tuple[Outcome, ...]
    simulated: int

    @property
    def distinct(self) -> int:
        """Number of tests that differ."""
        return len({id(outcome) for outcome in self.outcomes})

    @property
    def cpu_s(self) -> float:
        """Processor time of all distinct simulations, whenever they were done, s."""
        runs = {id(o): o.run.cpu_s for o in self.outcomes if o.run is not None}
        return sum(runs.values())


def run_campaign(
    tests: Sequence[BendingTest],
    executor: Executor | None = None,
    folder: Path | None = None,
    on_done: Callable[[int], None] = lambda number: None,
) -> Campaign:
    """Simulate tests that have not been simulated before; equal ones once.

    Parameters
    ----------
    tests
        What to simulate.
    executor
        Does the work, each test on one process: for instance mpi4py's `MPICommExecutor`, or
        dask.distributed's ``client.get_executor()``. By default as many local processes as there
        are cores.
    folder
        Where results are kept, `ramiefenics.kept.RUNS` by default. Workers elsewhere must see it.
    on_done
        Called with the number of distinct tests done since the last call.

    Raises
    ------
    SpecificationError
        If the law cannot take a layer's constants; nothing has been simulated then.
    KeyboardInterrupt
        If the user has interrupted it; finished runs are kept.
    BrokenExecutor
        If a worker died, of lack of memory perhaps; finished runs are kept.
    """
    for test in tests:
        check_law(test)
    kept = KeptRuns(MPI.COMM_SELF, folder)
    distinct = {kept.key(test): test for test in tests}
    outcomes = {key: Outcome(t, kept.run(t)) for key, t in distinct.items() if kept.has(t)}
    on_done(len(outcomes))
    left = {key: test for key, test in distinct.items() if key not in outcomes}
    if left:
        with workers(executor) as pool:
            futures = {pool.submit(simulate_kept, test, folder): key for key, test in left.items()}
            try:
                for future in as_completed(futures):
                    key = futures[future]
                    error = future.exception()
                    if isinstance(error, (KeyboardInterrupt, BrokenExecutor)):
                        raise error
                    run = None if error is not None else future.result()
                    outcomes[key] = Outcome(left[key], run, "" if error is None else str(error))
                    on_done(1)
            except BaseException:
                for future in futures:
                    future.cancel()
                raise
    return Campaign(tuple(outcomes[kept.key(test)] for test in tests), len(left))


@contextmanager
def workers(executor: Executor | None = None) -> Iterator[Executor]:
    """Lend an executor: the given one, or as many local processes as there are cores.

    The local ones start when there is work, and end with the block, at once where it fails.
    """
    if executor is not None:
        yield executor
        return
    # not joblib's reusable one, which its own Parallel, used elsewhere, expects for itself
    pool = ProcessPoolExecutor(max_workers=len(os.sched_getaffinity(0)))
    try:
        yield pool
    except BaseException:
        pool.shutdown(wait=True, kill_workers=True)
        raise
    pool.shutdown()


def simulate_kept(test: BendingTest, folder: Path | None = None) -> KeptRun:
    """Simulate a test in this process alone, unless it is kept already."""
    with warnings.catch_warnings(action="ignore", category=SpecificationWarning):
        return KeptRuns(MPI.COMM_SELF, folder).run(test)

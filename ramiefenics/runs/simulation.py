"""Whole simulations, as tasks or on all ranks together."""

from __future__ import annotations

import dataclasses
import json
import time
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import pandas as pd
from mpi4py import MPI

from ramiefenics.model.laws import law_content
from ramiefenics.model.observables import Observables
from ramiefenics.runs.store import Store, key_of
from ramiefenics.solve.quasistatic import Ending, Jump, Step
from ramiefenics.solve.result import BendingResult, Statistics
from ramiefenics.solve.simulate import simulate
from ramiefenics.specification import BendingTest, SpecificationWarning
from ramiefenics.specification.files import to_dict


@dataclass(frozen=True)
class KeptRun:
    """Result of a simulation that was done now or before.

    Attributes
    ----------
    result
        Result without snapshots.
    cpu_s
        Processor time, summed over all ranks.
    """

    result: BendingResult
    cpu_s: float


@dataclass(frozen=True)
class Simulation:
    """Task that simulates a test.

    Attributes
    ----------
    test
        Test to simulate.
    ranks
        Number of MPI ranks; one for a task of `Runs`.
    """

    test: BendingTest
    ranks: int = 1

    def keys(self) -> tuple[str, ...]:
        """Return the name under which it is kept, which does not depend on the names of files."""
        mesh = dataclasses.replace(self.test.numerics.mesh, name="")
        numerics = dataclasses.replace(self.test.numerics, mesh=mesh)
        content = to_dict(dataclasses.replace(self.test.alone, numerics=numerics))
        content["law"] = law_content(self.test.law)
        return (key_of([content, self.ranks], __file__),)

    def compute(self) -> str:
        """Simulate in this process alone; return the text to keep."""
        with warnings.catch_warnings(action="ignore", category=SpecificationWarning):
            return _compute(self.test, MPI.COMM_SELF)

    def read(self, text: str) -> KeptRun:
        """Return the result that a kept text describes."""
        content = json.loads(text)
        result = BendingResult(
            self.test.alone,
            pd.DataFrame(content["curve"]),
            (),
            Statistics(**content["statistics"]),
            Ending(**content["ending"]),
            tuple(Jump(**jump) for jump in content["jumps"]),
        )
        return KeptRun(result, content["cpu_s"])


class SharedRuns:
    """Simulates tests one after another on all ranks together, unless they were done before.

    Parameters
    ----------
    comm
        MPI communicator, all of whose ranks call; the world by default.
    folder
        Folder in which results are kept, `RUNS` by default.
    """

    def __init__(self, comm: MPI.Comm | None = None, folder: Path | None = None) -> None:
        self.comm = MPI.COMM_WORLD if comm is None else comm
        self._store = Store(folder)

    def has(self, test: BendingTest) -> bool:
        """Return whether a test has been simulated; collective."""
        return self._text(Simulation(test, self.comm.size)) is not None

    def run(
        self, test: BendingTest, on_step: Callable[[Step[Observables]], None] | None = None
    ) -> KeptRun:
        """Return the result of a test; collective.

        Raises
        ------
        SpecificationError
            If the law cannot take a layer's constants.
        KeyboardInterrupt
            If the user interrupts the simulation; nothing of it is kept.
        """
        task = Simulation(test, self.comm.size)
        text = self._text(task)
        if text is None:
            text = _compute(test, self.comm, on_step)
            if self.comm.rank == 0:
                self._store.put(task.keys(), text)
        return task.read(text)

    def _text(self, task: Simulation) -> str | None:
        """Return the kept text of a task, or None if there is none; collective."""
        text = self._store.get(task.keys()[0]) if self.comm.rank == 0 else None
        return self.comm.bcast(text)


def _compute(
    test: BendingTest,
    comm: MPI.Comm,
    on_step: Callable[[Step[Observables]], None] | None = None,
) -> str:
    """Simulate; return the text to keep, the same on all ranks."""
    start = time.process_time()
    result = simulate(test.alone, comm, on_step)
    if result.ending.kind == "interrupted":
        raise KeyboardInterrupt
    content = {
        "curve": result.curve.to_dict("list"),
        "statistics": dataclasses.asdict(result.statistics),
        "ending": dataclasses.asdict(result.ending),
        "jumps": [dataclasses.asdict(jump) for jump in result.jumps],
        "cpu_s": comm.allreduce(time.process_time() - start),
    }
    return str(comm.bcast(json.dumps(content)))

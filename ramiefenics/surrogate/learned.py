"""Tasks for force curves, most of them answered by what was learned from some."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import pandas as pd

from ramiefenics.runs import Done
from ramiefenics.runs.curve import CurveTask, Mapper, normalised
from ramiefenics.surrogate.coordinates import Path, numbers, rest_of
from ramiefenics.surrogate.pool import TOLERANCE, Pool, Simulating


class LearnedCurves:
    """Answers tasks for curves as `Runs` does, from few simulations.

    What is asked for differs by numbers of stalk and fixture. A few of the specifications are
    simulated, with derivatives by all directions in which they differ; a Gaussian process learns
    from these, at every displacement, the logarithm of the force. More are simulated, always those
    of which least is known, until the error to be expected of all others is below `TOLERANCE`. So
    a specification outside of what was learned is simulated itself.

    Parameters
    ----------
    runs
        Does the simulations.

    Attributes
    ----------
    runs
        As given.
    asked
        Tasks so far.
    """

    def __init__(self, runs: Mapper) -> None:
        self.runs = runs
        self._pools: dict[tuple[str, tuple[Path, ...]], Pool] = {}
        self.asked = 0

    @property
    def simulated(self) -> int:
        """Simulations so far."""
        return sum(len(pool.runs) for pool in self._pools.values())

    @property
    def error(self) -> float:
        """Largest error to be expected of a learned curve, over its peak."""
        return max((pool.error for pool in self._pools.values()), default=0.0)

    def map(
        self, tasks: Sequence[CurveTask], tolerance: float = TOLERANCE
    ) -> list[Done[pd.DataFrame]]:
        """Return what came of tasks, in their order.

        Parameters
        ----------
        tasks
            Of any families.
        tolerance
            Largest error to be expected of what is not simulated, over the peak; zero for none.
        """
        self.asked += len(tasks)
        members: dict[tuple[str, tuple[Path, ...]], list[int]] = {}
        for index, task in enumerate(tasks):
            test, _ = normalised(task.test)
            members.setdefault((rest_of(test), tuple(numbers(test))), []).append(index)
        found: dict[int, Done[pd.DataFrame]] = {}
        asking = []
        for key, indices in members.items():
            pool = self._pools.setdefault(key, Pool(key[1]))
            asking.append((indices, pool.answer([tasks[index] for index in indices], tolerance)))
        for indices, answers in self._together(asking):
            found |= dict(zip(indices, answers, strict=True))
        return [found[index] for index in range(len(tasks))]

    def _together(
        self, asking: Sequence[tuple[list[int], Simulating[list[Done[pd.DataFrame]]]]]
    ) -> Iterator[tuple[list[int], list[Done[pd.DataFrame]]]]:
        """Yield what pools answer to whom; what they want simulated at a time is done together."""
        left: list[tuple[Any, Any, list[Done[pd.DataFrame]] | None]]
        left = [(indices, pool, None) for indices, pool in asking]
        while left:
            wanted = []
            for indices, pool, simulated in left:
                try:
                    wanted.append((indices, pool, pool.send(simulated)))
                except StopIteration as end:
                    yield indices, end.value
            simulating = [task for *_, tasks in wanted for task in tasks]
            done = iter(self.runs.map(simulating) if simulating else ())
            left = [(i, pool, [next(done) for _ in tasks]) for i, pool, tasks in wanted]

"""Force curves, most of which are learned from simulations of a few."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import pandas as pd

from ramiefenics.runs import Done
from ramiefenics.runs.curve import CurveTask, Mapper, normalised
from ramiefenics.specification import BendingTest
from ramiefenics.specification.replacing import Path
from ramiefenics.surrogate.coordinates import MAY_BE_NEGATIVE, numbers, rest_of
from ramiefenics.surrogate.effort import Effort
from ramiefenics.surrogate.pool import TOLERANCE, Pool


@dataclass(frozen=True)
class Kind:
    """What specifications have in common if their curves are learned together.

    Attributes
    ----------
    rest
        Everything but the numbers, as text.
    paths
        Paths of the numbers.
    nothing
        Those of the numbers that are zero and cannot be negative, such as a damage. Curves may
        have a kink there, and those without damage tell little of those with it.
    """

    rest: str
    paths: tuple[Path, ...]
    nothing: tuple[Path, ...]

    @classmethod
    def of(cls, test: BendingTest) -> Kind:
        """Return the kind of a specification."""
        test, _ = normalised(test)
        values = numbers(test)
        nothing = (
            path for path in values if values[path] == 0.0 and path[-1] not in MAY_BE_NEGATIVE
        )
        return cls(rest_of(test), tuple(values), tuple(nothing))


class LearnedCurves(Mapper):
    """Computes tasks for curves as `Runs` does, but from few simulations.

    The specifications asked for differ by numbers of stalk and fixture. A few of them are
    simulated, with derivatives along all directions in which they differ; from these, a Gaussian
    process learns the logarithm of force over displacement at every displacement. Further ones are
    simulated, always those about which least is known, until the expected error of all others is
    below `TOLERANCE`. A specification outside the range of what was learned is thus simulated
    itself.

    Parameters
    ----------
    runs
        Runs the simulations.

    Attributes
    ----------
    runs
        What runs the simulations.
    asked
        Number of tasks so far.
    """

    def __init__(self, runs: Mapper) -> None:
        self.runs = runs
        self._pools: dict[Kind, Pool] = {}
        self.asked = 0

    @property
    def simulated(self) -> int:
        """Number of simulations so far."""
        return sum(len(pool.runs) for pool in self._pools.values())

    @property
    def error(self) -> float:
        """Largest expected error of a learned curve, relative to its peak."""
        return max((pool.error for pool in self._pools.values()), default=0.0)

    @property
    def effort(self) -> Effort:
        """Number of curves, and of the simulations that they took."""
        return Effort(self.asked, self.simulated, self.error)

    def has_simulated(self, task: CurveTask) -> bool:
        """Return whether the specification of a task has been simulated itself."""
        pool = self._pools.get(Kind.of(task.test))
        return pool is not None and pool.has_simulated(task)

    def map(
        self, tasks: Sequence[CurveTask], tolerance: float = TOLERANCE
    ) -> list[Done[pd.DataFrame]]:
        """Return the outcomes of tasks, in their order.

        Parameters
        ----------
        tasks
            Tasks of any families.
        tolerance
            Largest expected error of a curve that is not simulated, relative to its peak; zero to
            simulate all.
        """
        self.asked += len(tasks)
        members: dict[Kind, list[int]] = {}
        for index, task in enumerate(tasks):
            members.setdefault(Kind.of(task.test), []).append(index)
        pools = [self._pools.setdefault(kind, Pool(kind.paths)) for kind in members]
        answers = self.runs.together(
            [
                pool.answer([tasks[index] for index in indices], tolerance)
                for pool, indices in zip(pools, members.values(), strict=True)
            ]
        )
        found = {
            index: answer
            for indices, own in zip(members.values(), answers, strict=True)
            for index, answer in zip(indices, own, strict=True)
        }
        return [found[index] for index in range(len(tasks))]

"""Many simulations on all cores, each curve kept by the content of its specification."""

from __future__ import annotations

import inspect
import io
import os
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import joblib
import pandas as pd

from ramiefenics.discovery.factors import Factor
from ramiefenics.kept import Shelf, key_of
from ramiefenics.specification import BendingTest, Machine, SpecificationWarning
from ramiefenics.specification.files import to_dict

MODULUS_MPA = 1000.0
"""Of the outermost layer along the fibres in what is simulated."""


@dataclass(frozen=True)
class Task:
    """A simulation to do.

    Attributes
    ----------
    test
        What to simulate. Its machine does not matter.
    factors
        By which to differentiate the curve.
    """

    test: BendingTest
    factors: tuple[Factor, ...] = ()

    def key(self) -> str:
        """Return a name for what comes out."""
        test, _ = bare(self.test)
        content = [to_dict(test), [to_dict(factor) for factor in self.factors]]
        return key_of(content, __file__, inspect.getfile(Factor))


class Runs:
    """Does tasks, two at a time on two cores, unless they have been done before.

    Parameters
    ----------
    folder
        Where curves are kept, `ramiefenics.kept.RUNS` by default.
    workers
        Processes; one per core by default.
    on_done
        Called with the number of tasks done since the last call.

    Attributes
    ----------
    asked, simulated
        Tasks so far; those of them that had not been done before.
    """

    def __init__(
        self,
        folder: Path | None = None,
        workers: int | None = None,
        on_done: Callable[[int], None] | None = None,
    ) -> None:
        self._shelf = Shelf("csv", folder)
        self._workers = workers or len(os.sched_getaffinity(0))
        self._on_done = on_done or (lambda number: None)
        self.asked = self.simulated = 0

    def curves(self, tasks: Sequence[Task]) -> list[pd.DataFrame]:
        """Return the curves of tasks, in their order.

        Each has ``displacement_mm`` (of the indenter), ``force_N``, and a column per factor: the
        force's derivative by the logarithm of the factor, N.
        """
        keys = [task.key() for task in tasks]
        self.asked += len(tasks)
        kept = {key: self._shelf.get(key) for key in keys}
        texts = {key: text for key, text in kept.items() if text is not None}
        left = {key: task for key, task in zip(keys, tasks, strict=True) if key not in texts}
        self._on_done(len(tasks) - len(left))
        parallel = joblib.Parallel(self._workers, return_as="generator_unordered")
        for task, text in parallel(joblib.delayed(run)(task) for task in left.values()):
            for key in {task.key(), replace(task, factors=()).key()}:
                self._shelf.put(key, text)
                texts[key] = text
            self.simulated += 1
            self._on_done(1)
        curves = [pd.read_csv(io.StringIO(texts[key])) for key in keys]
        for task, curve in zip(tasks, curves, strict=True):
            curve[curve.columns[1:]] *= bare(task.test)[1]
        return curves


def run(task: Task) -> tuple[Task, str]:
    """Do a task in this process; return it with its curve as CSV, in `bare` moduli."""
    from mpi4py import MPI

    from ramiefenics.solve.sensitivity import Parameter, sensitivities
    from ramiefenics.solve.simulate import simulate

    with warnings.catch_warnings(action="ignore", category=SpecificationWarning):
        test, _ = bare(task.test)
        if task.factors:
            parameters = {f.name: Parameter(f.apply, f.TYPICAL) for f in task.factors}
            curve = sensitivities(test, parameters, MPI.COMM_SELF).curve
        else:
            result = simulate(test, MPI.COMM_SELF)
            if result.ending.kind == "interrupted":
                raise KeyboardInterrupt
            curve = result.curve[["displacement_mm", "force_N"]]
    text = io.StringIO()
    curve.to_csv(text, index=False)
    return task, text.getvalue()


def bare(test: BendingTest) -> tuple[BendingTest, float]:
    """Return the simplest specification whose forces are proportional, and the factor to them.

    Where all stresses scale with the moduli, so do forces: one simulation serves all stalks that
    differ by a factor on all moduli.
    """
    stalk = test.stalk
    factor = stalk.layers[-1].material.elastic.E_Z_MPa * stalk.stiffness_factor / MODULUS_MPA
    scale = stalk.stiffness_factor / factor
    layers = tuple(replace(layer, material=layer.material.scaled(scale)) for layer in stalk.layers)
    stalk = replace(
        stalk,
        layers=layers,
        position_mm=0.0,
        stiffness_gradient_per_m=0.0,
        reference_position_mm=0.0,
    )
    if stalk.taper == 0.0:
        stalk = replace(stalk, measured_at_mm=0.0)
    numerics = replace(
        test.numerics, acoustic_check=False, mesh=replace(test.numerics.mesh, name="")
    )
    return replace(test, stalk=stalk, machine=Machine(), numerics=numerics), factor

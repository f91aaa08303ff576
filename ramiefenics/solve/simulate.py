"""The one function that maps a specification to a result."""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Callable

import pandas as pd
from mpi4py import MPI

from ramiefenics.model.bending import BendingProblem
from ramiefenics.model.observables import Observables, Observer
from ramiefenics.model.snapshot import Camera, Snapshot
from ramiefenics.solve.interrupt import stop_on_interrupt
from ramiefenics.solve.quasistatic import QuasiStatic, Step
from ramiefenics.solve.result import BendingResult, Statistics
from ramiefenics.specification import BendingTest


def simulate(
    test: BendingTest,
    comm: MPI.Comm | None = None,
    on_step: Callable[[Step], None] | None = None,
) -> BendingResult:
    """Bend a stalk.

    The first Ctrl-C ends the run after the current step, and the result holds everything up to
    there.

    Parameters
    ----------
    test
        The specification.
    comm
        MPI communicator, all of whose ranks call; the world by default.
    on_step
        Called after every converged step, on all ranks, for instance to show progress.

    Returns
    -------
    BendingResult
        Complete, or up to where it failed or was interrupted: `BendingResult.failure` tells.

    Raises
    ------
    SpecificationError
        If the law cannot take a layer's constants.
    """
    comm = MPI.COMM_WORLD if comm is None else comm
    start = time.perf_counter()
    problem = BendingProblem(test, comm)
    observer = Observer(problem)
    camera = Camera(problem, observer.surface)
    stepper = QuasiStatic(problem, observer)
    steps: list[Step] = []
    snapshots: list[Snapshot | None] = []
    failure = None
    with stop_on_interrupt(comm) as request:
        for step in stepper.steps():
            steps.append(step)
            if step.save:
                snapshots.append(camera.take(step.travel_mm))
            if on_step is not None:
                on_step(step)
            if request.agreed():
                failure = f"interrupted at {step.travel_mm:.3f} mm of travel"
                break
    if stepper.failure is not None:
        failure = stepper.failure.reason
    cells = problem.tube.mesh.topology.index_map(problem.tube.mesh.topology.dim)
    statistics = Statistics(
        dofs=problem.unknowns,
        cells=int(cells.size_global),
        steps=len(steps),
        newton_iterations=stepper.newton_iterations,
        cut_backs=stepper.cut_backs,
        wall_s=time.perf_counter() - start,
        ranks=comm.size,
    )
    kept = tuple(snapshot for snapshot in snapshots if snapshot is not None)
    return BendingResult(test, _curve(test, steps), kept, statistics, failure)


def _curve(test: BendingTest, steps: list[Step]) -> pd.DataFrame:
    """Tabulate steps, starting from the untouched stalk, and sum up works."""
    untouched = dict.fromkeys((f.name for f in dataclasses.fields(Observables)), 0.0)
    diameter, void = test.stalk.outer_diameter_mm, test.stalk.void_diameter_mm
    untouched |= {
        "section_height_mm": diameter,
        "section_width_mm": diameter,
        "void_height_mm": void if void else float("nan"),
    }
    rows = [untouched, *(dataclasses.asdict(step.observables) for step in steps)]
    curve = pd.DataFrame(rows)
    curve.insert(0, "displacement_mm", [0.0, *(step.travel_mm for step in steps)])
    curve["newton_iterations"] = [0, *(step.iterations for step in steps)]
    curve["friction_work_Nmm"] = curve["friction_work_Nmm"].cumsum()
    mean_force = curve["force_N"].rolling(2).mean().fillna(0.0)
    travel = curve["displacement_mm"].diff().fillna(0.0)
    curve["indenter_work_Nmm"] = (mean_force * travel).cumsum()
    return curve

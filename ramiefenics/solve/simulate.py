"""Simulation of bending tests, from a specification to a result."""

from __future__ import annotations

import dataclasses
import gc
import logging
import time
from collections.abc import Callable
from functools import partial
from typing import Any

import pandas as pd
from dolfinx.mesh import Mesh
from mpi4py import MPI
from petsc4py import PETSc

from ramiefenics.model.bending import BendingProblem
from ramiefenics.model.observables import Observables, Observer
from ramiefenics.model.snapshot import Camera, Snapshot
from ramiefenics.model.tube import TubeMesh, build_tube
from ramiefenics.notebook import notebook_bar
from ramiefenics.solve.interrupt import stop_on_interrupt
from ramiefenics.solve.quasistatic import Ending, QuasiStatic, Step
from ramiefenics.solve.rest import come_to_rest
from ramiefenics.solve.result import BendingResult, Statistics
from ramiefenics.solve.solutions import Solutions
from ramiefenics.specification import BendingTest, SpecificationError
from ramiefenics.specification.sources import Source, as_test

log = logging.getLogger(__name__)


def simulate(
    test: Source = "table3",
    comm: MPI.Comm | None = None,
    on_step: Callable[[Step[Observables]], None] | None = None,
    tube: TubeMesh | None = None,
    solutions: Solutions | None = None,
    **changes: Any,
) -> BendingResult:
    """Simulate the bending of a stalk.

    The first Ctrl-C ends the run after the current step, and the result holds everything up to
    there.

    Parameters
    ----------
    test
        The specification, its TOML file, or the name of a published one.
    comm
        MPI communicator, all of whose ranks call; the world by default.
    on_step
        Called after every converged step, on all ranks, for instance to show progress. By default
        there is a progress bar in the output of a notebook's cell, and nothing elsewhere.
    tube
        Mesh of the stalk from any source, to use in place of the recipe's; refused if there are
        further tests.
    solutions
        Solutions stored by an earlier run of the same test, further tests included. The run
        continues from there, and its result is that of an uninterrupted run, to the bit.
    changes
        Changes to the specification, see `as_test`: ``simulate("table3", mesh="screening")``.

    Returns
    -------
    BendingResult
        The whole result, or that up to the point where the run ended early, see
        `BendingResult.ending`. A further test is included if all tests before it were completed.

    Raises
    ------
    SpecificationError
        If the law cannot take a layer's constants, or growth stress leaves the stalk without an
        equilibrium; if a name, a file or a change is refused.
    """
    test = as_test(test, **changes)
    comm = MPI.COMM_WORLD if comm is None else comm
    if tube is not None and test.further:
        raise SpecificationError("tube", None, "must be left out if there are further tests")
    done, meshes = _bend_all(test, comm, on_step, solutions, tube)
    if comm.size > 1:  # there PETSc frees dropped objects only when all ranks ask for it
        gc.collect()  # drop reference cycles, too
        for mesh in meshes:
            PETSc.garbage_cleanup(mesh.comm)
    return dataclasses.replace(done[0], test=test, further=tuple(done[1:]))


def _bend_all(
    test: BendingTest,
    comm: MPI.Comm,
    on_step: Callable[[Step[Observables]], None] | None,
    solutions: Solutions | None,
    tube: TubeMesh | None,
) -> tuple[list[BendingResult], list[Mesh]]:
    """Simulate all tests of a stalk; return their results and meshes."""
    start = time.perf_counter()
    first, *further = test.tests
    cylinders = [cylinder for one in test.tests for cylinder in one.fixture.cylinders]
    tube = build_tube(first, comm, cylinders) if tube is None else tube
    problem = BendingProblem(first, comm, tube)
    come_to_rest(problem)
    done, meshes = [_bend(problem, start, on_step, solutions)], [tube.mesh]
    for one in further:
        if not done[-1].completed:
            break
        start = time.perf_counter()
        before, problem = problem, BendingProblem(one, comm, build_tube(one, comm, cylinders))
        problem.take_over(before)
        kept = None if solutions is None else solutions.of_further()
        done.append(_bend(problem, start, on_step, kept))
        meshes.append(problem.tube.mesh)
    return done, meshes


def _bend(
    problem: BendingProblem,
    start: float,
    on_step: Callable[[Step[Observables]], None] | None,
    solutions: Solutions | None,
) -> BendingResult:
    """Simulate one test; its wall time is counted from `start`."""
    test, comm = problem.test, problem.tube.mesh.comm
    observer = Observer(problem)
    camera = Camera(problem, observer)
    numerics = test.numerics
    log.info("%d unknowns, law %s, %d ranks", problem.unknowns, test.law, comm.size)
    log.info("PETSc options: %s", PETSc.Options().getAll())
    stepper = QuasiStatic(
        problem, observer.observe, test.protocol, numerics.stepping, solutions=solutions
    )
    steps: list[Step[Observables]] = []
    snapshots: list[Snapshot | None] = []
    interrupted = None
    bar = notebook_bar(test.protocol.duration_s)
    with stop_on_interrupt(comm) as request, bar as show:
        tell = on_step or partial(_show, show)
        for step in stepper.steps():
            if step.save:
                searched = observer.search(step.observables)
                step = dataclasses.replace(step, observables=searched)
            if step.save or not steps:
                snapshots.append(camera.take(step.travel_mm, step.time_s))
            steps.append(step)
            tell(step)
            if request.agreed():
                reason = f"interrupted at {step.travel_mm:.3f} mm of travel"
                interrupted = Ending("interrupted", reason)
                break
    wall_s, repeated = time.perf_counter() - start, 0 if solutions is None else solutions.kept
    statistics = _statistics(problem, stepper, len(steps) - 1, wall_s, repeated)
    kept = tuple(snapshot for snapshot in snapshots if snapshot is not None)
    ending = interrupted or stepper.ending
    assert ending is not None  # otherwise the steps would go on
    log.info("%s %s", ending.kind, ending.reason)
    jumps = tuple(step.jump for step in steps if step.jump is not None)
    return BendingResult(test, _curve(test, steps), kept, statistics, ending, jumps)


def _show(show: Callable[[float, str], None], step: Step[Observables]) -> None:
    show(step.time_s, f"{step.travel_mm:.2f} mm, {step.observables.force_N:.1f} N")


def _statistics(
    problem: BendingProblem,
    stepper: QuasiStatic[Observables],
    steps: int,
    wall_s: float,
    repeated: int,
) -> Statistics:
    mesh = problem.tube.mesh
    return Statistics(
        dofs=problem.unknowns,
        cells=int(mesh.topology.index_map(mesh.topology.dim).size_global),
        steps=steps,
        newton_iterations=stepper.newton_iterations,
        linear_iterations=stepper.newton.tangent.iterations,
        cut_backs=stepper.cut_backs,
        wall_s=wall_s,
        ranks=mesh.comm.size,
        repeated=repeated,
    )


def _curve(test: BendingTest, steps: list[Step[Observables]]) -> pd.DataFrame:
    """Tabulate the steps, from the unloaded stalk on, and integrate the indenter's work."""
    curve = pd.DataFrame([dataclasses.asdict(step.observables) for step in steps])
    curve.insert(0, "displacement_mm", [step.travel_mm for step in steps])
    curve.insert(1, "time_s", [step.time_s for step in steps])
    displacement, force = test.machine.recorded(curve["displacement_mm"], curve["force_N"])
    curve.insert(1, "recorded_displacement_mm", displacement)
    curve.insert(2, "recorded_force_N", force)
    curve["newton_iterations"] = [step.iterations for step in steps]
    mean_force = curve["force_N"].rolling(2).mean().fillna(0.0)
    travel = curve["displacement_mm"].diff().fillna(0.0)
    curve["indenter_work_Nmm"] = (mean_force * travel).cumsum()
    return curve

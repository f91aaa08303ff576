"""Simulation of one specification on a ladder of meshes."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd

from ramiefenics.convergence.outcome import Convergence
from ramiefenics.convergence.richardson import order_and_limit
from ramiefenics.model.grading import axial_positions
from ramiefenics.model.laws import check_law
from ramiefenics.model.observables import Observables
from ramiefenics.notebook import notebook_bar
from ramiefenics.runs import KeptRun, Runs, SharedRuns, Simulation
from ramiefenics.solve.quasistatic import Step
from ramiefenics.specification import BendingTest, SpecificationError, override
from ramiefenics.specification.sources import Source, as_test

LADDERS = {order: tuple(f"ladder_q{order}_{step}" for step in range(1, 6)) for order in (1, 2)}
"""Mesh recipes by element order, coarsest first."""

LEAST_MESHES = 3
"""Smallest number of meshes from which an order can be observed."""

SHARES = (2.0 / 7.0, 4.0 / 7.0, 1.0)
"""Fractions of the travel at which forces are compared: 4, 8 and 14 of 14 mm."""

MODELLED = {"quarter": 0.25, "half": 0.5, "full": 1.0}

COST_EXPONENT = 1.5
"""Approximate exponent with which run time grows with the number of cells.

In the ladders' runs on the calibration stalk it is 1.3 to 1.8."""

Progress = Callable[[float, str], None]


def converge(
    test: Source,
    order: int = 2,
    meshes: int = 5,
    runs: SharedRuns | Runs | None = None,
    on_progress: Progress | None = None,
    **changes: Any,
) -> Convergence:
    """Bend a stalk on a ladder of meshes, and extrapolate to vanishing mesh size.

    Parameters
    ----------
    test
        The specification, its file, or the name of a published one. The ladder's recipes replace
        its mesh.
    order
        Element order, 1 or 2.
    meshes
        Number of the ladder's meshes to use, from the coarsest: 3 to 5.
    runs
        Runs the simulations: `SharedRuns`, the default, one after another on all ranks; `Runs`,
        several at a time.
    on_progress
        Called with the fraction of the estimated cost that is done, and a text on the state; not
        with `Runs`, which reports its own progress. By default there is a progress bar in the
        output of a notebook's cell, and nothing elsewhere.
    changes
        Changes to the specification, see `as_test`.

    Raises
    ------
    SpecificationError
        If the order or the number of meshes is not one of these, or the test cannot be simulated.
    KeyboardInterrupt
        If the user interrupts the study; finished meshes are kept.
    """
    check_ladder(order, meshes)
    test = as_test(test, **changes)
    check_law(test)
    names = LADDERS[order][:meshes]
    tests = [override(test, [f"numerics.mesh={name}"]) for name in names]
    if isinstance(runs, Runs):
        done = tuple(one.result() for one in runs.map([Simulation(test) for test in tests]))
    else:
        with notebook_bar(1.0) as show:
            done = tuple(_simulate(tests, runs or SharedRuns(), on_progress or show))
    positions = _positions(test.protocol.travel_mm)
    rows = pd.DataFrame([_row(run, positions) for run in done])
    compared = ["max_force_N", "slope_N_per_mm", *(f"force_{at:g}mm_N" for at in positions)]
    sizes = rows["cell_size_mm"].tolist()
    quantities = {name: order_and_limit(sizes, rows[name].tolist()) for name in compared}
    return Convergence(test, order, done, positions, rows, quantities)


def check_ladder(order: int, meshes: int) -> None:
    """Check the element order and the number of meshes.

    Raises
    ------
    SpecificationError
        If the order is not available or the number of meshes is out of range.
    """
    if order not in LADDERS:
        raise SpecificationError("order", order, "must be 1 or 2")
    most = len(LADDERS[order])
    if not LEAST_MESHES <= meshes <= most:
        raise SpecificationError("meshes", meshes, f"must be between {LEAST_MESHES} and {most}")


def _simulate(tests: list[BendingTest], runs: SharedRuns, report: Progress) -> Iterator[KeptRun]:
    costs = [0.0 if runs.has(test) else _cells(test) ** COST_EXPONENT for test in tests]
    total, spent = sum(costs) or 1.0, 0.0
    if any(costs):
        report(0.0, "compiling")
        _compile(tests[0], runs)
    for test, cost in zip(tests, costs, strict=True):
        name, duration_s = test.numerics.mesh.name, test.protocol.duration_s

        def show(
            step: Step[Observables],
            name: str = name,
            start: float = spent,
            share: float = cost / duration_s,
        ) -> None:
            state = f"{name}: {step.travel_mm:6.3f} mm {step.observables.force_N:8.2f} N"
            report((start + share * step.time_s) / total, state)

        yield runs.run(test, show)
        spent += cost
        report(spent / total if any(costs) else 1.0, name)


def _compile(test: BendingTest, runs: SharedRuns) -> None:
    """Compile the forms in a first step, so that no mesh's time includes compilation."""
    step = min(test.numerics.stepping.first_step_mm, test.protocol.travel_mm)
    short = replace(test, protocol=replace(test.protocol, travel_mm=step, then=()))
    runs.run(short, lambda step: None)


def _cells(test: BendingTest) -> int:
    """Return roughly how many cells a test's mesh has, without generating it."""
    mesh = test.numerics.mesh
    section = mesh.angular_elements * (mesh.wall_elements + mesh.rind_elements)
    return section * (len(axial_positions(test)) - 1)


def _positions(travel_mm: float) -> tuple[float, ...]:
    inner = (float(f"{share * travel_mm:.3g}") for share in SHARES[:-1])
    return (*inner, travel_mm)


def _row(run: KeptRun, positions_mm: tuple[float, ...]) -> dict[str, object]:
    result, statistics = run.result, run.result.statistics
    travel, force = result.loading["displacement_mm"], result.loading["force_N"]
    # if a run ended early while the force still rose, its maximum is not known
    known = result.completed or result.has_force_maximum
    forces = {
        f"force_{at:g}mm_N": np.interp(at, travel, force, right=np.nan) for at in positions_mm
    }
    return {
        "mesh": result.test.numerics.mesh.name,
        "unknowns": statistics.dofs,
        "cells": statistics.cells,
        "cell_size_mm": (_volume(result.test) / statistics.cells) ** (1.0 / 3.0),
        "max_force_N": result.max_force_N if known else math.nan,
        "slope_N_per_mm": result.slope_N_per_mm if known else math.nan,
        **forces,
        "displacement_at_max_mm": result.displacement_at_max_mm if known else math.nan,
        "reached_mm": float(travel.iloc[-1]),
        "ending": result.ending.kind,
        "steps": statistics.steps,
        "newton_iterations": statistics.newton_iterations,
        "cut_backs": statistics.cut_backs,
        "wall_s": statistics.wall_s,
        "cpu_s": run.cpu_s,
    }


def _volume(test: BendingTest) -> float:
    """Return the volume of the modelled part of a straight stalk, mm3; only its ratios count."""
    inner, *_, outer = test.stalk.radii_mm
    part = MODELLED[test.numerics.domain]
    return part * math.pi * (outer**2 - inner**2) * test.stalk.length_mm

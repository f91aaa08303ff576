"""Progress bars of the commands.

Notes on a specification wait for the first step or simulation: input that is refused before that
is refused in one sentence.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from mpi4py import MPI
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

from ramiefenics.cli.notes import notes
from ramiefenics.cli.output import output
from ramiefenics.specification import BendingTest

if TYPE_CHECKING:
    from ramiefenics.model.observables import Observables
    from ramiefenics.solve.explicit_result import Point
    from ramiefenics.solve.quasistatic import Step

log = logging.getLogger(__name__)


def _bar(text: str) -> Progress:
    """Return a bar with a text, elapsed and remaining time, on the first rank's terminal only."""
    console = Console(stderr=True)
    return Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        TextColumn(text),
        TimeElapsedColumn(),
        TextColumn("left"),
        TimeRemainingColumn(),
        console=console,
        disable=output.quiet or MPI.COMM_WORLD.rank != 0 or not console.is_terminal,
        speed_estimate_period=120.0,  # s; a step on a fine mesh takes several seconds
    )


@contextmanager
def _doing(name: str, total: float) -> Iterator[Callable[[float, str], None]]:
    """Show progress, the current state, and the remaining time."""
    with _bar("{task.fields[state]}") as progress:
        task = progress.add_task(name, total=total, state="compiling and meshing")

        def tell(done: float, state: str) -> None:
            notes.simulating()
            progress.update(task, completed=done, state=state)

        yield tell
    notes.simulating()  # there may have been no step to tell


@contextmanager
def bending(
    test: BendingTest, name: str = "bending"
) -> Iterator[Callable[[Step[Observables]], None]]:
    """Show travel, force, iterations and remaining time of a run."""
    with _doing(name, test.protocol.duration_s) as tell:
        yield lambda step: tell(
            step.time_s,
            f"{step.travel_mm:6.3f} mm {step.observables.force_N:8.2f} N "
            f"{step.iterations:2d} iterations",
        )


@contextmanager
def moving(test: BendingTest) -> Iterator[Callable[[Point], None]]:
    """Show travel, force, time step and remaining time of a run with inertia."""
    with _doing("explicit", test.numerics.explicit.duration_s) as tell:
        yield lambda point: tell(
            point.time_s,
            f"{point.travel_mm:6.3f} mm {point.observables.force_N:8.2f} N, "
            f"steps of {1e6 * point.time_step_s:.2f} us",
        )


@contextmanager
def counting(
    what: str = "simulations",
) -> Iterator[tuple[Callable[[str, int], None], Callable[[int], None]]]:
    """Show the stage, what is done and expected, and the remaining time."""
    with _bar(f"{{task.completed}}{{task.fields[of]}} {what}") as progress:
        task = progress.add_task("reading", total=None, of="")

        def stage(name: str, expected: int) -> None:
            log.info("%s: about %d %s", name, expected, what)
            total = progress.tasks[task].completed + expected
            progress.update(task, description=name, total=total, of=f" of about {total:g}")

        def count(number: int) -> None:
            notes.simulating()
            progress.update(task, advance=number)

        yield stage, count
    notes.simulating()  # there may have been nothing to simulate


@contextmanager
def refining() -> Iterator[Callable[[float, str], None]]:
    """Show mesh, travel, force and remaining time of a convergence study."""
    with _doing("refining", 1.0) as tell:
        yield tell

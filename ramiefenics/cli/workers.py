"""Options of commands with many simulations: where these run, and how many at a time."""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterator
from concurrent.futures import Executor
from contextlib import contextmanager
from typing import Annotated, Any

import typer
from mpi4py import MPI

from ramiefenics.cli.common import resumable
from ramiefenics.cli.output import with_parameters
from ramiefenics.specification import SpecificationError

Jobs = Annotated[
    int | None,
    typer.Option(min=1, help="Number of simulations at a time; by default that of the cores."),
]
Scheduler = Annotated[
    str | None,
    typer.Option(
        metavar="ADDRESS", help="Address of a Dask scheduler whose workers run the simulations."
    ),
]
Pool = Annotated[
    str | None,
    typer.Option(
        metavar="mpi", help="mpi: the other ranks of mpirun run the simulations, one on each."
    ),
]
OPTIONS = {"jobs": (None, Jobs), "scheduler": (None, Scheduler), "pool": (None, Pool)}


def with_workers(command: Callable[..., None]) -> Callable[..., None]:
    """Add the options that choose an executor to a command that takes one as `workers`.

    The command runs on the first rank. With ``--pool mpi`` the other ranks work for it; otherwise
    they wait for its end.
    """

    @functools.wraps(command)
    def lent(
        *args: Any, jobs: int | None, scheduler: str | None, pool: str | None, **kwargs: Any
    ) -> None:
        with _workers(jobs, scheduler, pool) as executor:
            if executor is not None:
                with resumable():
                    command(*args, workers=executor, **kwargs)

    return with_parameters(lent, command, OPTIONS, without="workers")


@contextmanager
def _workers(
    jobs: int | None, scheduler: str | None, pool: str | None
) -> Iterator[Executor | None]:
    """Provide the executor that the options choose; None on all ranks but the first."""
    given = {"jobs": jobs, "scheduler": scheduler, "pool": pool}
    chosen = {name: value for name, value in given.items() if value is not None}
    if len(chosen) > 1:
        both = " and ".join(f"--{name}" for name in chosen)
        raise SpecificationError(both, ", ".join(map(str, chosen.values())), "exclude each other")
    if pool not in (None, "mpi"):
        raise SpecificationError("pool", pool, "must be mpi")
    from ramiefenics.runs import dask_workers, mpi_ranks, workers  # takes a second to import

    if pool is not None:
        with mpi_ranks() as executor:
            yield executor
    elif MPI.COMM_WORLD.rank != 0:
        yield None
    elif scheduler is not None:
        with dask_workers(scheduler) as executor:
            yield executor
    else:
        with workers(None, jobs) as executor:
            yield executor

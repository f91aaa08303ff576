"""Executors: local processes, workers of a Dask scheduler, or the ranks of `mpirun`."""

from __future__ import annotations

import os
import warnings
from collections.abc import Iterator
from concurrent.futures import Executor
from contextlib import contextmanager

from loky import ProcessPoolExecutor

from ramiefenics.diagnostics import LOG, show_log
from ramiefenics.specification import SpecificationError

PATIENCE_S = 20.0
"""Time that a scheduler has to answer."""


@contextmanager
def workers(executor: Executor | None = None, number: int | None = None) -> Iterator[Executor]:
    """Provide the given executor or else local processes, by default as many as there are cores.

    The local processes start when there is work, and end with the block, immediately if it fails.
    They write log messages to standard error from the level that is set on `LOG` in this process.
    """
    if executor is not None:
        yield executor
        return
    # a worker keeps the memory that larger meshes took, and loky restarts it: no cause to warn
    warnings.filterwarnings("ignore", "A worker was restarted", UserWarning)
    pool = ProcessPoolExecutor(
        max_workers=number or len(os.sched_getaffinity(0)),
        initializer=show_log,
        initargs=(LOG.level,),
    )
    try:
        yield pool
    except BaseException:
        pool.shutdown(wait=True, kill_workers=True)
        raise
    pool.shutdown()


@contextmanager
def dask_workers(address: str) -> Iterator[Executor]:
    """Provide an executor that uses the workers of a Dask scheduler.

    Parameters
    ----------
    address
        Address of the scheduler, for instance ``tcp://node1:8786``.

    Raises
    ------
    SpecificationError
        If there is no scheduler at that address, or the package `distributed` is not installed.
    """
    try:
        from distributed import Client
    except ImportError as error:
        allowed = "needs the package distributed: pip install distributed"
        raise SpecificationError("scheduler", address, allowed) from error
    try:
        client = Client(address, timeout=PATIENCE_S)
    except (OSError, ValueError) as error:
        allowed = "must be the address of a running Dask scheduler, such as tcp://node1:8786"
        raise SpecificationError("scheduler", address, allowed) from error
    with client, client.get_executor() as executor:
        yield executor


@contextmanager
def mpi_ranks() -> Iterator[Executor | None]:
    """Provide an executor that uses the ranks of `mpirun` except the first; collective.

    The other ranks receive None once the block of the first has ended.

    Raises
    ------
    SpecificationError
        If there is only one rank.
    """
    from mpi4py import MPI
    from mpi4py.futures import MPICommExecutor

    if MPI.COMM_WORLD.size == 1:
        allowed = "needs two ranks or more: mpirun -n 3 ramiefenics ... --pool mpi"
        raise SpecificationError("pool", "mpi", allowed)
    with MPICommExecutor(MPI.COMM_WORLD) as executor:
        yield executor

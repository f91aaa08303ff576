"""Bending runs that are resumed where they were interrupted."""

from __future__ import annotations

import fcntl
import logging
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from mpi4py import MPI

from ramiefenics.model.jit import CACHE
from ramiefenics.runs.simulation import Simulation
from ramiefenics.solve.solutions import Solutions
from ramiefenics.specification import BendingTest

log = logging.getLogger(__name__)

BENDS = CACHE.parent / "bends"
"""Folder in which the solutions of runs are kept."""

ROOM_BYTES = 1_000_000_000
"""Disk space for runs; beyond it the oldest are removed."""


@contextmanager
def solutions_of(test: BendingTest, comm: MPI.Comm | None = None) -> Iterator[Solutions | None]:
    """Open the stored solutions of a run, which may be all, some or none; collective.

    Parameters
    ----------
    test
        Test to simulate.
    comm
        MPI communicator of the run; the world by default.

    Returns
    -------
    Solutions
        Solutions of the run; None if another process has them open or the file system refuses.
    """
    comm = MPI.COMM_WORLD if comm is None else comm
    path = BENDS / f"{Simulation(test, comm.size).keys()[0]}-{comm.rank}"
    own = None
    try:
        BENDS.mkdir(parents=True, exist_ok=True)
        own = path.open("ab")
        fcntl.flock(own, fcntl.LOCK_EX | fcntl.LOCK_NB)
        free = True
    except OSError as error:
        log.warning("this run cannot be resumed: %s", error)
        free = False
    try:
        if not comm.allreduce(free, op=MPI.LAND):
            yield None
            return
        solutions = Solutions(path, comm)
        try:
            yield solutions
        finally:
            solutions.close()
            if comm.rank == 0:
                _make_room(path)
    finally:
        if own is not None:
            own.close()


def _make_room(newest: Path) -> None:
    """Remove the oldest files of other runs until the rest of them fit."""
    run, room = newest.name.rpartition("-")[0], ROOM_BYTES
    others = [path for path in BENDS.iterdir() if path.name.rpartition("-")[0] != run]
    for path in sorted(others, key=lambda path: -path.stat().st_mtime):
        room -= path.stat().st_size
        if room < 0:
            with suppress(OSError):
                path.unlink()

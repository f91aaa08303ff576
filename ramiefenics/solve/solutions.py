"""Stored solutions of a run's steps, from which an interrupted run is resumed.

A run is repeated from its solutions: every step receives the displacement that was found, without
solving for it, and friction, material memory and the choice of steps follow from that as they did
the first time. All that has to be stored besides is the displacement at which the tangent was last
factorised. The result is then that of an uninterrupted run, to the bit.
"""

from __future__ import annotations

import hashlib
import io
import logging
import os
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from ramiefenics.solve.newton import NewtonOutcome

log = logging.getLogger(__name__)

Array = NDArray[np.floating[Any]]

LENGTH, CHECKSUM = 8, 32
"""Numbers of bytes before each solution that hold its length and its checksum."""


@dataclass(frozen=True)
class Solution:
    """Solution of an attempted step.

    Attributes
    ----------
    outcome
        How the solve ended.
    path
        Displacements that friction and material remember, shape (k, n): those on the way of a
        motion, and the last one. It is empty if the attempt failed.
    linear_iterations
        Linear iterations of the run so far.
    factorised
        Whether the next solve can use the tangent's factors.
    factorised_at
        Displacement at which they were made in this attempt, shape (n,); empty if they were not.
    """

    outcome: NewtonOutcome
    path: Array
    linear_iterations: int
    factorised: bool
    factorised_at: Array


class Solutions:
    """Solutions of one run on this rank: those stored before, and those added now.

    Parameters
    ----------
    path
        File of this rank; created if it does not exist. It is read up to the point where it is
        damaged. The files of further tests of the stalk have the same name with a number appended.
    comm
        MPI communicator of the run.

    Attributes
    ----------
    kept
        Number of solutions that all ranks had at the start.

    Raises
    ------
    OSError
        If the file cannot be read or written.
    """

    def __init__(self, path: Path, comm: MPI.Comm) -> None:
        path.touch()
        self._file: BinaryIO | None = path.open("r+b")
        self._path, self._comm = path, comm
        self._further: list[Solutions] = []
        self.kept, self._factors, self._next, self._heading = 0, -1, 0, b""

    def of_further(self) -> Solutions | None:
        """Return the solutions of the stalk's next test, which are closed with these; collective.

        Where the file system refuses, the result is None. A warning is then logged, and that test
        cannot be resumed.
        """
        path, further = self._path.with_name(f"{self._path.name}.{len(self._further) + 2}"), None
        try:
            further = Solutions(path, self._comm)
            self._further.append(further)
        except OSError as error:
            log.warning("this run cannot be resumed: %s", error)
        return further if self._comm.allreduce(further is not None, op=MPI.LAND) else None

    def start(self, numbers: Sequence[NDArray[Any]]) -> None:
        """Look for solutions of these unknowns, and discard those of others; collective.

        Parameters
        ----------
        numbers
            Arrays that define the numbering of this rank's unknowns: their numbers in each cell,
            and the positions of the cells. They differ for another partition or numbering.
        """
        assert self._file is not None
        numbering = hashlib.sha256()
        for array in numbers:
            numbering.update(np.ascontiguousarray(array))
        same = self._file.read(CHECKSUM) == numbering.digest()
        if not self._comm.allreduce(same, op=MPI.LAND):
            self._file.truncate(0)
            self._file.seek(0)
            self._heading = numbering.digest()
        self.kept, self._factors, end = _scan(self._file, self._comm)
        self._file.truncate(end)
        self._file.seek(CHECKSUM if self.kept else end)

    def next(self) -> tuple[Solution, bool] | None:
        """Return the next stored solution, and whether the run continues with its factors.

        The result is None if there are no more.
        """
        if self._next == self.kept or self._file is None:
            return None
        content = _read(self._file)
        assert content is not None  # it has been scanned
        self._next += 1
        return _unpacked(content), self._next - 1 == self._factors

    def add(self, solution: Solution) -> None:
        """Store a solution; if the disk is full, log a warning and store no more."""
        if self._file is None:
            return
        content = _packed(solution)
        try:
            self._file.write(self._heading + len(content).to_bytes(LENGTH, "big"))
            self._file.write(hashlib.sha256(content).digest() + content)
            self._file.flush()
            self._heading = b""
        except OSError as error:
            log.warning("this run cannot be resumed: %s", error.strerror)
            self.close()

    def close(self) -> None:
        """Close the files."""
        for solutions in self._further:
            solutions.close()
        if self._file is not None:
            with suppress(OSError):  # of a full disk, logged before
                self._file.close()
            self._file = None


def _scan(file: BinaryIO, comm: MPI.Comm) -> tuple[int, int, int]:
    """Return the number of solutions, the index of the last factors, and where solutions end.

    All ranks have that many solutions. The index is -1 if there are no factors to continue with.
    """
    ends, made, use = [file.tell()], [], []
    while (content := _read(file)) is not None:
        solution = _unpacked(content)
        ends.append(file.tell())
        made.append(len(solution.factorised_at) > 0)
        use.append(solution.factorised)
    number = int(comm.allreduce(len(ends) - 1, op=MPI.MIN))
    factors = -1
    if number and use[number - 1]:
        factors = max((k for k in range(number) if made[k]), default=-1)
    return number, factors, ends[number]


def _read(file: BinaryIO) -> bytes | None:
    """Return the content of the next solution; None if there is none, or if it is damaged."""
    length = int.from_bytes(file.read(LENGTH), "big")
    checksum = file.read(CHECKSUM)
    if length > os.fstat(file.fileno()).st_size:
        return None
    content = file.read(length)
    return content if hashlib.sha256(content).digest() == checksum else None


def _packed(solution: Solution) -> bytes:
    outcome, buffer = solution.outcome, io.BytesIO()
    numbers = [outcome.iterations, solution.linear_iterations]
    np.savez(
        buffer,
        flags=np.array([outcome.converged, solution.factorised]),
        numbers=np.array(numbers),
        residual_N=np.array(outcome.residual_N),
        reason=np.array(outcome.reason),
        path=solution.path,
        factorised_at=solution.factorised_at,
    )
    return buffer.getvalue()


def _unpacked(content: bytes) -> Solution:
    with np.load(io.BytesIO(content), allow_pickle=False) as arrays:
        converged, factorised = map(bool, arrays["flags"])
        iterations, linear_iterations = map(int, arrays["numbers"])
        residual_N, reason = float(arrays["residual_N"]), str(arrays["reason"])
        outcome = NewtonOutcome(converged, iterations, residual_N, reason)
        path, made_at = arrays["path"], arrays["factorised_at"]
    return Solution(outcome, path, linear_iterations, factorised, made_at)

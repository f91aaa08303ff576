"""Factors in single precision: half the memory, and accurate enough for a preconditioner."""

from __future__ import annotations

import logging
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
from cffi import VerificationError
from mpi4py import MPI
from numpy.typing import NDArray
from petsc4py import PETSc

from ramiefenics.model.equations import Array
from ramiefenics.model.kernels.library import compiled
from ramiefenics.model.matrix import Matrix

log = logging.getLogger(__name__)

Singles = NDArray[np.float32]

FUNCTIONS = """
void *begin(int, int, int, int64_t, int *, int *, float *);
int factorise(void *);
void solve(void *, int, float *);
void end(void *);
"""


def library() -> ModuleType:
    """Return MUMPS in single precision, as a cffi module.

    Raises
    ------
    VerificationError
        If there is no MUMPS in single precision, or no compiler.
    """
    source = Path(__file__).with_name("factors.c").read_text(encoding="utf-8")
    return compiled(source, FUNCTIONS, ("smumps",))


class SingleFactors:
    """Preconditioner for PETSc by MUMPS in single precision, which PETSc itself does not offer.

    Parameters
    ----------
    matrix
        Matrix to factorise. Its symbolic analysis is kept from one factorisation to the next.
    symmetric
        Whether to factorise its symmetric part, which takes two thirds of the time and half the
        memory.

    Raises
    ------
    VerificationError
        If there is no MUMPS in single precision, or no compiler.
    """

    def __init__(self, matrix: Matrix, symmetric: bool = False) -> None:
        module = library()
        self._lib, self._ffi = module.lib, module.ffi
        self._matrix, self._symmetric = matrix, symmetric
        self._comm = matrix.petsc.getComm().tompi4py()
        self._mumps: Any = None
        self._failed = False

    def setUp(self, _: PETSc.PC) -> None:
        """Factorise; called by PETSc."""
        starts, columns, values = self._matrix.own_rows
        if self._mumps is None:
            self._begin(starts, columns)
        with np.errstate(over="ignore"):  # if Newton's method diverges; there are no factors then
            self._entries[:] = self._shares * values
        error = self._lib.factorise(self._mumps)
        self._failed = error < 0
        if self._failed:
            log.info("MUMPS could not factorise the tangent: %d", error)

    def _begin(self, starts: NDArray[np.int32], columns: NDArray[np.int32]) -> None:
        """Analyse the sparsity pattern."""
        lengths = np.diff(starts)
        first, behind = self._matrix.petsc.getOwnershipRange()
        self._rows = np.repeat(np.arange(first + 1, behind + 1, dtype=np.int32), lengths)
        self._columns = (columns + 1).astype(np.int32)
        self._entries = np.empty(len(columns), dtype=np.float32)
        mirrored = self._symmetric & (self._rows != self._columns)
        self._shares = np.where(mirrored, 0.5, 1.0)
        self._counts = self._comm.allgather(len(lengths))
        self._mumps = self._lib.begin(
            self._comm.py2f(),
            self._symmetric,
            sum(self._counts),
            len(self._entries),
            *(self._pointer("int", array) for array in (self._rows, self._columns)),
            self._pointer("float", self._entries),
        )

    def destroy(self, _: PETSc.PC | None) -> None:
        """Free the memory; called by PETSc, on all ranks at the same time."""
        if self._mumps is not None:
            self._lib.end(self._mumps)
            self._mumps = None

    def apply(self, _: PETSc.PC, b: PETSc.Vec, x: PETSc.Vec) -> None:
        """Solve with the factors; called by PETSc."""
        x.array = self.solve(b.array_r[None])[0]

    def solve(self, right: Array) -> Array:
        """Return the solutions for several right-hand sides, cheaper together than one by one.

        Parameters
        ----------
        right
            This rank's part of the right-hand sides, shape (k, n).
        """
        own = np.abs(right).max(axis=1, initial=0.0, keepdims=True)
        scale = np.where(np.isnan(own), np.inf, own)
        self._comm.Allreduce(MPI.IN_PLACE, scale, op=MPI.MAX)  # to scale into single precision
        if self._failed or not np.isfinite(scale).all():
            return np.full_like(right, np.nan)
        scale[scale == 0.0] = 1.0
        solution = (right / scale).astype(np.float32)
        whole = self._gathered(solution)
        self._lib.solve(self._mumps, len(solution), self._pointer("float", whole))
        self._scatter(whole, solution)
        return np.asarray(scale * solution, dtype=float)

    def _gathered(self, own: Singles) -> Singles:
        """Return the right-hand sides on the first rank."""
        if self._comm.size == 1:
            return own
        whole = np.empty((len(own), sum(self._counts)), dtype=np.float32)
        for part, side in zip(own, whole, strict=True):
            self._comm.Gatherv(part, [side, self._counts])
        return whole

    def _scatter(self, whole: Singles, own: Singles) -> None:
        """Distribute the solutions from the first rank."""
        if self._comm.size > 1:
            for side, part in zip(whole, own, strict=True):
                self._comm.Scatterv([side, self._counts], part)

    def _pointer(self, kind: str, array: np.ndarray) -> Any:
        return self._ffi.cast(f"{kind} *", array.ctypes.data)


def single_factors(matrix: Matrix, symmetric: bool = False) -> SingleFactors | None:
    """Return the preconditioner, or None if MUMPS in single precision is not available."""
    try:
        return SingleFactors(matrix, symmetric)
    except (VerificationError, ImportError) as error:
        log.info("factors in double precision, as single-precision MUMPS is missing: %s", error)
        return None

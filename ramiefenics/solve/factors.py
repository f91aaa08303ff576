"""Factors in single precision: in half the memory, and enough for a preconditioner."""

from __future__ import annotations

import logging
import weakref
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
from cffi import VerificationError
from mpi4py import MPI
from petsc4py import PETSc

from ramiefenics.model.equations import Array
from ramiefenics.model.kernels.library import compiled
from ramiefenics.model.matrix import Matrix

log = logging.getLogger(__name__)

FUNCTIONS = """
void *begin(int, int, int, int64_t, int *, int *, float *);
int factorise(void *);
void solve(void *, int, float *);
void end(void *);
"""


def library() -> ModuleType:
    """Return MUMPS in single precision, as a module of cffi.

    Raises
    ------
    VerificationError
        If there is none, or no compiler.
    """
    source = Path(__file__).with_name("factors.c").read_text(encoding="utf-8")
    return compiled(source, FUNCTIONS, ("smumps",))


class SingleFactors:
    """PETSc's preconditioner by MUMPS in single precision, which PETSc does not offer.

    Parameters
    ----------
    matrix
        What to factorise, on one rank. Its analysis is kept from one factorisation to the next.
    symmetric
        Whether to factorise its symmetric part, in two thirds of the time and half the memory.

    Raises
    ------
    VerificationError
        If there is no MUMPS in single precision, or no compiler.
    """

    def __init__(self, matrix: Matrix, symmetric: bool = False) -> None:
        module = library()
        self._lib, self._ffi = module.lib, module.ffi
        self._values, self._symmetric = matrix.values, symmetric
        lengths = np.diff(matrix.starts)
        self._rows = np.repeat(np.arange(1, len(lengths) + 1, dtype=np.int32), lengths)
        self._columns = (matrix.columns + 1).astype(np.int32)
        self._entries = np.empty(len(self._values), dtype=np.float32)
        self._shares = np.where(self._rows == self._columns, 1.0, 0.5) if symmetric else 1.0
        self._size = len(lengths)
        self._mumps: Any = None
        self._failed = False

    def setUp(self, _: PETSc.PC) -> None:
        """Factorise; PETSc calls it."""
        with np.errstate(over="ignore"):  # where Newton's method runs away; no factors then
            self._entries[:] = self._shares * self._values
        if self._mumps is None:
            self._mumps = self._lib.begin(
                MPI.COMM_SELF.py2f(),
                self._symmetric,
                self._size,
                len(self._entries),
                *(self._pointer("int", array) for array in (self._rows, self._columns)),
                self._pointer("float", self._entries),
            )
            weakref.finalize(self, self._lib.end, self._mumps)
        error = self._lib.factorise(self._mumps)
        self._failed = error < 0
        if self._failed:
            log.info("MUMPS could not factorise the tangent: %d", error)

    def apply(self, _: PETSc.PC, b: PETSc.Vec, x: PETSc.Vec) -> None:
        """Solve with the factors; PETSc calls it."""
        x.array = self.solve(b.array_r[None])[0]

    def solve(self, right: Array) -> Array:
        """Return the solutions for several right-hand sides, shape (k, n): cheaper at once."""
        scale = np.abs(right).max(axis=1, keepdims=True)  # into the range of single precision
        if self._failed or not np.isfinite(scale).all():
            return np.full_like(right, np.nan)
        scale[scale == 0.0] = 1.0
        solution = (right / scale).astype(np.float32)
        self._lib.solve(self._mumps, len(solution), self._pointer("float", solution))
        return np.asarray(scale * solution, dtype=float)

    def _pointer(self, kind: str, array: np.ndarray) -> Any:
        return self._ffi.cast(f"{kind} *", array.ctypes.data)


def single_factors(matrix: Matrix, symmetric: bool = False) -> SingleFactors | None:
    """Return the preconditioner; None on several ranks, or without MUMPS in single precision."""
    if not matrix.in_rows:
        return None
    try:
        return SingleFactors(matrix, symmetric)
    except (VerificationError, ImportError) as error:
        log.info("factors in double precision, as there is no MUMPS in single: %s", error)
        return None

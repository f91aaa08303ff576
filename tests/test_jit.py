"""The cache of compiled forms."""

from __future__ import annotations

import time
from pathlib import Path

import pytest
import ufl
from dolfinx import fem
from dolfinx import mesh as dmesh
from mpi4py import MPI

from ramiefenics.model import jit


def test_killed_compilation_blocks_nobody(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """FFCx alone waits for ten seconds for a C file's product, then raises TimeoutError."""
    monkeypatch.setattr(jit, "CACHE", tmp_path)
    monkeypatch.setitem(jit.JIT_OPTIONS, "cache_dir", str(tmp_path))
    mesh = dmesh.create_interval(MPI.COMM_SELF, 3, (0.0, 2.0))
    length = fem.Constant(mesh, 1.0) * ufl.dx
    jit.compile_form(length)
    (finished,) = tmp_path.glob("*.c.cached")
    finished.unlink()  # as if killed before
    start = time.monotonic()
    assert fem.assemble_scalar(jit.compile_form(length)) == pytest.approx(2.0)
    assert time.monotonic() - start < 8.0

"""What a number depends on besides its specification: source, libraries, processor."""

from __future__ import annotations

import functools
import hashlib
import platform
from pathlib import Path

import basix
import dolfinx
import ffcx
import gmsh
import numpy as np
import pandas as pd
import ufl
from mpi4py import MPI
from petsc4py import PETSc

from ramiefenics.model.jit import JIT_OPTIONS

PACKAGE = Path(__file__).resolve().parents[1]

SOLVER = ("specification", "model", "solve")
"""Subpackages whose source every simulation depends on."""

SHARED = (
    "libblas",
    "libopenblas",
    "libblis",
    "libmkl_core",
    "libdmumps",
    "libmetis",
    "libptscotch",
)
"""Libraries behind PETSc and dolfinx whose versions are not available from Python."""


@functools.cache
def source(*modules: str) -> str:
    """Return a checksum of the solver's source and that of further modules.

    Parameters
    ----------
    modules
        Files of the further modules, ``__file__``.
    """
    digest = hashlib.sha256()
    of_solver = [
        path
        for part in SOLVER
        for path in sorted((PACKAGE / part).rglob("*"))
        if path.suffix in (".py", ".c")
    ]
    for path in [*of_solver, *map(Path, sorted(modules))]:
        digest.update(path.read_bytes())
    return digest.hexdigest()


@functools.cache
def libraries() -> dict[str, object]:
    """Return the versions of all numerical libraries, PETSc's options, and compiler arguments.

    The compiler arguments contain a key of the processor. The number of threads is left out, as it
    only changes the order of sums within a preconditioner.
    """
    return {
        "python": platform.python_version(),
        "dolfinx": dolfinx.__version__,
        "basix": basix.__version__,
        "ffcx": ffcx.__version__,
        "ufl": ufl.__version__,
        "PETSc": list(PETSc.Sys.getVersion()),
        "PETSc options": PETSc.Options().getAll(),
        "MPI": MPI.Get_library_version(),
        "gmsh": gmsh.__version__,
        "numpy": np.__version__,
        "pandas": pd.__version__,
        "shared": _shared(),
        "compiler arguments": JIT_OPTIONS["cffi_extra_compile_args"],
    }


def _shared() -> list[str]:
    """Return name and size of the libraries in `SHARED` that this process has loaded.

    In most installations their file names contain the version. Libraries that a Python package
    brings for itself (``scipy.libs``) are left out, as that package's version determines them.
    """
    try:
        lines = Path("/proc/self/maps").read_text(encoding="utf-8").splitlines()
    except OSError:
        return []
    paths = {Path(line.split(maxsplit=5)[5]) for line in lines if "/lib" in line}
    own = [p for p in paths if p.name.startswith(SHARED) and not p.parent.name.endswith(".libs")]
    return sorted(f"{path.name} {path.stat().st_size}" for path in own)

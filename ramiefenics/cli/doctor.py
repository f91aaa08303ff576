"""`ramiefenics doctor`: a report on the installation, and on what should be fixed."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import typer
from mpi4py import MPI

GIGABYTE = 2**30

LEAST_DISK = 2 * GIGABYTE
"""Disk space, bytes, for the kept runs, compiled forms and results of a study, with a margin."""

LEAST_MEMORY = 4 * GIGABYTE
"""Memory, bytes, of a few processes on the recipes for use, which take half a gigabyte each."""

SOLVERS = ("mumps", "superlu_dist", "hypre", "ml", "metis", "parmetis", "ptscotch")
"""Packages of PETSc that matter for the run time."""

RENDER = "import pyvista as pv; p = pv.Plotter(off_screen=True); p.add_mesh(pv.Sphere()); p.show()"


@dataclass(frozen=True)
class Finding:
    """One line of the report on this machine.

    Attributes
    ----------
    what, found
        The item, and its state on this machine.
    advice
        What should be fixed; empty if nothing should.
    """

    what: str
    found: str
    advice: str = ""


def doctor_command() -> None:
    """Report versions, processors, solvers, caches and disk space, and what should be fixed."""
    wrong = 0
    for finding in findings():
        typer.echo(f"{finding.what:<24}{finding.found}")
        if finding.advice:
            typer.echo(f"{'':<24}fix: {finding.advice}")
            wrong += 1
    typer.echo(f"{wrong} to fix" if wrong else "nothing to fix")
    if wrong:
        raise typer.Exit(1)


def findings() -> Iterator[Finding]:
    """Yield the findings one at a time, as they are made."""
    from ramiefenics.results.manifest import versions

    for name, version in versions().items():
        yield Finding(name, version)
    yield Finding("MPI", MPI.Get_library_version().splitlines()[0].strip("\0 "))
    yield from _machine()
    yield _compiler()
    yield _blas()
    yield _solvers()
    yield _single_precision()
    yield from _caches()
    yield _pictures()


def _machine() -> Iterator[Finding]:
    cores = len(os.sched_getaffinity(0))
    yield Finding("cores", str(cores))
    memory = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    advice = "" if memory > LEAST_MEMORY else "run one simulation at a time: --jobs 1"
    yield Finding("memory", f"{memory / GIGABYTE:.1f} GiB", advice)
    threads = os.environ.get("OMP_NUM_THREADS")
    many = cores > 1 and threads != "1"
    advice = "export OMP_NUM_THREADS=1, as simulations side by side share the cores" * many
    yield Finding("OMP_NUM_THREADS", threads or "not set", advice)


def _compiler() -> Finding:
    found = shutil.which(os.environ.get("CC", "cc")) or shutil.which("gcc")
    advice = "" if found else "install a C compiler, such as gcc: forms and laws are compiled"
    return Finding("C compiler", found or "none", advice)


def _blas() -> Finding:
    """Find the libraries for linear algebra that this process has loaded with NumPy."""
    maps = Path("/proc/self/maps")
    loaded = maps.read_text(encoding="utf-8") if maps.exists() else ""  # it does on Linux only
    names = set(
        re.findall(r"/(lib(?!sca)[^/\n]*(?:blas|lapack|mkl)[^/\n]*)$", loaded, re.MULTILINE)
    )
    return Finding("BLAS", ", ".join(sorted(names)) or "within NumPy")


def _solvers() -> Finding:
    """Find which of the packages that solve, precondition or order PETSc was built with."""
    from petsc4py import PETSc

    found = [name for name in SOLVERS if PETSc.Sys.hasExternalPackage(name)]
    advice = "" if "mumps" in found else "install a PETSc with MUMPS, the direct solver"
    return Finding("PETSc has", ", ".join([*found, "gamg"]), advice)


def _single_precision() -> Finding:
    from cffi import VerificationError

    from ramiefenics.solve.factors import library

    try:
        library()
    except VerificationError:
        advice = "install MUMPS with its headers (Debian: libmumps-dev), which halves the run time"
        return Finding("single-precision MUMPS", "not found, double is used", advice)
    return Finding("single-precision MUMPS", "found")


def _caches() -> Iterator[Finding]:
    from ramiefenics.model.jit import CACHE
    from ramiefenics.runs.resumed import BENDS
    from ramiefenics.runs.store import RUNS

    for name, folder in {"compiled forms": CACHE, "kept runs": RUNS, "kept bends": BENDS}.items():
        size = sum(path.stat().st_size for path in folder.rglob("*") if path.is_file())
        there = next(path for path in (folder, *folder.parents) if path.exists())
        writable = os.access(there, os.W_OK | os.X_OK)
        advice = "" if writable else "set XDG_CACHE_HOME to a writable folder"
        yield Finding(name, f"{folder}, {size / 2**20:.0f} MiB", advice)
    for name, folder in {"disk of the caches": there, "disk of this folder": Path.cwd()}.items():
        free = shutil.disk_usage(folder).free
        advice = "" if free > LEAST_DISK else "free disk space, or set XDG_CACHE_HOME"
        yield Finding(name, f"{free / GIGABYTE:.1f} GiB free", advice)


def _pictures() -> Finding:
    """Try to render a picture, in a process of its own because it may crash without a display."""
    try:
        done = subprocess.run([sys.executable, "-c", RENDER], capture_output=True, timeout=120)
        works = done.returncode == 0
    except subprocess.TimeoutExpired:
        works = False
    advice = "" if works else "install Mesa's libraries for off-screen rendering, or use xvfb-run"
    return Finding("pictures in 3D", "drawn" if works else "not drawn", advice)

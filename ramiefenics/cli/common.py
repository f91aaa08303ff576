"""What several commands need: folders that can be written, work that can be resumed."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import typer
from mpi4py import MPI

from ramiefenics.specification import SpecificationError


def check_writable(folder: Path) -> Path:
    """Find out before hours are spent on what goes into it; make nothing yet."""
    existing = next(path for path in (folder, *folder.absolute().parents) if path.exists())
    if not existing.is_dir() or not os.access(existing, os.W_OK | os.X_OK):
        allowed = f"must be a folder that can be written, but {existing} cannot"
        raise SpecificationError("out", str(folder), allowed)
    return folder


@contextmanager
def resumable() -> Iterator[None]:
    """Tell who interrupts what keeps its simulations that they are kept."""
    try:
        yield
    except KeyboardInterrupt:
        if MPI.COMM_WORLD.rank == 0:
            kept = "what is simulated is kept, so run it again"
            typer.echo(f"ramiefenics: interrupted; {kept}", err=True)
        raise typer.Exit(130) from None

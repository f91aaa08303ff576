"""What several commands need: the test they are about, folders to write to, interruptions."""

from __future__ import annotations

import os
from collections.abc import Iterator
from concurrent.futures import BrokenExecutor
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated

import typer
from mpi4py import MPI

from ramiefenics.specification import (
    BendingTest,
    SpecificationError,
    override,
    published_test,
    read_test,
)
from ramiefenics.specification.bending import LAWS
from ramiefenics.specification.published import PUBLISHED

Spec = Annotated[
    str,
    typer.Argument(help=f"A TOML file, or a published test: {', '.join(PUBLISHED)}, height-69cm."),
]
LawName = Annotated[str | None, typer.Option("--law", help=f"Hyperelastic law: {', '.join(LAWS)}.")]
MeshName = Annotated[str | None, typer.Option("--mesh", help="Mesh recipe, see `meshes/`.")]
Assignments = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="KEY=VALUE", help="Change one value; may be repeated."),
]


def load_test(
    spec: str, mesh: str | None, law: str | None, assignments: list[str] | None
) -> BendingTest:
    """Return the test that the command line names.

    Raises
    ------
    SpecificationError
        If a name, a file or a value is not usable.
    """
    named = "/" not in spec and not spec.endswith(".toml")
    test = published_test(spec) if named else read_test(spec)
    changes = [f"numerics.mesh={mesh}"] if mesh is not None else []
    changes += [f"law={law}"] if law is not None else []
    return override(test, changes + (assignments or []))


def check_writable(folder: Path) -> Path:
    """Find out before hours are spent on what goes into it; make nothing yet."""
    existing = next(path for path in (folder, *folder.absolute().parents) if path.exists())
    if not existing.is_dir() or not os.access(existing, os.W_OK | os.X_OK):
        allowed = f"must be a folder that can be written, but {existing} cannot"
        raise SpecificationError("out", str(folder), allowed)
    return folder


@contextmanager
def resumable() -> Iterator[None]:
    """Tell whose work is interrupted that its simulations are kept."""
    try:
        yield
    except KeyboardInterrupt:
        why, status = "interrupted", 130
    except BrokenExecutor:
        why, status = "a worker died, of lack of memory perhaps", 1
    else:
        return
    if MPI.COMM_WORLD.rank == 0:
        typer.echo(f"ramiefenics: {why}; what is simulated is kept, so run it again", err=True)
    raise typer.Exit(status)

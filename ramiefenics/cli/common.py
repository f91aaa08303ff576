"""Shared parts of the commands: loading a test, claiming a folder, handling interruptions."""

from __future__ import annotations

import functools
import os
from collections.abc import Callable, Iterator
from concurrent.futures import BrokenExecutor
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, ParamSpec

import typer
from mpi4py import MPI

from ramiefenics.cli.output import output
from ramiefenics.model.laws import LAWS, check_law
from ramiefenics.published.stalks import PUBLISHED
from ramiefenics.results.claim import claimed
from ramiefenics.specification import (
    BendingTest,
    SpecificationError,
    override,
    recipe_names,
)
from ramiefenics.specification.sources import as_test

if TYPE_CHECKING:
    from ramiefenics.results.result import Result
    from ramiefenics.solve.quasistatic import Ending

P = ParamSpec("P")

Spec = Annotated[
    str,
    typer.Argument(
        help=f"A TOML file, or a published test: {', '.join(PUBLISHED)}, height-69cm.",
        autocompletion=lambda: list(PUBLISHED),
    ),
]
LawName = Annotated[
    str | None,
    typer.Option(
        "--law",
        help=f"Material law: {', '.join(LAWS)}, or a Python file with one.",
        autocompletion=lambda: list(LAWS),
    ),
]
MeshName = Annotated[
    str | None,
    typer.Option(
        "--mesh",
        help=f"Mesh recipe: {', '.join(recipe_names())}.",
        autocompletion=recipe_names,
    ),
]
Assignments = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="KEY=VALUE",
        help="Change one value, by its whole key or the last part of it; may be repeated.",
    ),
]


def load_test(
    spec: str, mesh: str | None, law: str | None, assignments: list[str] | None
) -> BendingTest:
    """Return the test that the command line specifies.

    Raises
    ------
    SpecificationError
        If a name, a file or a value cannot be used, or the law cannot take a layer's constants.
    """
    changes = [f"numerics.mesh={mesh}"] if mesh is not None else []
    changes += [f"law={law}"] if law is not None else []
    test = override(as_test(spec), changes + (assignments or []))
    check_law(test)
    return test


def on_first_rank(command: Callable[P, None]) -> Callable[P, None]:
    """Run a command that is not parallel on the first rank only; the others wait for its end."""

    @functools.wraps(command)
    def alone(*args: P.args, **kwargs: P.kwargs) -> None:
        if MPI.COMM_WORLD.rank == 0:
            command(*args, **kwargs)

    return alone


claims = ExitStack()
"""Claims to the folders that a command writes, held until `main` ends."""


def claim(folder: Path, comm: MPI.Comm = MPI.COMM_WORLD) -> Path:
    """Claim a folder for the results before a long computation starts.

    Parameters
    ----------
    folder
        Folder of the results.
    comm
        MPI communicator; all of its ranks must call this function.

    Returns
    -------
    Path
        The folder, which is not created yet.

    Raises
    ------
    SpecificationError
        If the folder cannot be written, or another process is writing it; on all ranks.
    """
    refused = None
    if comm.rank == 0:
        try:
            _check_writable(folder)
            claims.enter_context(claimed(folder))
        except SpecificationError as error:
            refused = error.allowed
        except OSError as error:
            refused = f"must be a writable folder ({error})"
    refused = comm.bcast(refused)
    if refused is not None:
        raise SpecificationError("out", str(folder), refused)
    return folder


def _check_writable(folder: Path) -> None:
    existing = next(path for path in (folder, *folder.absolute().parents) if path.exists())
    if not existing.is_dir() or not os.access(existing, os.W_OK | os.X_OK):
        allowed = f"must be a writable folder, but {existing} is not one"
        raise SpecificationError("out", str(folder), allowed)


@contextmanager
def resumable() -> Iterator[None]:
    """If work is interrupted, say that finished simulations are kept, and exit."""
    try:
        yield
    except KeyboardInterrupt:
        why, status = "interrupted", 130
    except BrokenExecutor as error:
        died = "a worker died, perhaps for lack of memory"
        why, status = str(error) if type(error) is BrokenExecutor else died, 1
    else:
        return
    if MPI.COMM_WORLD.rank == 0:
        typer.echo(
            f"ramiefenics: {why}; finished simulations are kept: run the command again to go on",
            err=True,
        )
    raise typer.Exit(status)


def finish(found: Result, folder: Path, more: Callable[[Path], object] | None = None) -> None:
    """Write the folder of a result and print it, on the first rank; status 1 if incomplete.

    Parameters
    ----------
    found, folder, more
        See `write_folder`.
    """
    if MPI.COMM_WORLD.rank == 0:
        from ramiefenics.results.folder import write_folder

        write_folder(found, folder, more)
        output.tell(found, folder)
    if not found.completed:
        raise typer.Exit(1)


def tell_ending(ending: Ending, kept: bool = False) -> None:
    """Report on standard error why a simulation ended before the whole travel, if it did.

    Parameters
    ----------
    ending
        How the simulation ended.
    kept
        Whether the same command, run again, continues from there.
    """
    if ending.kind != "completed" and MPI.COMM_WORLD.rank == 0:
        more = "; run the command again to go on" if kept and ending.kind == "interrupted" else ""
        typer.echo(f"ramiefenics: not completed: {ending.reason}{more}", err=True)

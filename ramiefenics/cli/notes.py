"""The package's warnings as notes on standard error, each shown once and only where it matters."""

from __future__ import annotations

import warnings

import typer
from mpi4py import MPI

from ramiefenics.cli.output import output
from ramiefenics.specification import SpecificationWarning

PACKAGE = __name__.partition(".")[0]

RESTARTED = "A worker was restarted"
"""Beginning of a warning of loky that is not shown.

The memory of a worker grows to what the largest model needs, and loky then replaces the worker."""


class Notes:
    """Printer of warnings; those about a specification wait until something is simulated.

    Warnings of other packages keep Python's format, as they are no sentences for the user.
    """

    def __init__(self) -> None:
        self._told: set[str] = set()
        self._waiting: list[str] = []
        self._simulating = False

    def show(
        self,
        message: Warning | str,
        category: type[Warning],
        filename: str,
        lineno: int,
        *_: object,
    ) -> None:
        """Print a warning, or keep it waiting; replaces `warnings.showwarning`."""
        if str(message).startswith(RESTARTED):
            return
        if category.__module__.partition(".")[0] != PACKAGE:
            self._print(warnings.formatwarning(message, category, filename, lineno).rstrip())
        elif issubclass(category, SpecificationWarning) and not self._simulating:
            self._waiting.append(f"note: {message}")
        else:
            self._print(f"note: {message}")

    def simulating(self) -> None:
        """Print the waiting warnings, and all further ones immediately."""
        self._simulating = True
        for text in self._waiting:
            self._print(text)
        self._waiting.clear()

    def _print(self, text: str) -> None:
        if MPI.COMM_WORLD.rank == 0 and text not in self._told and not output.quiet:
            typer.echo(text, err=True)
        self._told.add(text)


notes = Notes()
"""Notes of the command that this process runs."""

"""Warnings as notes on standard error, each shown once and only where it matters."""

from __future__ import annotations

import typer
from mpi4py import MPI

from ramiefenics.cli.output import output
from ramiefenics.specification import SpecificationWarning

RESTARTED = "A worker was restarted"
"""Beginning of a warning of loky that is not shown.

The memory of a worker grows to what the largest model needs, and loky then replaces the worker."""


class Notes:
    """Printer of warnings; those about a specification wait until something is simulated."""

    def __init__(self) -> None:
        self._told: set[str] = set()
        self._waiting: list[str] = []
        self._simulating = False

    def show(self, message: Warning | str, category: type[Warning], *_: object) -> None:
        """Print a warning, or keep it waiting; replaces `warnings.showwarning`."""
        if str(message).startswith(RESTARTED):
            return
        if issubclass(category, SpecificationWarning) and not self._simulating:
            self._waiting.append(str(message))
        else:
            self._tell(str(message))

    def simulating(self) -> None:
        """Print the waiting warnings, and all further ones immediately."""
        self._simulating = True
        for message in self._waiting:
            self._tell(message)
        self._waiting.clear()

    def _tell(self, message: str) -> None:
        if MPI.COMM_WORLD.rank == 0 and message not in self._told and not output.quiet:
            typer.echo(f"note: {message}", err=True)
        self._told.add(message)


notes = Notes()
"""Notes of the command that this process runs."""

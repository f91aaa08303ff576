"""Warnings as notes on standard error, once each, and where they matter."""

from __future__ import annotations

import typer
from mpi4py import MPI

from ramiefenics.cli.output import output
from ramiefenics.specification import SpecificationWarning

RESTARTED = "A worker was restarted"
"""Of loky, whose processes grow to what the largest model needs, and are then made afresh."""


class Notes:
    """Tells warnings; those of a specification when something is simulated, and not before."""

    def __init__(self) -> None:
        self._told: set[str] = set()
        self._waiting: list[str] = []
        self._simulating = False

    def show(self, message: Warning | str, category: type[Warning], *_: object) -> None:
        """Take the place of `warnings.showwarning`."""
        if str(message).startswith(RESTARTED):
            return
        if issubclass(category, SpecificationWarning) and not self._simulating:
            self._waiting.append(str(message))
        else:
            self._tell(str(message))

    def simulating(self) -> None:
        """Tell what has waited; from now on everything at once."""
        self._simulating = True
        for message in self._waiting:
            self._tell(message)
        self._waiting.clear()

    def _tell(self, message: str) -> None:
        if MPI.COMM_WORLD.rank == 0 and message not in self._told and not output.quiet:
            typer.echo(f"note: {message}", err=True)
        self._told.add(message)


notes = Notes()
"""Of this process's command."""

"""`ramiefenics reconcile`: repair a printed design of experiments."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from mpi4py import MPI

from ramiefenics.cli.common import claim, finish

TABLE_5 = "table5"


def reconcile_command(
    table: Annotated[
        str, typer.Argument(help="A CSV file (see docs/published_tables.md), or table5.")
    ] = TABLE_5,
    published: Annotated[
        Path | None,
        typer.Option(
            help="TOML file of what was published about it; by default the table's name with .toml."
        ),
    ] = None,
    out: Annotated[
        Path | None, typer.Option(help="Folder of the results; results/NAME-reconciled by default.")
    ] = None,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the draws behind the probability.")] = 0,
) -> None:
    """Repair a misprinted central composite design from what was published about it."""
    folder = claim(out or Path("results") / f"{Path(table).stem}-reconciled", MPI.COMM_SELF)
    from ramiefenics.reconciliation.printed_design import read_printed_design, table5
    from ramiefenics.reconciliation.reconcile import reconcile

    built_in = table == TABLE_5 and published is None
    design, publication = table5() if built_in else read_printed_design(table, published)
    finish(reconcile(design, publication, seed), folder)

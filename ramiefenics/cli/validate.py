"""The command `ramiefenics validate`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ramiefenics.cli import progress
from ramiefenics.cli.common import check_writable, resumable


def validate_command(
    study: Annotated[
        str,
        typer.Argument(help="A TOML file, see docs/validation.md, or published, the study's."),
    ] = "published",
    out: Annotated[
        Path | None, typer.Option(help="Folder of the results; results/NAME-validation if none.")
    ] = None,
) -> None:
    """Calibrate on some stalks, predict others, and compare with simpler predictors."""
    folder = check_writable(out or Path("results") / f"{Path(study).stem}-validation")
    # statistics and solver take seconds to import
    from ramiefenics.validation import read_validation, validate

    asked = read_validation(study)  # before there is a progress bar
    with resumable(), progress.counting() as (stage, count):
        found = validate(asked, on_stage=stage, on_done=count)
    from ramiefenics.results.validation_folder import write_validation

    write_validation(found, folder)
    for told in found.findings():
        typer.echo(told)
    typer.echo(f"results in {folder}")
    if not found.completed:
        raise typer.Exit(1)

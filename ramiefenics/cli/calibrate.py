"""The command `ramiefenics calibrate`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ramiefenics.cli import progress
from ramiefenics.cli.common import check_writable, resumable


def calibrate_command(
    study: Annotated[
        str,
        typer.Argument(help="A TOML file, see docs/calibration.md, or table4, the published one."),
    ] = "table4",
    out: Annotated[
        Path | None, typer.Option(help="Folder of the results; results/NAME-calibration if none.")
    ] = None,
) -> None:
    """Simulate a designed study, fit response surfaces, calibrate, and tell what the data fix."""
    folder = check_writable(out or Path("results") / f"{Path(study).stem}-calibration")
    # statistics and solver take seconds to import
    from ramiefenics.calibration.calibrate import calibrate
    from ramiefenics.calibration.study import read_study

    asked = read_study(study)  # before there is a progress bar
    with resumable(), progress.counting() as (stage, count):
        found = calibrate(asked, on_stage=stage, on_done=count)
    from ramiefenics.results.calibration_folder import write_calibration

    write_calibration(found, folder)
    for told in found.findings():
        typer.echo(told)
    typer.echo(f"results in {folder}")
    if not found.completed:
        raise typer.Exit(1)

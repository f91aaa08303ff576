"""Commands for studies of many runs: `calibrate`, `sweep` and `validate`."""

from __future__ import annotations

import math
from concurrent.futures import Executor
from pathlib import Path
from typing import Annotated

import typer
from mpi4py import MPI

from ramiefenics.cli import progress
from ramiefenics.cli.common import (
    LawName,
    MeshName,
    Spec,
    claim,
    finish,
    load_test,
)
from ramiefenics.cli.effects import EffectFiles, SweptAmplitudes, swept_effects

Direct = Annotated[
    bool,
    typer.Option(
        "--direct",
        help="Simulate all runs; otherwise the curves of a large design are learned from a part.",
    ),
]


def calibrate_command(
    workers: Executor,
    study: Annotated[
        str,
        typer.Argument(
            help="A TOML file (see docs/calibration.md), or table4, the published study."
        ),
    ] = "table4",
    out: Annotated[
        Path | None,
        typer.Option(help="Folder of the results; results/NAME-calibration by default."),
    ] = None,
    direct: Direct = False,
) -> None:
    """Simulate a designed study, fit surfaces, calibrate, and report what the data determine."""
    folder = claim(out or Path("results") / f"{Path(study).stem}-calibration", MPI.COMM_SELF)
    # statistics and solver take seconds to import
    from ramiefenics.calibration.calibrate import calibrate
    from ramiefenics.calibration.study import read_study
    from ramiefenics.runs import Runs

    asked = read_study(study)  # refuse before a progress bar appears
    with progress.counting() as (stage, count):
        found = calibrate(asked, Runs(executor=workers, on_done=count), stage, direct)
    finish(found, folder)


def sweep_command(
    workers: Executor,
    assign: Annotated[
        list[str] | None,
        typer.Option(
            "--set",
            metavar="KEY=VALUES",
            help="Values to try: low:high:number, or value,value; may be repeated, for all "
            "combinations.",
        ),
    ] = None,
    spec: Spec = "table3",
    out: Annotated[
        Path | None, typer.Option(help="Folder of the results; results/NAME-sweep by default.")
    ] = None,
    mesh: MeshName = None,
    law: LawName = None,
    effect: SweptAmplitudes = None,
    effects: EffectFiles = None,
) -> None:
    """Bend a stalk with all combinations of given values and amplitudes of effects."""
    from ramiefenics.runs import Runs
    from ramiefenics.sweep import sweep, values_by_key

    values, added = values_by_key(assign or []), swept_effects(effect, effects)
    test = load_test(spec, mesh, law, None)
    folder = claim(out or Path("results") / f"{Path(spec).stem}-sweep", MPI.COMM_SELF)
    with progress.counting() as (stage, count):
        stage("bending", math.prod(map(len, (*values.values(), *(tried for _, tried in added)))))
        found = sweep(test, values, added, Runs(executor=workers, on_done=count))
    finish(found, folder)


def validate_command(
    workers: Executor,
    study: Annotated[
        str,
        typer.Argument(
            help="A TOML file (see docs/validation.md), or published, for the published stalks."
        ),
    ] = "published",
    out: Annotated[
        Path | None, typer.Option(help="Folder of the results; results/NAME-validation by default.")
    ] = None,
    direct: Direct = False,
) -> None:
    """Calibrate on some stalks, predict others, and compare with simpler predictors."""
    folder = claim(out or Path("results") / f"{Path(study).stem}-validation", MPI.COMM_SELF)
    # statistics and solver take seconds to import
    from ramiefenics.runs import Runs
    from ramiefenics.validation import read_validation, validate

    asked = read_validation(study)  # refuse before a progress bar appears
    with progress.counting() as (stage, count):
        found = validate(asked, Runs(executor=workers, on_done=count), stage, direct)
    finish(found, folder)

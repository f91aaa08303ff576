"""The command line: `ramiefenics bend`, `calibrate`, `discover`, `reduce`, `verify` and others."""

from __future__ import annotations

import logging
import signal
import sys
import warnings
from functools import partial
from pathlib import Path
from typing import Annotated

import typer
from mpi4py import MPI

import ramiefenics
from ramiefenics.cli import progress
from ramiefenics.cli.checks import converge_command, explicit_command, verify_command
from ramiefenics.cli.common import (
    Assignments,
    LawName,
    MeshName,
    Spec,
    claim,
    claims,
    finish,
    load_test,
    on_first_rank,
    tell_ending,
)
from ramiefenics.cli.discovering import discover_command, plan_command
from ramiefenics.cli.doctor import doctor_command
from ramiefenics.cli.effects import Amplitudes, EffectFiles, add_effects, effects_command
from ramiefenics.cli.measured import compare_command, import_command, reduce_command
from ramiefenics.cli.notes import notes
from ramiefenics.cli.output import with_options
from ramiefenics.cli.reconcile import reconcile_command
from ramiefenics.cli.schemas import schema_command
from ramiefenics.cli.studies import calibrate_command, sweep_command, validate_command
from ramiefenics.cli.workers import with_workers
from ramiefenics.specification import SpecificationError
from ramiefenics.specification.files import dump_test

log = logging.getLogger(__name__)

FILM = "animation.gif"
"""Name of the film of a test."""

app = typer.Typer(
    no_args_is_help=True,
    pretty_exceptions_enable=False,
)


@app.command()
@with_options
def bend(
    spec: Spec = "table3",
    out: Annotated[
        Path | None, typer.Option(help="Folder of the results; results/NAME by default.")
    ] = None,
    mesh: MeshName = None,
    law: LawName = None,
    assign: Assignments = None,
    effect: Amplitudes = None,
    effects: EffectFiles = None,
    animate: Annotated[
        bool, typer.Option("--animate", help=f"Also write {FILM}, a film of the test.")
    ] = False,
) -> None:
    """Bend a stalk, and write its curve, summary, fields and pictures."""
    test = add_effects(load_test(spec, mesh, law, assign), effect, effects)
    folder = claim(out or Path("results") / Path(spec).stem)
    # the solver takes a second to import
    from ramiefenics.runs.resumed import solutions_of
    from ramiefenics.solve.simulate import simulate

    with progress.bending(test) as show, solutions_of(test) as solutions:
        result = simulate(test, on_step=show, solutions=solutions)
    tell_ending(result.ending, solutions is not None)
    film = animate and result.snapshots
    finish(result, folder, (lambda made: result.animate(made / FILM)) if film else None)


@app.command()
@partial(with_options, result=False)
def mesh(
    out: Annotated[Path, typer.Argument(help="Gmsh file to write, for instance stalk.msh.")],
    spec: Spec = "table3",
    mesh: MeshName = None,
    assign: Assignments = None,
) -> None:
    """Write the mesh of a stalk, with physical names, as a Gmsh file."""
    test = load_test(spec, mesh, None, assign)
    if out.suffix != ".msh" or not out.parent.is_dir():
        raise SpecificationError("out", str(out), "must end in .msh, in an existing folder")
    from ramiefenics.model.tube import write_tube

    write_tube(test, out)


@app.command()
@partial(with_options, result=False)
def specification(
    spec: Spec = "table3",
    mesh: MeshName = None,
    law: LawName = None,
    assign: Assignments = None,
) -> None:
    """Print a complete specification as TOML, to save and edit."""
    typer.echo(dump_test(load_test(spec, mesh, law, assign)), nl=False)


@app.command()
@partial(with_options, result=False)
def new(
    out: Annotated[Path, typer.Argument(help="File to write, for instance my_test.toml.")],
    spec: Spec = "table3",
    mesh: MeshName = None,
    law: LawName = None,
    assign: Assignments = None,
) -> None:
    """Write a specification to start from, with an explanation of every key."""
    from ramiefenics.specification.explained import explained

    if out.suffix != ".toml" or not out.parent.is_dir() or out.exists():
        allowed = "must end in .toml, in an existing folder, and must not exist yet"
        raise SpecificationError("out", str(out), allowed)
    test = load_test(spec, mesh, law, assign)
    if MPI.COMM_WORLD.rank == 0:
        out.write_text(explained(test), encoding="utf-8")


app.command("calibrate")(with_options(with_workers(calibrate_command)))
app.command("compare")(with_options(with_workers(compare_command)))
app.command("converge")(with_options(converge_command))
app.command("discover")(with_options(with_workers(discover_command)))
app.command("doctor")(with_options(on_first_rank(doctor_command), result=False))
app.command("effects")(with_options(on_first_rank(effects_command), result=False))
app.command("explicit")(with_options(explicit_command))
app.command("import")(with_options(on_first_rank(import_command), result=False))
app.command("plan")(with_options(with_workers(plan_command)))
app.command("reconcile")(with_options(on_first_rank(reconcile_command)))
app.command("reduce")(with_options(on_first_rank(reduce_command)))
app.command("schema")(with_options(on_first_rank(schema_command), result=False))
app.command("sweep")(with_options(with_workers(sweep_command)))
app.command("validate")(with_options(with_workers(validate_command)))
app.command("verify")(with_options(with_workers(verify_command)))


def _tell_version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"ramiefenics {ramiefenics.__version__}")
        raise typer.Exit


@app.callback()
def options(
    version: Annotated[
        bool,
        typer.Option(
            "--version", callback=_tell_version, is_eager=True, help="Print the version and exit."
        ),
    ] = False,
) -> None:
    """Simulate bending tests on plant stalks."""


def main() -> None:
    """Run the command line; bad input ends it with a one-sentence message and status 2."""
    first = MPI.COMM_WORLD.rank == 0
    signal.signal(signal.SIGPIPE, signal.SIG_DFL)  # end without a message if head closes the pipe
    warnings.showwarning = notes.show  # type: ignore[assignment]
    try:
        with claims:
            app()
    except SpecificationError as error:
        if first:
            typer.echo(f"ramiefenics: {error}", err=True)
            log.debug("refused here", exc_info=True)
        sys.exit(2)
    except OSError as error:  # for instance a full disk, or a folder that has been removed
        if first:
            typer.echo(f"ramiefenics: {error}", err=True)
        sys.exit(1)

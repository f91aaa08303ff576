"""The command line: `ramiefenics bend`, `calibrate`, `discover`, `reduce`, `verify` and others."""

from __future__ import annotations

import signal
import sys
import warnings
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from mpi4py import MPI

from ramiefenics.cli import progress
from ramiefenics.cli.checks import converge_command, explicit_command, verify_command
from ramiefenics.cli.common import (
    Assignments,
    LawName,
    MeshName,
    Spec,
    claim,
    claims,
    load_test,
    on_first_rank,
    resumable,
)
from ramiefenics.cli.measured import import_command, reduce_command
from ramiefenics.cli.reconcile import reconcile_command
from ramiefenics.cli.studies import calibrate_command, validate_command
from ramiefenics.specification import SpecificationError, mesh_recipe
from ramiefenics.specification.files import dump_test

if TYPE_CHECKING:
    from ramiefenics.solve.result import BendingResult

app = typer.Typer(
    help="Bend plant stalks on a computer.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)
app.command("calibrate")(on_first_rank(calibrate_command))
app.command("converge")(converge_command)
app.command("explicit")(explicit_command)
app.command("import")(on_first_rank(import_command))
app.command("reconcile")(on_first_rank(reconcile_command))
app.command("reduce")(on_first_rank(reduce_command))
app.command("validate")(on_first_rank(validate_command))
app.command("verify")(on_first_rank(verify_command))


@app.command()
def bend(
    spec: Spec = "table3",
    out: Annotated[
        Path | None, typer.Option(help="Folder of the results; results/NAME by default.")
    ] = None,
    mesh: MeshName = None,
    law: LawName = None,
    assign: Assignments = None,
) -> None:
    """Bend a stalk, and write its curve, summary, fields and pictures."""
    test = load_test(spec, mesh, law, assign)
    folder = claim(out or Path("results") / Path(spec).stem)
    # the solver takes a second to import
    from ramiefenics.solve.simulate import simulate

    with progress.bending(test) as show:
        result = simulate(test, on_step=show)
    if MPI.COMM_WORLD.rank == 0:
        from ramiefenics.results.folder import write_folder

        write_folder(result, folder)
        _report(result, folder)
    if not result.completed:
        raise typer.Exit(1)


@app.command()
def mesh(
    out: Annotated[Path, typer.Argument(help="Gmsh file to write, for instance stalk.msh.")],
    spec: Spec = "table3",
    mesh: MeshName = None,
    assign: Assignments = None,
) -> None:
    """Write the mesh of a stalk, with physical names, as a Gmsh file."""
    test = load_test(spec, mesh, None, assign)
    if out.suffix != ".msh" or not out.parent.is_dir():
        raise SpecificationError("out", str(out), "must end in .msh, in a folder that exists")
    from ramiefenics.model.tube import write_tube

    write_tube(test, out)


@app.command("discover")
@on_first_rank
def discover_command(
    dataset: Annotated[str, typer.Argument(help="Folder of measured data, see docs/discovery.md.")],
    out: Annotated[
        Path | None, typer.Option(help="Folder of the results; results/NAME by default.")
    ] = None,
    mesh: MeshName = None,
    effects: Annotated[
        list[str] | None,
        typer.Option(metavar="FILE.py", help="More suspects, defined in a Python file."),
    ] = None,
    seed: Annotated[int, typer.Option(min=0, help="Of the draws behind probabilities.")] = 0,
) -> None:
    """Find what the simulation of measured curves lacks, and what naming it gains."""
    folder = claim(out or Path("results") / Path(dataset).resolve().name, MPI.COMM_SELF)
    if mesh is not None:
        mesh_recipe(mesh)  # before there is a progress bar
    from ramiefenics.discovery import discover
    from ramiefenics.effects import EFFECTS, load_effects
    from ramiefenics.results.discovery_findings import findings
    from ramiefenics.results.discovery_folder import write_discovery
    from ramiefenics.runs import Runs, workers

    suspects = dict(EFFECTS)
    for path in effects or []:
        suspects |= load_effects(path)
    with resumable(), workers() as pool, progress.counting() as (stage, count):
        runs = Runs(executor=pool, on_done=count)
        found = discover(dataset, suspects, mesh, runs, seed, stage)
    write_discovery(found, folder)
    verdict, *others = findings(found)
    typer.echo(f"{found.verdict}: {verdict}")
    for told in others:
        typer.echo(told)
    typer.echo(f"results in {folder}")


@app.command()
def specification(
    spec: Spec = "table3",
    mesh: MeshName = None,
    law: LawName = None,
    assign: Assignments = None,
) -> None:
    """Print a specification in full as TOML, to keep and to change."""
    typer.echo(dump_test(load_test(spec, mesh, law, assign)), nl=False)


def _report(result: BendingResult, folder: Path) -> None:
    from ramiefenics.solve.result import LOSSES

    statistics = result.statistics
    peak = result.peak
    typer.echo(
        f"{'force maximum' if peak.inside else 'force still rising at the end,'} "
        f"{peak.force_N:.2f} N at {peak.displacement_mm:.2f} mm, within 1 % of it from "
        f"{peak.plateau_mm[0]:.2f} to {peak.plateau_mm[1]:.2f} mm; slope "
        f"{result.slope_N_per_mm:.2f} N/mm"
    )
    mesh = result.mesh_error_N
    typer.echo(
        f"error of the maximum: {peak.step_error_N:.2g} N by the steps, "
        + (
            "unknown by the mesh, which is no recipe's (see ramiefenics converge)"
            if mesh is None
            else f"about {mesh:.2g} N by the mesh, as the recipe made elsewhere"
        )
    )
    typer.echo(
        f"{statistics.dofs} unknowns, {statistics.steps} steps, "
        f"{statistics.newton_iterations} iterations, {statistics.cut_backs} cut-backs, "
        f"{statistics.wall_s:.1f} s; results in {folder}"
    )
    for name, travel in result.losses_mm.items():
        typer.echo(f"note: {LOSSES[name]}, from {travel:.2f} mm of travel on")
    for jump in result.jumps:
        typer.echo(
            f"note: the stalk jumps at {jump.displacement_mm:.2f} mm of travel, and releases "
            f"{jump.energy_released_Nmm:.3g} N mm"
        )
    if not result.completed:
        typer.echo(f"ramiefenics: not completed: {result.ending.reason}", err=True)


def main() -> None:
    """Run the command line; bad input ends with one sentence and status 2."""
    first = MPI.COMM_WORLD.rank == 0
    signal.signal(signal.SIGPIPE, signal.SIG_DFL)  # a reader that has enough, such as head, ends it

    told: set[str] = set()

    def note(message: Warning | str, category: type[Warning], *_: object) -> None:
        if first and str(message) not in told:
            typer.echo(f"note: {message}", err=True)
            told.add(str(message))

    warnings.showwarning = note  # type: ignore[assignment]
    try:
        with claims:
            app()
    except SpecificationError as error:
        if first:
            typer.echo(f"ramiefenics: {error}", err=True)
        sys.exit(2)
    except OSError as error:  # a full disk, a folder that is taken away
        if first:
            typer.echo(f"ramiefenics: {error}", err=True)
        sys.exit(1)

"""The command line: `ramiefenics bend`, `calibrate`, `converge`, `discover` and others."""

from __future__ import annotations

import signal
import sys
import warnings
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from mpi4py import MPI

from ramiefenics.cli import progress
from ramiefenics.cli.calibrate import calibrate_command
from ramiefenics.cli.common import check_writable, resumable
from ramiefenics.specification import (
    BendingTest,
    SpecificationError,
    SpecificationWarning,
    mesh_recipe,
    override,
    published_test,
    read_test,
)
from ramiefenics.specification.bending import LAWS
from ramiefenics.specification.files import dump_test
from ramiefenics.specification.published import PUBLISHED

if TYPE_CHECKING:
    from ramiefenics.solve.result import BendingResult

app = typer.Typer(
    help="Bend plant stalks on a computer.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)
app.command("calibrate")(calibrate_command)

Spec = Annotated[
    str,
    typer.Argument(help=f"A TOML file, or a published test: {', '.join(PUBLISHED)}, height-69cm."),
]
LawName = Annotated[str | None, typer.Option("--law", help=f"Hyperelastic law: {', '.join(LAWS)}.")]
MeshName = Annotated[str | None, typer.Option("--mesh", help="Mesh recipe, see `meshes/`.")]
Assignments = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="KEY=VALUE", help="Change one value; may be repeated."),
]


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
    folder = check_writable(out or Path("results") / Path(spec).stem)
    # the solver takes a second to import
    from ramiefenics.model.laws import check_law
    from ramiefenics.solve.simulate import simulate

    check_law(test)  # before there is a progress bar
    with progress.bending(test) as show:
        result = simulate(test, on_step=show)
    if MPI.COMM_WORLD.rank == 0:
        from ramiefenics.results.folder import write_folder

        write_folder(result, folder)
        _report(result, folder)
    if not result.completed:
        raise typer.Exit(1)


@app.command("converge")
def converge_command(
    spec: Spec = "table3",
    out: Annotated[
        Path | None, typer.Option(help="Folder of the results; results/NAME-convergence if none.")
    ] = None,
    order: Annotated[int, typer.Option(help="Of the elements: 1 or 2.")] = 2,
    meshes: Annotated[int, typer.Option(help="How many of the ladder's, from the coarsest.")] = 5,
    law: LawName = None,
    assign: Assignments = None,
) -> None:
    """Bend a stalk on a ladder of meshes: order of convergence, limit and error."""
    for assignment in assign or []:
        if assignment.strip().startswith("numerics.mesh"):
            raise SpecificationError("--set", assignment, "must leave the mesh to the ladder")
    test = load_test(spec, None, law, assign)
    folder = check_writable(out or Path("results") / f"{Path(spec).stem}-convergence")
    from ramiefenics.convergence import converge
    from ramiefenics.convergence.study import check_ladder
    from ramiefenics.model.laws import check_law

    check_ladder(order, meshes)  # before there is a progress bar
    check_law(test)
    with resumable(), progress.refining() as show:
        study = converge(test, order, meshes, on_progress=show)
    if MPI.COMM_WORLD.rank == 0:
        from ramiefenics.results.convergence_folder import convergence_table, write_convergence

        write_convergence(study, folder)
        typer.echo(convergence_table(study))
        for told in study.notes():
            typer.echo(f"note: {told}")
        typer.echo(f"results in {folder}")
    if not study.completed:
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
    seed: Annotated[int, typer.Option(help="Of the draws behind probabilities.")] = 0,
) -> None:
    """Find what the simulation of measured curves lacks, and what naming it gains."""
    folder = check_writable(out or Path("results") / Path(dataset).resolve().name)
    if mesh is not None:
        mesh_recipe(mesh)  # before there is a progress bar
    from ramiefenics.discovery import discover
    from ramiefenics.discovery.runs import Runs
    from ramiefenics.effects import EFFECTS, load_effects
    from ramiefenics.results.discovery_folder import summarise_discovery, write_discovery
    from ramiefenics.results.discovery_report import sentence

    suspects = dict(EFFECTS)
    for path in effects or []:
        suspects |= load_effects(path)
    with resumable(), progress.counting() as (stage, count):
        found = discover(dataset, suspects, mesh, Runs(on_done=count), seed, stage)
    write_discovery(found, folder)
    typer.echo(f"{found.verdict}: {sentence(found, summarise_discovery(found))}")
    typer.echo(f"results in {folder}")


@app.command()
def verify(
    studies: Annotated[
        list[str] | None, typer.Argument(help="Which; all by default, see docs/verification.md.")
    ] = None,
    out: Annotated[Path, typer.Option(help="Folder of the report.")] = Path("results"),
) -> None:
    """Check the solver against exact solutions, theories and other codes."""
    folder = check_writable(out)
    from rich.progress import track

    from ramiefenics.results.verification_report import write_verification
    from ramiefenics.verification import STUDIES

    for name in studies or []:
        if name not in STUDIES:
            raise SpecificationError("studies", name, f"must be one of {', '.join(STUDIES)}")
    warnings.simplefilter("ignore", SpecificationWarning)
    done = {name: STUDIES[name]() for name in track(studies or list(STUDIES), "verifying")}
    for study in done.values():
        for check in study.checks:
            verdict = "holds" if check.passed else "FAILS"
            typer.echo(f"{verdict}  {study.title}: {check.what} {check.value:.6g}, {check.limits}")
    typer.echo(f"report in {write_verification(done, folder)}")
    if not all(check.passed for study in done.values() for check in study.checks):
        raise typer.Exit(1)


@app.command()
def specification(
    spec: Spec = "table3",
    mesh: MeshName = None,
    law: LawName = None,
    assign: Assignments = None,
) -> None:
    """Print a specification in full as TOML, to keep and to change."""
    typer.echo(dump_test(load_test(spec, mesh, law, assign)), nl=False)


def load_test(
    spec: str, mesh: str | None, law: str | None, assignments: list[str] | None
) -> BendingTest:
    """Return the test that the command line names.

    Raises
    ------
    SpecificationError
        If a name, a file or a value is not usable.
    """
    named = "/" not in spec and not spec.endswith(".toml")
    test = published_test(spec) if named else read_test(spec)
    changes = [f"numerics.mesh={mesh}"] if mesh is not None else []
    changes += [f"law={law}"] if law is not None else []
    return override(test, changes + (assignments or []))


def _report(result: BendingResult, folder: Path) -> None:
    from ramiefenics.solve.result import LOSSES

    statistics = result.statistics
    peak = "force maximum" if result.has_force_maximum else "force still rising at the end,"
    typer.echo(
        f"{peak} {result.max_force_N:.2f} N at {result.displacement_at_max_mm:.2f} mm; "
        f"slope {result.slope_N_per_mm:.2f} N/mm"
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
    signal.signal(signal.SIGPIPE, signal.SIG_DFL)  # PETSc takes a closed pipe for a crash

    def note(message: Warning | str, category: type[Warning], *_: object) -> None:
        if first:
            typer.echo(f"note: {message}", err=True)

    warnings.showwarning = note  # type: ignore[assignment]
    try:
        app()
    except SpecificationError as error:
        if first:
            typer.echo(f"ramiefenics: {error}", err=True)
        sys.exit(2)

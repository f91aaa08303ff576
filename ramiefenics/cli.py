"""The command line: `ramiefenics bend`, `explicit`, `discover`, `mesh`, `specification`."""

from __future__ import annotations

import os
import signal
import sys
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from mpi4py import MPI
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

from ramiefenics.specification import (
    BendingTest,
    SpecificationError,
    mesh_recipe,
    override,
    published_test,
    read_test,
)
from ramiefenics.specification.bending import LAWS
from ramiefenics.specification.files import dump_test
from ramiefenics.specification.published import PUBLISHED

if TYPE_CHECKING:
    from ramiefenics.model.observables import Observables
    from ramiefenics.solve.explicit_result import Point
    from ramiefenics.solve.quasistatic import Step
    from ramiefenics.solve.result import BendingResult

app = typer.Typer(
    help="Bend plant stalks on a computer.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)

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
    folder = _check_writable(out or Path("results") / Path(spec).stem)
    # the solver takes a second to import
    from ramiefenics.model.laws import check_law
    from ramiefenics.solve.simulate import simulate

    check_law(test)  # before there is a progress bar
    with _progress("bending", test.protocol.travel_mm) as show:
        result = simulate(test, on_step=lambda step: show(step.travel_mm, _step_state(step)))
    if MPI.COMM_WORLD.rank == 0:
        from ramiefenics.results.folder import write_folder

        write_folder(result, folder)
        _report(result, folder)
    if not result.completed:
        raise typer.Exit(1)


@app.command()
def explicit(
    spec: Spec = "table3",
    out: Annotated[
        Path | None, typer.Option(help="Folder of the results; results/NAME-explicit by default.")
    ] = None,
    mesh: MeshName = None,
    law: LawName = None,
    assign: Assignments = None,
    implicit: Annotated[
        bool, typer.Option(help="Bend the stalk quasi-statically first, to compare with.")
    ] = True,
) -> None:
    """Bend a stalk with inertia, in explicit time steps, and compare with the quasi-static curve.

    Settings are `numerics.explicit.duration_s`, `mass_factor` and others, see `specification`. Fine
    meshes take long; `--mesh ladder_q1_1` takes a minute or two.
    """
    test = load_test(spec, mesh, law, assign)
    folder = _check_writable(out or Path("results") / f"{Path(spec).stem}-explicit")
    from ramiefenics.model.laws import check_law
    from ramiefenics.solve.explicit import simulate_explicitly
    from ramiefenics.solve.simulate import simulate

    check_law(test)
    static = None
    if implicit:
        with _progress("implicit", test.protocol.travel_mm) as show:
            static = simulate(test, on_step=lambda step: show(step.travel_mm, _step_state(step)))
    if static is not None and static.ending.kind == "interrupted":
        typer.echo("ramiefenics: interrupted before the explicit run; nothing written", err=True)
        raise typer.Exit(1)
    with _progress("explicit", test.numerics.explicit.duration_s) as show:
        result = simulate_explicitly(test, on_point=lambda p: show(p.time_s, _point_state(p)))
    if MPI.COMM_WORLD.rank == 0:
        from ramiefenics.results.explicit_folder import sentences, write_explicit_folder

        write_explicit_folder(result, folder, static)
        typer.echo("\n".join([*sentences(result, static), f"results in {folder}"]))
        if not result.completed:
            typer.echo(f"ramiefenics: not completed: {result.ending.reason}", err=True)
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
    folder = _check_writable(out or Path("results") / Path(dataset).resolve().name)
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
    with _counting() as (stage, count):
        try:
            found = discover(dataset, suspects, mesh, Runs(on_done=count), seed, stage)
        except KeyboardInterrupt:
            kept = "what is simulated is kept, so run it again"
            typer.echo(f"ramiefenics: interrupted; {kept}", err=True)
            raise typer.Exit(130) from None
    write_discovery(found, folder)
    typer.echo(f"{found.verdict}: {sentence(found, summarise_discovery(found))}")
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


def _check_writable(folder: Path) -> Path:
    """Find out before hours are spent on what goes into it; make nothing yet."""
    existing = next(path for path in (folder, *folder.absolute().parents) if path.exists())
    if not existing.is_dir() or not os.access(existing, os.W_OK | os.X_OK):
        allowed = f"must be a folder that can be written, but {existing} cannot"
        raise SpecificationError("out", str(folder), allowed)
    return folder


@contextmanager
def _progress(name: str, total: float) -> Iterator[Callable[[float, str], None]]:
    """Show how much is done, a state and time left, on the first rank only."""
    progress = Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        TextColumn("{task.fields[state]}"),
        TimeElapsedColumn(),
        TextColumn("left"),
        TimeRemainingColumn(),
        disable=MPI.COMM_WORLD.rank != 0,
    )
    with progress:
        task = progress.add_task(name, total=total, state="compiling and meshing")
        yield lambda done, state: progress.update(task, completed=done, state=state)


def _step_state(step: Step[Observables]) -> str:
    force = step.observables.force_N
    return f"{step.travel_mm:6.3f} mm {force:8.2f} N {step.iterations:2d} iterations"


def _point_state(point: Point) -> str:
    force, step = point.observables.force_N, 1e6 * point.time_step_s
    return f"{point.travel_mm:6.3f} mm {force:8.2f} N, steps of {step:.2f} us"


@contextmanager
def _counting() -> Iterator[tuple[Callable[[str, int], None], Callable[[int], None]]]:
    """Show stages, simulations done and expected, and time left."""
    progress = Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        TextColumn("{task.completed} of about {task.total} simulations"),
        TimeElapsedColumn(),
        TextColumn("left"),
        TimeRemainingColumn(),
    )
    with progress:
        task = progress.add_task("reading", total=None)

        def stage(name: str, expected: int) -> None:
            total = progress.tasks[task].completed + expected
            progress.update(task, description=name, total=total)

        yield stage, lambda number: progress.update(task, advance=number)


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

"""Commands that check the solver: `ramiefenics converge`, `explicit`, `verify`."""

from __future__ import annotations

import inspect
from concurrent.futures import Executor
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer
from mpi4py import MPI

from ramiefenics.cli import progress
from ramiefenics.cli.common import (
    Assignments,
    LawName,
    MeshName,
    Spec,
    claim,
    finish,
    load_test,
    resumable,
    tell_ending,
)
from ramiefenics.specification import SpecificationError


def converge_command(
    spec: Spec = "table3",
    out: Annotated[
        Path | None,
        typer.Option(help="Folder of the results; results/NAME-convergence by default."),
    ] = None,
    order: Annotated[int, typer.Option(help="Order of the elements: 1 or 2.")] = 2,
    meshes: Annotated[
        int, typer.Option(help="Number of meshes of the ladder, from the coarsest.")
    ] = 5,
    law: LawName = None,
    assign: Assignments = None,
    jobs: Annotated[
        int | None,
        typer.Option(
            min=1, help="Number of meshes at a time; by default one, on all ranks of mpirun."
        ),
    ] = None,
) -> None:
    """Bend a stalk on a ladder of meshes, and report order of convergence, limit and error."""
    for assignment in assign or []:
        if assignment.strip().startswith("numerics.mesh"):
            raise SpecificationError("--set", assignment, "must leave the mesh to the ladder")
    test = load_test(spec, None, law, assign)
    folder = claim(out or Path("results") / f"{Path(spec).stem}-convergence")
    from ramiefenics.convergence import converge
    from ramiefenics.convergence.study import check_ladder
    from ramiefenics.runs import Runs, workers

    check_ladder(order, meshes)  # refuse before a progress bar appears
    if jobs is None:
        with resumable(), progress.refining() as show:
            study = converge(test, order, meshes, on_progress=show)
    else:
        with resumable(), workers(number=jobs) as pool, progress.counting() as (stage, count):
            stage("refining", meshes)
            study = converge(test, order, meshes, Runs(executor=pool, on_done=count))
    finish(study, folder)


def explicit_command(
    spec: Spec = "table3",
    out: Annotated[
        Path | None, typer.Option(help="Folder of the results; results/NAME-explicit by default.")
    ] = None,
    mesh: MeshName = None,
    law: LawName = None,
    assign: Assignments = None,
    implicit: Annotated[
        bool, typer.Option(help="Bend the stalk quasi-statically first, for comparison.")
    ] = True,
) -> None:
    """Bend a stalk with inertia, in explicit time steps, and compare with the quasi-static curve.

    The settings are `numerics.explicit.duration_s`, `mass_factor` and others, see `specification`.
    Fine meshes take long; `--mesh ladder_q1_1` takes a minute or two.
    """
    test = load_test(spec, mesh, law, assign)
    test.protocol.check_loading_only("explicit runs")
    folder = claim(out or Path("results") / f"{Path(spec).stem}-explicit")
    from ramiefenics.runs import SharedRuns
    from ramiefenics.solve.explicit import simulate_explicitly

    static = None
    if implicit:
        with resumable(), progress.bending(test, "implicit") as show:
            static = SharedRuns().run(test, show).result
    with progress.moving(test) as tell:
        result = simulate_explicitly(test, on_point=tell)
    tell_ending(result.ending)
    finish(replace(result, implicit=static), folder)


def verify_command(
    workers: Executor,
    studies: Annotated[
        list[str] | None,
        typer.Argument(
            help="Studies to run; all by default (see docs/verification.md). The word list prints "
            "their names."
        ),
    ] = None,
    out: Annotated[Path, typer.Option(help="Folder of the report.")] = Path("results"),
) -> None:
    """Check the solver against exact solutions, theories and other codes."""
    from ramiefenics.runs import Runs
    from ramiefenics.verification import STUDIES, StudyTask, Verification

    if studies == ["list"]:
        for name, study in STUDIES.items():
            typer.echo(f"{name:<16}{(inspect.getdoc(study) or '').partition(chr(10))[0]}")
        return
    folder = claim(out, MPI.COMM_SELF)
    studies = studies or list(STUDIES)
    for name in studies:
        if name not in STUDIES:
            raise SpecificationError(
                "studies", name, f"must be one of {', '.join(STUDIES)}, or list"
            )
    with progress.counting("studies") as (stage, count):
        stage("verifying", len(studies))
        done = Runs(executor=workers, on_done=count).map([StudyTask(name) for name in studies])
    found = {name: one.result() for name, one in zip(studies, done, strict=True)}
    finish(Verification(found), folder)

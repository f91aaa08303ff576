"""Commands that search for hidden causes: `discover` and `plan`."""

from __future__ import annotations

from concurrent.futures import Executor
from pathlib import Path
from typing import Annotated, Any

import typer
from mpi4py import MPI

from ramiefenics.cli import progress
from ramiefenics.cli.common import (
    Assignments,
    LawName,
    MeshName,
    claim,
    finish,
    load_test,
)
from ramiefenics.cli.effects import EffectFiles, PlannedNames, SuspectNames, suspects
from ramiefenics.effects import EFFECTS
from ramiefenics.specification import BendingTest, mesh_recipe, override


def discover_command(
    workers: Executor,
    dataset: Annotated[str, typer.Argument(help="Folder of measured data, see docs/discovery.md.")],
    out: Annotated[
        Path | None, typer.Option(help="Folder of the results; results/NAME by default.")
    ] = None,
    mesh: MeshName = None,
    suspect: SuspectNames = None,
    effects: EffectFiles = None,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the draws behind probabilities.")] = 0,
) -> None:
    """Find what a simulation of measured curves lacks, and how much adding it improves it."""
    folder = claim(out or Path("results") / Path(dataset).resolve().name, MPI.COMM_SELF)
    if mesh is not None:
        mesh_recipe(mesh)  # refuse before a progress bar appears
    from ramiefenics.discovery import discover, suspects_of
    from ramiefenics.measured import read_dataset
    from ramiefenics.runs import Runs

    given = suspects(suspect, effects, {})
    measured = read_dataset(dataset)
    tried = given if suspect else {**suspects_of(measured), **given}
    with progress.counting() as (stage, count):
        runs = Runs(executor=workers, on_done=count)
        found = discover(measured, tried, mesh, runs, seed, stage)
    finish(found, folder)


def plan_command(
    workers: Executor,
    spec: Annotated[
        str,
        typer.Argument(
            help="The test to plan: a TOML file, a published test, or a folder of measured data "
            "with stalks of the same kind."
        ),
    ] = "table3",
    out: Annotated[
        Path | None, typer.Option(help="Folder of the results; results/NAME-plan by default.")
    ] = None,
    also: Annotated[
        list[str] | None,
        typer.Option(
            metavar="KEY=VALUE,...",
            help="Settings of a further test that each stalk could be given; may be repeated. By "
            "default a shorter span, a blunter indenter, and unloading.",
        ),
    ] = None,
    suspect: PlannedNames = None,
    effects: EffectFiles = None,
    stalks: Annotated[int | None, typer.Option(help="Number of stalks to be tested.")] = None,
    fit_sd: Annotated[
        float | None,
        typer.Option(help="Uncertainty of the moduli: standard deviation of their logarithms."),
    ] = None,
    noise: Annotated[
        float | None, typer.Option(help="Noise of the curves, relative to their peak.")
    ] = None,
    mesh: MeshName = None,
    law: LawName = None,
    assign: Assignments = None,
) -> None:
    """Predict what planned tests could show, and which second test would show the most."""
    folder = claim(out or Path("results") / f"{Path(spec).resolve().stem}-plan", MPI.COMM_SELF)
    tried = suspects(suspect, effects, EFFECTS)
    from ramiefenics.discovery.planning.plan import SHARES, plan
    from ramiefenics.discovery.planning.power import Design
    from ramiefenics.runs import Runs

    test, known = _planned(spec, mesh, law, assign)
    given = {"stalks": stalks, "fit_sd": fit_sd, "noise": noise}
    design = Design(**(known | {name: v for name, v in given.items() if v is not None}))
    others = None if also is None else [settings.split(",") for settings in also]
    curves = 3 + len(SHARES) if others is None else 1 + len(others)
    with progress.counting() as (stage, count):
        stage("simulating one stalk", (len(tried) + 1) * curves)
        found = plan(test, others, design, tried, Runs(executor=workers, on_done=count))
    finish(found, folder)


def _planned(
    spec: str, mesh: str | None, law: str | None, assign: list[str] | None
) -> tuple[BendingTest, dict[str, Any]]:
    """Return the test, and settings of the design that a folder of measured data provides."""
    if not (Path(spec) / "dataset.toml").is_file():
        return load_test(spec, mesh or "screening", law, assign), {}
    from ramiefenics.discovery.curves.meshes import on_mesh
    from ramiefenics.measured import read_dataset

    dataset = read_dataset(spec)
    recipe = dataset.layout.mesh if mesh is None else mesh_recipe(mesh)
    test = override(on_mesh(dataset.baseline, recipe), assign or [])
    return test, {"stalks": len(dataset.specimens), "fit_sd": dataset.layout.fit_sd}

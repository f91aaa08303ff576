"""Commands on measured data: `compare`, `import` and `reduce`."""

from __future__ import annotations

from concurrent.futures import Executor
from pathlib import Path
from typing import Annotated

import typer
from mpi4py import MPI

from ramiefenics.cli import progress
from ramiefenics.cli.common import MeshName, claim, finish
from ramiefenics.specification import SpecificationError


def import_command(
    raw: Annotated[list[Path], typer.Argument(help="Raw files of the machine, one per specimen.")],
    out: Annotated[Path, typer.Option(help="Folder of the data set to create.")],
    baseline: Annotated[
        str,
        typer.Option(
            metavar="FILE.toml|NAME",
            help="Baseline of the specimens: a specification, or a published test of ramie.",
        ),
    ],
    format: Annotated[
        str | None,
        typer.Option(
            metavar="NAME|FILE.py",
            help="Format of the files: headings, columns (see docs/measured.md), or a Python file "
            "with a reader of your own. By default the first format that can read the first file.",
        ),
    ] = None,
    columns: Annotated[
        str | None,
        typer.Option(
            metavar="NAMES",
            help="Meaning of the columns, in order, for instance time_s,force_N; - for a column to "
            "ignore. By default displacement_mm,force_N. Only for formats that do not state it.",
        ),
    ] = None,
    speed: Annotated[
        float | None,
        typer.Option(
            help="Speed of the crosshead, mm/min; needed if no column has the displacement."
        ),
    ] = None,
    rate: Annotated[
        float | None, typer.Option(help="Rows per second, if no column has the time.")
    ] = None,
) -> None:
    """Make a data-set folder from raw files of a testing machine."""
    from ramiefenics.measured import find_reader, guess_reader, read_raw
    from ramiefenics.measured.dataset_folder import check_new, taken, write_dataset

    names = None if columns is None else tuple(columns.split(","))
    given = {"columns": names, "speed_mm_per_min": speed, "rate_Hz": rate}
    options = {name: value for name, value in given.items() if value is not None}
    if format is None:
        needed = {name: value for name, value in options.items() if name != "speed_mm_per_min"}
        format = guess_reader(raw, options if names else needed).name
        typer.echo(f"read as {format}")
    if "speed_mm_per_min" not in find_reader(format).options:
        options.pop("speed_mm_per_min", None)  # not needed to read; only the data set records it
    check_new(claim(out, MPI.COMM_SELF))
    curves = read_raw(raw, format, **options)
    write_dataset(curves, out, baseline, speed, format)
    notes = [note for curve in curves.values() for note in curve.notes]
    for told in (*notes, *taken(curves, baseline)[1]):
        typer.echo(f"note: {told}")
    typer.echo(f"{len(curves)} curves in {out}; see {out / 'dataset.toml'} for what to add")


def reduce_command(
    dataset: Annotated[str, typer.Argument(help="Folder of measured data, see docs/measured.md.")],
    out: Annotated[
        Path | None, typer.Option(help="Folder of the results; results/NAME-reduced by default.")
    ] = None,
    by: Annotated[
        str | None,
        typer.Option(
            metavar="COLUMN", help="Column of specimens.csv or tests.csv that names the groups."
        ),
    ] = None,
    within: Annotated[
        str | None,
        typer.Option(
            metavar="COLUMN",
            help="Column of what dependent curves share, such as their plant, for the comparison "
            "of groups.",
        ),
    ] = None,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the resampling behind intervals.")] = 0,
) -> None:
    """Reduce measured curves to slopes, peaks, energies and strengths, and compare groups."""
    folder = claim(
        out or Path("results") / f"{Path(dataset).resolve().name}-reduced", MPI.COMM_SELF
    )
    from ramiefenics.reduction import reduce_dataset

    finish(reduce_dataset(dataset, by, seed, within), folder)


def compare_command(
    workers: Executor,
    dataset: Annotated[str, typer.Argument(help="Folder of measured data, see docs/measured.md.")],
    simulated: Annotated[
        list[Path] | None,
        typer.Argument(
            metavar="[RUN]...",
            help="Folders of results of ramiefenics bend; by default every measured test is "
            "simulated, with the baseline's constants.",
        ),
    ] = None,
    out: Annotated[
        Path | None, typer.Option(help="Folder of the results; results/NAME-compared by default.")
    ] = None,
    mesh: MeshName = None,
) -> None:
    """Draw measured curves beside simulated ones, and report how far apart they are."""
    folder = claim(
        out or Path("results") / f"{Path(dataset).resolve().name}-compared", MPI.COMM_SELF
    )
    from ramiefenics.comparison import compare
    from ramiefenics.measured import read_dataset
    from ramiefenics.runs import Runs
    from ramiefenics.solve.reading import read_bend

    asked = read_dataset(dataset)
    given = {path.name: read_bend(path) for path in simulated or []}
    if len(given) < len(simulated or []):
        names = ", ".join(str(path) for path in simulated or [])
        raise SpecificationError("RUN", names, "must be folders with different names")
    if given:
        finish(compare(asked, given), folder)
        return
    with progress.counting() as (stage, count):
        stage("bending", len(asked.records))
        found = compare(asked, None, mesh, Runs(executor=workers, on_done=count))
    finish(found, folder)

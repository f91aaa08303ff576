"""Commands on measured data: `compare`, `import` and `reduce`."""

from __future__ import annotations

from collections.abc import Mapping
from concurrent.futures import Executor
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from mpi4py import MPI

from ramiefenics.cli import progress
from ramiefenics.cli.common import MeshName, claim, finish
from ramiefenics.cli.notes import notes
from ramiefenics.cli.output import output
from ramiefenics.specification import SpecificationError
from ramiefenics.specification.sources import as_test

if TYPE_CHECKING:
    from ramiefenics.measured import RawCurve


def import_command(
    raw: Annotated[list[Path], typer.Argument(help="Raw files of the machine.")],
    out: Annotated[Path, typer.Option(help="Folder of the data set to create.")],
    baseline: Annotated[
        str | None,
        typer.Option(
            metavar="FILE.toml|NAME",
            help="Baseline of the specimens: a specification, or a published test of ramie. "
            "Required.",
        ),
    ] = None,
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
            "ignore. By default as the heading says, or else displacement_mm,force_N. Only for "
            "formats that do not state it.",
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
    from ramiefenics.measured.dataset_folder import check_new, write_dataset
    from ramiefenics.measured.stated import take_stated

    if baseline is None:
        allowed = (
            "must name the specification of the specimens; ramiefenics new mine.toml writes one to "
            "edit, and table3 stands for the published stalks of ramie"
        )
        raise SpecificationError("--baseline", None, allowed)
    names = None if columns is None else tuple(columns.split(","))
    given = {"columns": names, "speed_mm_per_min": speed, "rate_Hz": rate}
    options = {name: value for name, value in given.items() if value is not None}
    if format is None:
        format = guess_reader(raw, options).name
    if "speed_mm_per_min" not in find_reader(format).options:
        options.pop("speed_mm_per_min", None)  # not needed to read; only the data set records it
    check_new(claim(out, MPI.COMM_SELF))
    notes.simulating()  # a baseline's warnings matter as soon as a data set has it
    curves = read_raw(raw, format, **options)
    write_dataset(curves, out, baseline, speed, format)
    if output.quiet:
        return
    told = [f"read as {Path(format).name}", *_origins(curves)]
    told += [note for curve in curves.values() for note in curve.notes]
    for note in (*told, *take_stated(curves, as_test(baseline), baseline).told):
        typer.echo(f"note: {note}", err=True)
    typer.echo(f"{len(curves)} curves in {out}; see {out / 'dataset.toml'} for what to add")


def _origins(curves: Mapping[str, RawCurve]) -> list[str]:
    """Return which column was taken as what, in one sentence for curves that agree in it."""
    told: dict[str, list[str]] = {}
    for name, curve in curves.items():
        sentence = ", ".join(f"{quantity} = {what}" for quantity, what in curve.origin.items())
        told.setdefault(sentence, []).append(name)
    told.pop("", None)
    return [
        sentence if len(told) == 1 else f"{', '.join(names)}: {sentence}"
        for sentence, names in told.items()
    ]


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
            metavar="COLUMN,...",
            help="Column of what dependent curves share, such as their plant, for the comparison "
            "of groups; several if equal values do not always mean the same, as in plot,plant.",
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

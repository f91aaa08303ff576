"""A folder of measured data: `dataset.toml`, `specimens.csv`, one CSV file per curve."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pandas as pd

from ramiefenics.measured.layout import Layout, listed
from ramiefenics.measured.raw import LEAST_ROWS
from ramiefenics.measured.seating import seat
from ramiefenics.measured.tables import need_columns, numbers, read_table
from ramiefenics.specification import (
    BendingTest,
    SpecificationError,
    override,
    published_test,
    read_test,
)
from ramiefenics.specification.files import from_dict, read_toml

SPECIMENS = "specimens.csv"


@dataclass(frozen=True)
class Specimen:
    """One stalk, its test as specified and its curve as measured.

    Attributes
    ----------
    name
        Its own.
    test
        The baseline with this specimen's geometry and covariates.
    curve
        ``displacement_mm``, ascending, ``force_N``, and ``time_s`` if known.
    row
        Its cells of `specimens.csv` by column, as text.
    """

    name: str
    test: BendingTest
    curve: pd.DataFrame
    row: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class Dataset:
    """Measured curves that one specification stands for.

    Attributes
    ----------
    folder
        Where it was read.
    layout
        What `dataset.toml` says.
    baseline
        The specification before a specimen's own values.
    specimens
        In the order of `specimens.csv`.
    """

    folder: Path
    layout: Layout
    baseline: BendingTest
    specimens: tuple[Specimen, ...]

    @property
    def range_mm(self) -> tuple[float, float]:
        """Displacements between which the curves are compared."""
        ends = [float(s.curve["displacement_mm"].iloc[-1]) for s in self.specimens]
        return self.layout.from_mm, min(ends) if self.layout.to_mm is None else self.layout.to_mm


def read_dataset(folder: str | Path) -> Dataset:
    """Read and check a folder of measured data.

    Raises
    ------
    SpecificationError
        On the first defect: file, row, and what to do.
    """
    folder = Path(folder)
    if not folder.is_dir():
        raise SpecificationError("dataset", str(folder), "must be a folder with a dataset.toml")
    try:
        layout = from_dict(Layout, read_toml(folder / "dataset.toml"))
        baseline = _baseline(folder, layout)
    except SpecificationError as error:
        raise error.inside("dataset.toml") from error
    path = folder / SPECIMENS
    table = read_table(path)
    sources = {key: listed(value) for key, value in layout.specimens.items()}
    names = layout.columns
    used = [column for columns in sources.values() for column in columns]
    need_columns(path, table, [names.specimen, names.curve, *used])
    values = {column: numbers(path, table, column) for column in used}
    specimens = []
    for index in range(len(table)):
        row = {k: float(np.mean([values[c][index] for c in v])) for k, v in sources.items()}
        specimens.append(_specimen(folder, layout, baseline, table.iloc[index], index + 2, row))
    dataset = Dataset(folder, layout, baseline, tuple(specimens))
    _check_together(dataset, table)
    return dataset


def _baseline(folder: Path, layout: Layout) -> BendingTest:
    named = not layout.baseline.endswith(".toml")
    test = published_test(layout.baseline) if named else read_test(folder / layout.baseline)
    return override(test, [f"fixture.{key}={value}" for key, value in layout.fixture.items()])


def _specimen(
    folder: Path,
    layout: Layout,
    baseline: BendingTest,
    row: pd.Series[str],
    number: int,
    values: Mapping[str, float],
) -> Specimen:
    name = row[layout.columns.specimen]
    length = layout.units.factor("specimens")
    changes = [f"{k}={v * (length if k.endswith('_mm') else 1.0)}" for k, v in values.items()]
    try:
        test = override(baseline, changes)
    except SpecificationError as error:
        raise error.inside(f"{SPECIMENS}, row {number} ({name}): ") from error
    curve = _curve(folder / row[layout.columns.curve], layout)
    cells = {str(column): cell for column, cell in row.items()}
    try:
        return Specimen(name, test, seat(curve, layout.seating), cells)
    except SpecificationError as error:
        raise error.inside(f"{SPECIMENS}, row {number} ({name}): ") from error


def _curve(path: Path, layout: Layout) -> pd.DataFrame:
    table = read_table(path)
    columns, units = layout.columns, layout.units
    need_columns(path, table, [columns.displacement, columns.force])
    wanted = {"displacement_mm": "displacement", "force_N": "force"}
    if columns.time in table.columns:
        wanted["time_s"] = "time"
    curve = pd.DataFrame(
        {
            name: np.array(numbers(path, table, getattr(columns, what))) * units.factor(what)
            for name, what in wanted.items()
        }
    )
    if len(curve) < LEAST_ROWS:
        allowed = f"must be at least {LEAST_ROWS} for a curve"
        raise SpecificationError(f"{path.name}, number of rows", len(curve), allowed)
    travel = curve["displacement_mm"].to_numpy()
    back = np.flatnonzero(np.diff(travel) < -0.01 * np.ptp(travel))
    if len(back):
        raise SpecificationError(
            f"{path.name}, row {back[0] + 3}, column {columns.displacement}",
            float(travel[back[0] + 1]),
            "must not go back by more than 1 % of the range; cut the curve before unloading",
        )
    if curve["force_N"].max() <= 0.0:
        allowed = (
            "must be above 0 N somewhere: compression counts positive; turn the sign, or zero the "
            "load cell"
        )
        raise SpecificationError(
            f"{path.name}, largest force", float(curve["force_N"].max()), allowed
        )
    return curve.sort_values("displacement_mm", kind="stable", ignore_index=True)


def _check_together(dataset: Dataset, table: pd.DataFrame) -> None:
    names = table[dataset.layout.columns.specimen]
    for row in np.flatnonzero(names.duplicated()):
        allowed = "must not occur twice; give each specimen a name of its own"
        raise SpecificationError(f"{SPECIMENS}, row {row + 2}, specimen", names.iloc[row], allowed)
    low, high = dataset.range_mm
    if not low < high:
        raise SpecificationError(
            "dataset.toml.to_mm", high, f"must be above from_mm = {low:g}, within every curve"
        )
    for specimen in dataset.specimens:
        end = float(specimen.curve["displacement_mm"].iloc[-1])
        if end < high:
            raise SpecificationError(
                "dataset.toml.to_mm",
                high,
                f"must be at most {end:g} mm, where the curve of {specimen.name} ends; lower it or "
                "take that specimen out",
            )

"""A folder of measured data: `dataset.toml`, `specimens.csv`, one CSV file per curve."""

from __future__ import annotations

import logging
import math
import warnings
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pandas as pd

from ramiefenics.measured.layout import Layout, listed
from ramiefenics.measured.noise import Array
from ramiefenics.measured.records import check_columns, check_progress, check_steps, same_record
from ramiefenics.measured.seating import seat
from ramiefenics.measured.tables import need_columns, numbers, read_table
from ramiefenics.published import published_test
from ramiefenics.published.citation import STUDY
from ramiefenics.specification import (
    BendingTest,
    SpecificationError,
    SpecificationWarning,
    override,
    read_test,
)
from ramiefenics.specification.files import from_dict, read_toml

log = logging.getLogger(__name__)

SPECIMENS = "specimens.csv"

REDUCED = "slopes and strengths are"
"""What fixtures of data sets are for."""

POINTS = 28
"""Displacements at which curves are compared: noise is correlated over about one such interval."""


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
    def title(self) -> str:
        """As `dataset.toml` has it, or the folder's name."""
        return self.layout.title or self.folder.name

    @property
    def range_mm(self) -> tuple[float, float]:
        """Displacements between which the curves are compared."""
        ends = [float(s.curve["displacement_mm"].iloc[-1]) for s in self.specimens]
        return self.layout.from_mm, min(ends) if self.layout.to_mm is None else self.layout.to_mm

    @property
    def at_mm(self) -> Array:
        """Displacements at which the curves are compared, equidistant, shape (POINTS,)."""
        low, high = self.range_mm
        return np.asarray(low + (high - low) * (np.arange(POINTS) + 1.0) / POINTS)

    def check_starts(self) -> None:
        """Check that every curve has begun where the comparison does.

        Raises
        ------
        SpecificationError
            Naming the file of the curve that begins last.
        """
        starts = [float(s.curve["displacement_mm"].iloc[0]) for s in self.specimens]
        last = int(np.argmax(starts))
        first = float(self.at_mm[0])
        if starts[last] <= first:
            return
        late, machine = self.specimens[last], self.layout.seating.zero == "machine"
        raise SpecificationError(
            f"{late.row[self.layout.columns.curve]}, first row, displacement_mm",
            round(starts[last], 6),
            f"must be at most {first:.4g}, as curves are compared from {self.layout.from_mm:g} mm "
            f"on; put from_mm = {math.ceil(100.0 * starts[last]) / 100.0:g} into dataset.toml, "
            f"{'let [seating] find the contact, ' if machine else ''}or take {late.name} out",
        )


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
        specimens.append(_specimen(folder, layout, baseline, table.iloc[index], row))
    dataset = Dataset(folder, layout, baseline, tuple(specimens))
    _check_together(dataset, table)
    if layout.seating.zero == "machine":  # the others put the zero before the first row
        dataset.check_starts()
    return dataset


def _baseline(folder: Path, layout: Layout) -> BendingTest:
    named = not layout.baseline.endswith(".toml")
    test = published_test(layout.baseline) if named else read_test(folder / layout.baseline)
    if named:
        warnings.warn(
            f"the baseline {layout.baseline} of {folder} gives its specimens ramie's constants "
            f"(Tables 3 and 7 of {STUDY})",
            SpecificationWarning,
            stacklevel=3,
        )
    test = override(test, [f"fixture.{key}={value}" for key, value in layout.fixture.items()])
    test.fixture.check_beam(REDUCED)
    return test


def _specimen(
    folder: Path,
    layout: Layout,
    baseline: BendingTest,
    row: pd.Series[str],
    values: Mapping[str, float],
) -> Specimen:
    for column in (layout.columns.specimen, layout.columns.curve):
        if not row[column]:
            where = f"{SPECIMENS}, row {row.name}, column {column}"
            raise SpecificationError(where, row[column], "must not be empty")
    name = row[layout.columns.specimen]
    place = f"{SPECIMENS}, row {row.name} ({name})"
    length = layout.units.factor("specimens")
    changes = [f"{k}={v * (length if k.endswith('_mm') else 1.0)}" for k, v in values.items()]
    try:
        test = override(baseline, changes)
    except SpecificationError as error:
        raise error.inside(place) from error
    curve = _curve(folder / row[layout.columns.curve], layout)
    cells = {str(column): cell for column, cell in row.items()}
    try:
        curve = seat(curve, layout.seating)
    except SpecificationError as error:
        raise error.inside(place) from error
    _check_sizes(place, test, curve)
    log.info("%s: %d rows to %.3f mm", name, len(curve), curve["displacement_mm"].iloc[-1])
    return Specimen(name, test, curve, cells)


def _check_sizes(place: str, test: BendingTest, curve: pd.DataFrame) -> None:
    """Check that no unit is taken for another.

    Nothing is bent farther than the supports are apart. No plant's fibre carries more than 2 GPa
    (flax, among the strongest, 1.3 GPa: Baley 2002); P L / 4 W is for the section without void.
    """
    beam, stalk = test.fixture.check_beam(REDUCED), test.stalk
    span, arms = beam.supports_mm, 2.0 * beam.arm_mm
    width, height = stalk.outer_diameter_mm, stalk.height_mm
    reach, peak = float(np.ptp(curve["displacement_mm"])), float(curve["force_N"].max())
    for what, value, least, most in (
        ("outer diameter in mm", width, span / 1000.0, span),
        ("height in mm", height, span / 1000.0, span),
        ("range of displacement in mm", reach, 0.0, span),
        ("nominal stress in MPa", 8.0 * peak * arms / (np.pi * width * height**2), 0.0, 2000.0),
    ):
        if not least <= value <= most:
            allowed = f"must be between {least:g} and {most:g}; check units, span and section"
            raise SpecificationError(f"{place}, {what}", round(value, 6), allowed)


def _curve(path: Path, layout: Layout) -> pd.DataFrame:
    table = read_table(path)
    columns, units = layout.columns, layout.units
    need_columns(path, table, [columns.displacement, columns.force])
    wanted = {"displacement_mm": "displacement", "force_N": "force"}
    if columns.time in table.columns:
        wanted["time_s"] = "time"
    curve = pd.DataFrame(
        {
            name: numbers(path, table, getattr(columns, what)) * units.factor(what)
            for name, what in wanted.items()
        },
        table.index,
    )
    check_columns(path, curve)
    check_progress(path, curve)
    check_steps(path, curve)
    least, largest = float(curve["force_N"].min()), float(curve["force_N"].max())
    if largest <= -least:
        allowed = (
            f"must be above 0 N, and farther from it than the least, {least:.6g}: compression "
            "counts positive; turn the sign, or zero the load cell"
        )
        raise SpecificationError(f"{path.name}, largest force", largest, allowed)
    return curve.sort_values("displacement_mm", kind="stable", ignore_index=True)


def _check_together(dataset: Dataset, table: pd.DataFrame) -> None:
    names, files = (table[getattr(dataset.layout.columns, what)] for what in ("specimen", "curve"))
    for row in names.index[names.duplicated()]:
        allowed = "must not occur twice; give each specimen a name of its own"
        raise SpecificationError(f"{SPECIMENS}, row {row}, specimen", names[row], allowed)
    if twins := same_record([specimen.curve for specimen in dataset.specimens]):
        first, second = (table.index[index] for index in twins)
        allowed = f"must not have the same curve as row {first}, {names[first]}; take one out"
        raise SpecificationError(f"{SPECIMENS}, row {second}, curve", files[second], allowed)
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

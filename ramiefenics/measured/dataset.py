"""A folder of measured data: `dataset.toml`, `specimens.csv`, one CSV file per curve.

If specimens are tested several times, there is also `tests.csv`, with one row per test.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from ramiefenics.measured.changes import changed
from ramiefenics.measured.layout import Layout, listed
from ramiefenics.measured.listing import Listed, list_tests
from ramiefenics.measured.record import REDUCED, Record, read_record
from ramiefenics.measured.records import same_record
from ramiefenics.published import published_test
from ramiefenics.published.citation import STUDY
from ramiefenics.results.text import label_of
from ramiefenics.specification import (
    BendingTest,
    SpecificationError,
    override,
    read_test,
)
from ramiefenics.specification.errors import warn
from ramiefenics.specification.files import from_dict
from ramiefenics.specification.reading import read_toml

if TYPE_CHECKING:
    import xarray as xr

POINTS = 401
"""Number of displacements to which every curve is interpolated for xarray."""


@dataclass(frozen=True)
class Dataset:
    """Measured curves of specimens that share a baseline specification.

    Attributes
    ----------
    folder
        Folder from which the data set was read.
    layout
        Contents of `dataset.toml`.
    baseline
        Specification before each specimen's own values are inserted.
    records
        All tests in the order of the files, with those of one specimen together.
    """

    folder: Path
    layout: Layout
    baseline: BendingTest
    records: tuple[Record, ...]

    @property
    def title(self) -> str:
        """Title in `dataset.toml`, or else the name of the folder."""
        return self.layout.title or self.folder.name

    @property
    def specimens(self) -> tuple[str, ...]:
        """Names of the specimens."""
        return tuple(dict.fromkeys(record.specimen for record in self.records))

    @property
    def curves(self) -> dict[str, pd.DataFrame]:
        """Tables with ``displacement_mm`` and ``force_N``, by name of the record."""
        return {record.name: record.curve for record in self.records}

    def to_xarray(self) -> xr.Dataset:
        """Return all curves at the same displacements, as an xarray data set.

        ``force_N`` has the dimensions ``curve`` and ``displacement_mm``. It is interpolated
        linearly between the rows of a record, and NaN outside them. The coordinates along ``curve``
        are the names of the specimens and the further columns of the tables.
        """
        import xarray as xr

        ends = [curve["displacement_mm"].iloc[[0, -1]] for curve in self.curves.values()]
        low, high = (float(pick(ends)) for pick in (np.min, np.max))
        at = np.linspace(low, high, POINTS)
        force = [
            np.interp(at, curve["displacement_mm"], curve["force_N"], math.nan, math.nan)
            for curve in self.curves.values()
        ]
        told = pd.DataFrame([dict(record.row) for record in self.records])
        names = self.layout.columns
        told = told.drop(columns=[names.specimen, names.curve], errors="ignore")
        told.insert(0, "specimen", [record.specimen for record in self.records])
        return xr.Dataset(
            {"force_N": (("curve", "displacement_mm"), force, {"units": "N"})},
            {
                "curve": list(self.curves),
                "displacement_mm": ("displacement_mm", at, {"units": "mm"}),
                **{str(name): ("curve", _numbers(column)) for name, column in told.items()},
            },
            {"title": self.title},
        )

    @property
    def range_mm(self) -> tuple[float, float]:
        """Displacements between which curves are compared; some curves may end earlier."""
        return self.layout.from_mm, max(record.range_mm[1] for record in self.records)

    @property
    def conditions(self) -> tuple[tuple[str, ...], ...]:
        """Conditions of every record, its values in `tests.csv`, if there is one, and its path."""
        columns = [name for names in self.layout.tests.values() for name in listed(names)]
        return tuple(
            (*(record.row[name] for name in columns), repr(record.test.protocol.then))
            for record in self.records
        )

    @property
    def condition_labels(self) -> tuple[str, ...]:
        """Conditions of every record in words; empty for the loading where `tests.csv` has none."""
        columns = [name for names in self.layout.tests.values() for name in listed(names)]
        labels = []
        for record in self.records:
            told = [f"{label_of(name)} {record.row[name]}" for name in columns]
            told += ["unloading"] if record.test.protocol.then else []
            labels.append(", ".join(told))
        return tuple(labels)

    def notes(self) -> list[str]:
        """Return notes on the parts of the records that are not compared."""
        names = [record.name for record in self.records if not record.after.empty]
        if not names:
            return []
        return [f"rows after the loading are kept, but not compared: {', '.join(names)}"]

    def check_starts(self) -> None:
        """Check that no curve begins later than the comparison.

        Raises
        ------
        SpecificationError
            If one does; the message names the file of the curve that begins last.
        """
        starts = [float(r.curve["displacement_mm"].iloc[0]) for r in self.records]
        last = int(np.argmax([a - r.at_mm[0] for a, r in zip(starts, self.records, strict=True)]))
        late, machine = self.records[last], self.layout.seating.zero == "machine"
        first = float(late.at_mm[0])
        if starts[last] <= first:
            return
        raise SpecificationError(
            f"{late.row[self.layout.columns.curve]}, first row, displacement_mm",
            round(starts[last], 6),
            f"must be at most {first:.4g}, as curves are compared from {self.layout.from_mm:g} mm "
            f"on; set from_mm = {math.ceil(100.0 * starts[last]) / 100.0:g} in dataset.toml, "
            f"{'let [seating] find the contact, ' if machine else ''}or remove {late.name}",
        )


def _numbers(column: pd.Series) -> list[str] | list[float]:
    """Return the cells as numbers if all of them are numbers, else as text."""
    try:
        return [float(cell) for cell in column]
    except ValueError:
        return [str(cell) for cell in column]


def read_dataset(folder: str | Path) -> Dataset:
    """Read and check a folder of measured data.

    Raises
    ------
    SpecificationError
        On the first defect; the message names file, row and remedy.
    """
    dataset = load_dataset(folder)
    if dataset.layout.seating.zero == "machine":  # other choices put zero before the first row
        dataset.check_starts()
    return dataset


def load_dataset(folder: str | Path) -> Dataset:
    """Read a folder of measured data, whose curves may begin too late to be compared.

    Raises
    ------
    SpecificationError
        On the first defect other than that; the message names file, row and remedy.
    """
    folder = Path(folder)
    if not folder.is_dir():
        raise SpecificationError("dataset", str(folder), "must be a folder with a dataset.toml")
    try:
        layout = from_dict(Layout, read_toml(folder / "dataset.toml"))
        baseline = _baseline(folder, layout)
    except SpecificationError as error:
        raise error.inside("dataset.toml") from error
    rows = list_tests(folder, layout)
    dataset = Dataset(folder, layout, baseline, tuple(_records(folder, layout, baseline, rows)))
    _check_together(dataset, rows)
    return dataset


def _baseline(folder: Path, layout: Layout) -> BendingTest:
    named = not layout.baseline.endswith(".toml")
    test = published_test(layout.baseline) if named else read_test(folder / layout.baseline)
    if named:
        warn(
            f"the baseline {layout.baseline} of {folder} gives its specimens ramie's constants "
            f"(Tables 3 and 7 of {STUDY})"
        )
    test = override(test, [f"fixture.{key}={value}" for key, value in layout.fixture.items()])
    test.fixture.check_beam(REDUCED)
    if layout.then:
        test = replace(test, protocol=replace(test.protocol, then=layout.then))
    return test


def _records(
    folder: Path, layout: Layout, baseline: BendingTest, rows: Sequence[Listed]
) -> Iterator[Record]:
    columns = layout.columns
    specimens = [row.cells[columns.specimen] for row in rows]
    taken: dict[str, str] = {}
    for index, row in enumerate(rows):
        name = specimen = specimens[index]
        if specimens.count(specimen) > 1:
            number = 1 + specimens[:index].count(specimen)
            name = f"{specimen} {row.cells.get(columns.test) or number}"
        if name in taken:
            allowed = f"must be unique: {taken[name]} already has the name {name}"
            raise SpecificationError(row.place(columns.test), row.cells.get(columns.test), allowed)
        taken[name] = row.place()
        place = f"{row.place()} ({name})"
        try:
            test = changed(baseline, row.settings)
        except SpecificationError as error:
            raise error.inside(place) from error
        path = folder / row.cells[columns.curve]
        yield read_record(place, (name, specimen), test, path, layout, row.cells)


def _check_together(dataset: Dataset, rows: Sequence[Listed]) -> None:
    column = dataset.layout.columns.curve
    if twins := same_record([record.curve for record in dataset.records]):
        first, second = (rows[index] for index in twins)
        who = dataset.records[twins[0]].name
        allowed = f"must not be the same curve as that of row {first.number}, {who}; remove one"
        raise SpecificationError(second.place(column), second.cells[column], allowed)
    for record in dataset.records:
        low, high = record.range_mm
        if not low < high:
            allowed = f"must be above from_mm = {low:g}, and within every curve"
            raise SpecificationError("dataset.toml.to_mm", high, allowed)
        end = float(record.curve["displacement_mm"].iloc[-1])
        if end < high:
            raise SpecificationError(
                "dataset.toml.to_mm",
                high,
                f"must be at most {end:g} mm, where the curve of {record.name} ends; lower it, "
                "leave it out to compare each curve up to its own end, or remove that curve",
            )

"""Which tests were made of which specimens: `specimens.csv`, and `tests.csv` if there is one."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from ramiefenics.measured.layout import Layout, listed
from ramiefenics.measured.tables import need_columns, numbers, read_table
from ramiefenics.specification import SpecificationError

SPECIMENS, TESTS = "specimens.csv", "tests.csv"


@dataclass(frozen=True)
class Listed:
    """A test, as the files list it.

    Attributes
    ----------
    file, number
        Of its row.
    cells
        Of that row, and of its specimen's, by column.
    settings
        What they change of the baseline, ``key=value``.
    """

    file: str
    number: int
    cells: Mapping[str, str]
    settings: tuple[str, ...]

    def place(self, column: str = "") -> str:
        """Return where it stands, for errors."""
        return f"{self.file}, row {self.number}{column and f', {column}'}"


def list_tests(folder: Path, layout: Layout) -> list[Listed]:
    """Return all tests of a data set, those of one specimen together.

    Raises
    ------
    SpecificationError
        If a file has a defect, a specimen occurs twice, has no test, or is not listed.
    """
    tested = (folder / TESTS).is_file()
    if layout.tests and not tested:
        raise SpecificationError("dataset.toml.tests", layout.tests, f"needs a {TESTS}")
    own = _read(folder / SPECIMENS, layout, layout.specimens, needs_curve=not tested)
    _check_once(own, layout)
    if not tested:
        return own
    by_name = {row.cells[layout.columns.specimen]: row for row in own}
    tests = []
    for row in _read(folder / TESTS, layout, layout.tests, needs_curve=True):
        name = row.cells[layout.columns.specimen]
        if name not in by_name:
            allowed = f"must be a specimen of {SPECIMENS}"
            raise SpecificationError(row.place(layout.columns.specimen), name, allowed)
        of = by_name[name]
        cells, settings = {**of.cells, **row.cells}, (*of.settings, *row.settings)
        tests.append(Listed(row.file, row.number, cells, settings))
    for name, row in by_name.items():
        if all(test.cells[layout.columns.specimen] != name for test in tests):
            raise SpecificationError(row.place(), name, f"must have a test in {TESTS}")
    order = list(by_name)
    return sorted(tests, key=lambda test: order.index(test.cells[layout.columns.specimen]))


def _read(path: Path, layout: Layout, mapped: Mapping[str, Any], needs_curve: bool) -> list[Listed]:
    table = read_table(path)
    sources = {key: listed(value) for key, value in mapped.items()}
    used = [column for columns in sources.values() for column in columns]
    needed = [layout.columns.specimen, *([layout.columns.curve] if needs_curve else [])]
    need_columns(path, table, [*needed, *used])
    values = {column: numbers(path, table, column) for column in used}
    rows = []
    for index in range(len(table)):
        row = table.iloc[index]
        for column in needed:
            if not row[column]:
                where = f"{path.name}, row {row.name}, column {column}"
                raise SpecificationError(where, row[column], "must not be empty")
        means = {key: float(np.mean([values[c][index] for c in cs])) for key, cs in sources.items()}
        rows.append(Listed(path.name, _number(row), _cells(row), _settings(means, layout)))
    return rows


def _number(row: pd.Series[str]) -> int:
    return int(str(row.name))


def _cells(row: pd.Series[str]) -> dict[str, str]:
    return {str(column): cell for column, cell in row.items()}


def _settings(values: Mapping[str, float], layout: Layout) -> tuple[str, ...]:
    length = layout.units.factor("specimens")
    settings = [f"{k}={v * (length if k.endswith('_mm') else 1.0)}" for k, v in values.items()]
    turned = values.get("stalk.rotation_deg", 0.0) != 0.0
    return (*(["numerics.domain=full"] if turned else []), *settings)


def _check_once(rows: list[Listed], layout: Layout) -> None:
    names = [row.cells[layout.columns.specimen] for row in rows]
    for index, row in enumerate(rows):
        if names[index] in names[:index]:
            allowed = (
                f"must not occur twice; give each specimen a name of its own, or list several "
                f"tests of one in {TESTS}"
            )
            raise SpecificationError(row.place(layout.columns.specimen), names[index], allowed)

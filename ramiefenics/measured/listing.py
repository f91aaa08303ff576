"""Lists of the specimens and their tests: `specimens.csv`, and `tests.csv` if there is one."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ramiefenics.measured.changes import changes_by_row
from ramiefenics.measured.layout import Layout, listed
from ramiefenics.measured.tables import need_columns, read_table
from ramiefenics.specification import SpecificationError

SPECIMENS, TESTS = "specimens.csv", "tests.csv"


@dataclass(frozen=True)
class Listed:
    """A test as listed in the files.

    Attributes
    ----------
    file, number
        File and number of its row.
    cells
        Cells of this row and of its specimen's row, by column.
    settings
        Changes to the baseline that the cells make, as ``key=value``.
    """

    file: str
    number: int
    cells: Mapping[str, str]
    settings: tuple[str, ...]

    def place(self, column: str = "") -> str:
        """Return the place of the row, or of one of its cells, for error messages."""
        return f"{self.file}, row {self.number}{column and f', {column}'}"


def list_tests(folder: Path, layout: Layout) -> list[Listed]:
    """Return all tests of a data set, with those of one specimen together.

    Raises
    ------
    SpecificationError
        If a file has a defect, a specimen occurs twice, has no test or is not listed, or a column
        of `tests.csv` has no place in the specification.
    """
    tested = (folder / TESTS).is_file()
    if layout.tests and not tested:
        raise SpecificationError("dataset.toml.tests", layout.tests, f"needs a {TESTS}")
    own = _read(folder / SPECIMENS, layout, layout.specimens, needs_curve=not tested)
    _check_once(own, layout)
    if not tested:
        return own
    _check_curves(own, layout)
    by_name = {row.cells[layout.columns.specimen]: row for row in own}
    rows, tests = _read(folder / TESTS, layout, layout.tests, needs_curve=True), []
    _check_places(rows, layout)
    for row in rows:
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
    needed = [layout.columns.specimen, *([layout.columns.curve] if needs_curve else [])]
    need_columns(path, table, needed)
    settings = changes_by_row(path, table, mapped, layout.units.factor("specimens"))
    rows = []
    for index, changes in enumerate(settings):
        cells = {str(column): cell for column, cell in table.iloc[index].items()}
        row = Listed(path.name, int(table.index[index]), cells, tuple(changes))
        for column in needed:
            if not cells[column]:
                allowed = "must not be empty"
                raise SpecificationError(row.place(f"column {column}"), cells[column], allowed)
        rows.append(row)
    return rows


def _check_curves(specimens: list[Listed], layout: Layout) -> None:
    """Check that `specimens.csv` names no curves, as `tests.csv` names them."""
    for row in specimens:
        if file := row.cells.get(layout.columns.curve):
            allowed = f"must be empty, as {TESTS} names the curves"
            raise SpecificationError(row.place(f"column {layout.columns.curve}"), file, allowed)


def _check_places(tests: list[Listed], layout: Layout) -> None:
    """Check that all columns of `tests.csv` are used.

    In an unused one, conditions may be stated that the baseline does not have.
    """
    names = layout.columns
    mapped = [column for columns in layout.tests.values() for column in listed(columns)]
    for column in tests[0].cells:
        if column not in ("", names.specimen, names.curve, names.test, *mapped):
            allowed = (
                "must be a column that [tests] in dataset.toml assigns to a key of the "
                "specification, or be removed"
            )
            raise SpecificationError(f"{TESTS}, heading", column, allowed)


def _check_once(rows: list[Listed], layout: Layout) -> None:
    names = [row.cells[layout.columns.specimen] for row in rows]
    for index, row in enumerate(rows):
        if names[index] in names[:index]:
            allowed = (
                "must not occur twice; give each specimen a name of its own, or list several tests "
                f"of a specimen in {TESTS}"
            )
            raise SpecificationError(row.place(layout.columns.specimen), names[index], allowed)

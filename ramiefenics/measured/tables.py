"""Tables of text: files to lines, lines to cells, cells to numbers, units."""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from ramiefenics.measured.noise import Array
from ramiefenics.specification import SpecificationError
from ramiefenics.specification.reading import read_bytes

ENCODINGS = ("utf-8-sig", "utf-16", "cp1252")
"""Tried in turn; machines run Windows."""

NO_TEXT = re.compile(r"[\x00-\x08\x0e-\x1f]|[^\r\n]{100000}")
"""Characters and lengths of lines that no table has, but programs and pictures have."""

LARGEST = 1e15
"""Of any number: far above all that is measured in mm, N or s, and its powers are numbers still."""

UNITS: dict[str, dict[str, float]] = {
    "mm": {"um": 1e-3, "mm": 1.0, "cm": 10.0, "m": 1000.0, "in": 25.4},
    "N": {"mN": 1e-3, "N": 1.0, "kN": 1000.0, "lbf": 4.4482216, "kgf": 9.80665},
    "s": {"ms": 1e-3, "s": 1.0, "min": 60.0, "h": 3600.0},
}
"""By the unit used inside: what others are worth in it."""


def unit_factor(field: str, unit: str, inside: str) -> float:
    """Return what one of a unit is worth in the one used inside.

    Raises
    ------
    SpecificationError
        If it is not known; `field` is what the message names.
    """
    known = UNITS[inside]
    if unit not in known:
        raise SpecificationError(field, unit, f"must be one of {', '.join(known)}")
    return known[unit]


@dataclass(frozen=True)
class Row:
    """A line of a file: its number, from 1, and its cells."""

    number: int
    cells: Sequence[str]


def read_lines(path: Path, encodings: Sequence[str] = ENCODINGS) -> list[str]:
    """Return the lines of a text file of unknown encoding.

    Parameters
    ----------
    path
        Of the file.
    encodings
        To try.

    Raises
    ------
    SpecificationError
        If it cannot be read, or is no text.
    """
    data = read_bytes(path)
    for encoding in encodings:
        if encoding == "utf-16" and data[:2] not in (b"\xff\xfe", b"\xfe\xff"):
            continue
        try:
            text = data.decode(encoding)
        except UnicodeDecodeError:
            continue
        if not NO_TEXT.search(text):
            return re.split(r"\r\n|\r|\n", text)
    raise SpecificationError("file", str(path), "must be text; export it as CSV or text")


def split_cells(path: Path, number: int, line: str, delimiter: str = ",") -> Row:
    """Return a line's cells, quoted or not, without the blanks around them.

    Raises
    ------
    SpecificationError
        If a quotation mark is not closed within the line, or followed by text.
    """
    try:
        (cells,) = csv.reader([line], delimiter=delimiter, skipinitialspace=True, strict=True)
    except csv.Error as error:
        allowed = f"must be whole cells, quotation marks closed ({error})"
        raise SpecificationError(f"{path.name}, row {number}", line[:40], allowed) from error
    return Row(number, [cell.strip() for cell in cells])


def make_table(path: Path, names: Sequence[str], rows: Sequence[Row]) -> pd.DataFrame:
    """Return rows as a table of text, its index the rows' numbers in the file.

    Parameters
    ----------
    path
        Named in errors.
    names
        Of the columns; an empty one belongs to a column that nobody asks for.
    rows
        Those below the heading.

    Raises
    ------
    SpecificationError
        If a name occurs twice, or a row has more or fewer cells than there are columns.
    """
    for name in filter(None, names):
        if list(names).count(name) > 1:
            raise SpecificationError(f"{path.name}, heading", name, "must not occur twice")
    for row in rows:
        if len(row.cells) != len(names):
            there = ", ".join(name or "-" for name in names)
            allowed = (
                f"must be {len(names)}, one for each column ({there}); correct the row or remove "
                "it, and see that no comma is a decimal one"
            )
            where = f"{path.name}, row {row.number}, number of cells"
            raise SpecificationError(where, len(row.cells), allowed)
    numbered = [row.number for row in rows]
    return pd.DataFrame([row.cells for row in rows], numbered, list(names), dtype=str)


def read_table(path: Path) -> pd.DataFrame:
    """Read a CSV file with a heading, all cells as text; see `make_table`.

    Raises
    ------
    SpecificationError
        If it cannot be read, has no rows, or one that does not go with the heading.
    """
    lines = [(n, line) for n, line in enumerate(read_lines(path), start=1) if line.strip()]
    if len(lines) < 2:
        raise SpecificationError("file", str(path), "must have a heading and at least one row")
    heading, *rows = [split_cells(path, number, line) for number, line in lines]
    if len(heading.cells) < 2:
        allowed = "must name two columns or more, with commas between them"
        raise SpecificationError(f"{path.name}, heading", lines[0][1][:40], allowed)
    return make_table(path, heading.cells, rows)


def need_columns(path: Path, table: pd.DataFrame, names: Sequence[str]) -> None:
    """Check that a table has columns.

    Raises
    ------
    SpecificationError
        Naming the first that is missing, and those that are there.
    """
    for name in names:
        if not name or name not in table.columns:
            there = ", ".join(table.columns)
            raise SpecificationError(
                path.name,
                name,
                f"is not among its columns ({there}); name the right one in dataset.toml",
            )


def numbers(
    path: Path, table: pd.DataFrame, name: str, remedy: str = "correct it or remove the row"
) -> Array:
    """Return a column of a table as finite numbers.

    Raises
    ------
    SpecificationError
        Naming file, row and column of the first cell that is none.
    """
    values = np.array([parse_number(text) for text in table[name]], dtype=np.float64)
    for index in np.flatnonzero(~(np.abs(values) <= LARGEST)):
        allowed = f"must be a number with a decimal point, within ±{LARGEST:g}; {remedy}"
        where = f"{path.name}, row {table.index[index]}, column {name}"
        raise SpecificationError(where, table[name].iloc[index][:40], allowed)
    return values


def parse_number(text: str) -> float:
    """Return a number as it is written, NaN for anything else."""
    plain = re.fullmatch(r"[+-]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][+-]?[0-9]+)?", text.strip())
    return float(text) if plain else math.nan

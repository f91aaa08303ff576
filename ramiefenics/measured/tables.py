"""Tables in text files: lines, cells, numbers and units."""

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
"""Encodings of text files, tried in turn; testing machines run Windows."""

NO_TEXT = re.compile(r"[\x00-\x08\x0e-\x1f]|[^\r\n]{100000}")
"""Characters and overlong lines that occur in programs and pictures, but not in tables."""

LARGEST = 1e15
"""Largest magnitude of a number.

It is far above all that is measured in mm, N or s, and its powers do not overflow.
"""

UNITS: dict[str, dict[str, float]] = {
    "mm": {"um": 1e-3, "mm": 1.0, "cm": 10.0, "m": 1000.0, "in": 25.4},
    "N": {
        **{"mN": 1e-3, "N": 1.0, "daN": 10.0, "kN": 1000.0},
        **{"lbf": 4.4482216, "gf": 9.80665e-3, "kgf": 9.80665},
    },
    "s": {"ms": 1e-3, "s": 1.0, "min": 60.0, "h": 3600.0},
    "mm/min": {"mm/min": 1.0, "mm/s": 60.0, "cm/min": 10.0, "m/min": 1000.0, "in/min": 25.4},
}
"""Values of units in the unit that is used internally, by the latter."""


def unit_factor(field: str, unit: str, inside: str) -> float:
    """Return the value of a unit in the one that is used internally.

    Raises
    ------
    SpecificationError
        If the unit is not known; the message names `field`.
    """
    known = UNITS[inside]
    if unit not in known:
        raise SpecificationError(field, unit, f"must be one of {', '.join(known)}")
    return known[unit]


@dataclass(frozen=True)
class Row:
    """A line of a file: its number, counted from 1, and its cells."""

    number: int
    cells: Sequence[str]


def read_lines(path: Path, encodings: Sequence[str] = ENCODINGS) -> list[str]:
    """Return the lines of a text file of unknown encoding.

    Parameters
    ----------
    path
        The file.
    encodings
        Encodings to try, in this order.

    Raises
    ------
    SpecificationError
        If the file cannot be read or is not text.
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
    """Return the cells of a line, quoted or not, without surrounding blanks.

    Raises
    ------
    SpecificationError
        If a quotation mark is not closed within the line, or is followed by text.
    """
    try:
        (cells,) = csv.reader([line], delimiter=delimiter, skipinitialspace=True, strict=True)
    except csv.Error as error:
        allowed = f"must have complete cells, with quotation marks closed ({error})"
        raise SpecificationError(f"{path.name}, row {number}", line[:40], allowed) from error
    return Row(number, [cell.strip() for cell in cells])


def make_table(path: Path, names: Sequence[str], rows: Sequence[Row]) -> pd.DataFrame:
    """Return rows as a table of text, indexed by their numbers in the file.

    Parameters
    ----------
    path
        File, named in errors.
    names
        Names of the columns; empty for a column that is not needed.
    rows
        Rows below the heading.

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
                "it, and make sure that no comma is a decimal comma"
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
        If it cannot be read, has no rows, or has a row that does not match the heading.
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
    """Check that a table has the columns that are needed.

    Raises
    ------
    SpecificationError
        If one is missing; the message names the first such column and those that exist.
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
        If a cell is not a number; the message names file, row and column of the first.
    """
    values = np.array([parse_number(text) for text in table[name]], dtype=np.float64)
    for index in np.flatnonzero(~(np.abs(values) <= LARGEST)):
        allowed = f"must be a number with a decimal point, within ±{LARGEST:g}; {remedy}"
        where = f"{path.name}, row {table.index[index]}, column {name}"
        raise SpecificationError(where, table[name].iloc[index][:40], allowed)
    return values


def parse_number(text: str) -> float:
    """Return the number that a text states, or NaN if it is not a number."""
    plain = re.fullmatch(r"[+-]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][+-]?[0-9]+)?", text.strip())
    return float(text) if plain else math.nan

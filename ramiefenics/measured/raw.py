"""Raw files of testing machines, whatever their format."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pandas as pd

from ramiefenics.measured.noise import Array
from ramiefenics.specification import SpecificationError

LEAST_ROWS = 20
"""A curve with fewer is not worth a comparison."""

ENCODINGS = ("utf-8-sig", "utf-16", "cp1252")
"""Tried in turn; machines run Windows."""

UNLOADED = 0.01
"""Share of the range by which displacement goes back where a specimen is unloaded."""


@dataclass(frozen=True)
class RawCurve:
    """What one raw file says.

    Attributes
    ----------
    path
        The file.
    curve
        ``displacement_mm``, ``force_N`` (compression positive), and ``time_s`` if known.
    header
        Name and value of what the file says besides, units in the names.
    notes
        What was changed to get there, in sentences.
    """

    path: Path
    curve: pd.DataFrame
    header: Mapping[str, str] = field(default_factory=dict)
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class Row:
    """A line of a raw file: its number, from 1, and its cells."""

    number: int
    cells: Sequence[str]


def read_lines(path: Path) -> list[str]:
    """Return the lines of a text file of unknown encoding.

    Raises
    ------
    SpecificationError
        If it cannot be read, or is no text.
    """
    try:
        data = path.read_bytes()
    except OSError as error:
        raise SpecificationError("file", str(path), f"cannot be read ({error.strerror})") from error
    for encoding in ENCODINGS:
        if encoding == "utf-16" and data[:2] not in (b"\xff\xfe", b"\xfe\xff"):
            continue
        try:
            return data.decode(encoding).splitlines()
        except UnicodeDecodeError:
            continue
    raise SpecificationError("file", str(path), "must be text; export it as CSV or text")


def read_numbers(path: Path, rows: Sequence[Row], columns: Mapping[str, int]) -> pd.DataFrame:
    """Return columns of cells as finite numbers.

    Cells with a comma and none with a point in all of them mean that the comma is decimal.

    Parameters
    ----------
    path
        Named in errors.
    rows
        Lines with data.
    columns
        Place of each column among the cells, by its name.

    Raises
    ------
    SpecificationError
        Naming file, row and column of the first cell that is missing or no number.
    """
    least = max(columns.values()) + 1
    for row in rows:
        if len(row.cells) < least:
            allowed = f"must be at least {least}; correct the row or remove it"
            where = f"{path.name}, row {row.number}, number of columns"
            raise SpecificationError(where, len(row.cells), allowed)
    used = [row.cells[place] for row in rows for place in columns.values()]
    comma = any("," in cell for cell in used) and not any("." in cell for cell in used)
    found: dict[str, Array] = {}
    for name, place in columns.items():
        values = np.empty(len(rows))
        for index, row in enumerate(rows):
            cell = row.cells[place].strip()
            values[index] = parse_number(cell.replace(",", ".") if comma else cell)
            if not np.isfinite(values[index]):
                raise SpecificationError(
                    f"{path.name}, row {row.number}, column {name}",
                    cell,
                    "must be a number; correct it or remove the row, and export one specimen "
                    "per file",
                )
        found[name] = values
    return pd.DataFrame(found)


def parse_number(text: str) -> float:
    """Return a number as it is written, NaN for anything else."""
    plain = re.fullmatch(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", text.strip())
    return float(text) if plain else float("nan")


def tidy(path: Path, curve: pd.DataFrame, header: Mapping[str, str] | None = None) -> RawCurve:
    """Turn compression positive, and cut off where the specimen is unloaded.

    Raises
    ------
    SpecificationError
        If too few rows are there, or the force or the displacement stays where it is.
    """
    notes = []
    for name in ("force_N", "displacement_mm"):
        values = curve[name].to_numpy()
        if len(values) < LEAST_ROWS:
            allowed = f"must be at least {LEAST_ROWS} for a curve"
            raise SpecificationError(f"{path.name}, number of rows", len(values), allowed)
        if np.ptp(values) == 0.0:
            allowed = "must change; is it the right column?"
            raise SpecificationError(f"{path.name}, {name}", float(values[0]), allowed)
        # a load cell may not have been zeroed, and one row may be wild
        from_start = values - np.median(values[:5])
        if -from_start.min() > from_start.max():
            if name == "displacement_mm":  # a position, whose origin means nothing once turned
                values = values - values[0]
            curve = curve.assign(**{name: -values})
            notes.append(f"{path.name}: sign of {name} turned, compression counts positive")
    travel = curve["displacement_mm"].to_numpy()
    end = int(travel.argmax())
    if travel[end] - travel[end:].min() > UNLOADED * np.ptp(travel):
        left_out = len(travel) - 1 - end
        notes.append(f"{path.name}: the last {left_out} rows, unloading, left out")
        curve = curve.iloc[: end + 1]
    return RawCurve(path, curve.reset_index(drop=True), dict(header or {}), tuple(notes))


def read_all(paths: Sequence[str | Path], read: Callable[[Path], RawCurve]) -> dict[str, RawCurve]:
    """Read raw files by one reader, each under a name of its own.

    Returns
    -------
    dict
        By the file's name without ending, with its folder's before it where two have the same.

    Raises
    ------
    SpecificationError
        If there is no file, or the same one twice.
    """
    files = [Path(path) for path in paths]
    if not files:
        raise SpecificationError("raw", None, "must name at least one file")
    stems = [file.stem for file in files]
    named: dict[str, RawCurve] = {}
    for file, stem in zip(files, stems, strict=True):
        parent = file.resolve().parent.name
        name = stem if stems.count(stem) == 1 else f"{parent}_{stem}"
        if name in named:
            allowed = "must not occur twice, folder and name; rename one"
            raise SpecificationError("raw", str(file), allowed)
        named[name] = read(file)
    return named

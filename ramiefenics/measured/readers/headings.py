"""Raw data with a line of headings: text exports of most machines, and Excel workbooks.

Instron's Bluehill, ZwickRoell's testXpert, MTS TestSuite, Shimadzu's Trapezium and others write a
header of keys and values, the names of the columns, their units (beside the names, in them or
below), and rows. Cells are separated by commas, semicolons or tabs, quoted or not, and have a
decimal point or comma:

    Specimen properties : Diameter,"14,0",mm

    Time,Extension,Load
    (s),(mm),(N)
    "0,1","0,02","1,5"
"""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Sequence
from io import BytesIO
from pathlib import Path
from zipfile import BadZipFile, ZipFile

import pandas as pd

from ramiefenics.measured.raw import RawCurve, read_numbers
from ramiefenics.measured.readers.base import Reader
from ramiefenics.measured.readers.words import NAMES, UNIT_SPELLINGS
from ramiefenics.measured.tables import (
    UNITS,
    make_table,
    parse_number,
    read_lines,
    split_cells,
    unit_factor,
)
from ramiefenics.specification import SpecificationError
from ramiefenics.specification.reading import LARGEST_BYTES, read_bytes

DELIMITERS = (",", ";", "\t")

WORKBOOKS = (".xlsx", ".xlsm")

BESIDE = re.compile(
    r"\s*[(\[\uff08]\s*([^)\]\uff09]*?)\s*[)\]\uff09]\s*$|\s*/\s*(\w+)\s*$|\s+in\s+(\w+)\s*$"
)
"""A unit that follows a name: in brackets, after a slash, or after "in"."""

Columns = dict[str, int]
"""Index of the column of each quantity."""


def read_headings(path: Path) -> RawCurve:
    """Read a raw file with headings.

    Raises
    ------
    SpecificationError
        On the first defect; the message names file, row and remedy.
    """
    lines, (names, delimiter, columns) = _found(path)
    cells = _split(lines[names], delimiter)
    units, first = _units(path, cells, columns, lines, names, delimiter)
    rows = [
        split_cells(path, number, line, delimiter)
        for number, line in enumerate(lines[first:], start=first + 1)
        if line.strip(' \t",;')
    ]
    if not rows:
        raise SpecificationError(path.name, None, f"has no rows of data below row {first}")
    named = {place: name for name, place in columns.items()}
    table = make_table(path, [named.get(place, "") for place in range(len(cells))], rows)
    curve = read_numbers(path, table, list(columns))
    for name in columns:
        inside = name.rpartition("_")[2]
        place = f"{path.name}, row {first}, unit of {cells[columns[name]].strip()}"
        curve[name] *= unit_factor(place, units[name], inside)
    return RawCurve(path, curve, _header(lines[:names], delimiter))


def _found(path: Path) -> tuple[list[str], tuple[int, str, Columns]]:
    """Return the lines and the place of the headings, in the encoding or sheet that has them."""
    if path.suffix.lower() in WORKBOOKS:
        versions = _sheets(path)
    else:
        versions = [read_lines(path)]
        if _names(path, versions[0]) is None:  # Chinese text can pass for a Western encoding
            versions += [read_lines(path, ("gb18030",))] if _is_bytes(path, "gb18030") else []
    with_names = [(lines, at) for lines in versions if (at := _names(path, lines)) is not None]
    if len(with_names) > 1:
        allowed = (
            "must have only one sheet with a force and a displacement; export each specimen to its "
            "own file"
        )
        raise SpecificationError(path.name, len(with_names), allowed)
    if with_names:
        return with_names[0]
    raise SpecificationError(
        path.name,
        None,
        f"must have a line that names a displacement ({', '.join(NAMES['displacement_mm'][:3])}, "
        f"...) and a force ({', '.join(NAMES['force_N'][:3])}, ...); rename the columns "
        "accordingly, or use the format columns",
    )


def _is_bytes(path: Path, encoding: str) -> bool:
    try:
        read_bytes(path).decode(encoding)
    except UnicodeDecodeError:
        return False
    return True


def _sheets(path: Path) -> list[list[str]]:
    """Return the sheets of a workbook as lines, with tabs between cells."""
    content = BytesIO(read_bytes(path))
    try:
        with ZipFile(content) as parts:
            size = sum(part.file_size for part in parts.infolist())
        if size > LARGEST_BYTES:
            raise ValueError(f"unpacked, it would have {size / 1e6:.0f} MB")
        sheets = pd.read_excel(content, sheet_name=None, header=None, dtype=object)
    except (OSError, ValueError, KeyError, BadZipFile, SyntaxError) as error:
        raise SpecificationError("file", str(path), f"cannot be read ({error})") from error
    return [
        ["\t".join(_text(cell) for cell in row) for row in sheet.itertuples(index=False)]
        for sheet in sheets.values()
    ]


def _text(cell: object) -> str:
    return "" if cell is None or cell != cell else re.sub(r"\s+", " ", str(cell))


def _split(line: str, delimiter: str) -> list[str]:
    return next(csv.reader([line], delimiter=delimiter, skipinitialspace=True), [])


def _names(path: Path, lines: Sequence[str]) -> tuple[int, str, Columns] | None:
    """Find the line with the columns' names, its delimiter, and the column of each quantity."""
    for index, line in enumerate(lines):
        for delimiter in DELIMITERS:
            plain = [_bare(cell) for cell in _split(line, delimiter)]
            columns = {}
            for name, known in NAMES.items():
                there = [plain.index(k) for k in known if k in plain]
                if there:
                    columns[name] = there[0]
            if {"displacement_mm", "force_N"} <= columns.keys():
                for place in columns.values():
                    if plain.count(plain[place]) > 1:
                        where = f"{path.name}, row {index + 1}, column"
                        raise SpecificationError(where, plain[place], "must not occur twice")
                return index, delimiter, columns
    return None


def _bare(cell: str) -> str:
    """Return a column's name without its unit."""
    return BESIDE.sub("", cell).strip().lower()


def _units(
    path: Path,
    cells: Sequence[str],
    columns: Columns,
    lines: Sequence[str],
    names: int,
    delimiter: str,
) -> tuple[dict[str, str], int]:
    """Return the units by quantity, found beside or below the names, and the next line's index."""
    beside = [BESIDE.search(cell.strip()) for cell in cells]
    if all(beside[place] for place in columns.values()):
        return {
            name: _known(next(filter(None, match.groups()), ""))
            for name, place in columns.items()
            if (match := beside[place])
        }, names + 1
    below = _split(lines[names + 1], delimiter) if names + 1 < len(lines) else []
    units = {}
    for name, place in columns.items():
        text = below[place].strip() if place < len(below) else ""
        unit = _known(text.strip("()[]\uff08\uff09 "))
        if not unit or math.isfinite(parse_number(unit.replace(",", "."))):
            raise SpecificationError(
                f"{path.name}, row {names + 2}, unit of {cells[place].strip()}",
                text,
                "must be a unit such as (mm), (N) or (s), below the column's name or beside it",
            )
        units[name] = unit
    return units, names + 2


def _known(unit: str) -> str:
    """Return a unit in the spelling of `UNITS`."""
    every = [known for table in UNITS.values() for known in table]
    return unit if unit in every else UNIT_SPELLINGS.get(unit.lower(), unit)


def _header(lines: Sequence[str], delimiter: str) -> dict[str, str]:
    """Return the values above the table by key; a key may itself contain commas."""
    found: dict[str, str] = {}
    for line in lines:
        quoted = re.fullmatch(r'"?([^"]+?)"?[,;\t]\s*"([^"]*)"(?:[,;\t]\s*"?([^"]*?)"?)?\s*', line)
        parts = list(quoted.groups("")) if quoted else [*_split(line, delimiter), "", "", ""][:3]
        key, value, unit = (part.strip() for part in parts)
        if not key or not value:
            continue
        short = key.rpartition(" : ")[2]
        name = f"{short} ({unit})" if unit else short
        number = value.replace(",", ".")
        if "," in value and math.isfinite(parse_number(number)):
            value = number
        found[name if name not in found else f"{key} ({unit})" if unit else key] = value
    return found


HEADINGS = Reader(
    "headings",
    "Text or Excel with headings, in English, German, French, Spanish or Chinese: Instron, "
    "ZwickRoell, MTS, Shimadzu and others.",
    read_headings,
)

"""Raw data as Instron's Bluehill exports it: a header of keys and values, names, units, rows.

Comma, semicolon or tab between cells, quoted or not, decimal point or comma; lines such as

    Specimen properties : Diameter,"14,0",mm

    Time,Extension,Load
    (s),(mm),(N)
    "0,1","0,02","1,5"
"""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Mapping, Sequence
from pathlib import Path

from ramiefenics.measured.raw import RawCurve, read_numbers
from ramiefenics.measured.readers.base import Reader
from ramiefenics.measured.tables import (
    UNITS,
    make_table,
    parse_number,
    read_lines,
    split_cells,
    unit_factor,
)
from ramiefenics.specification import SpecificationError

NAMES: dict[str, tuple[str, ...]] = {
    "displacement_mm": (
        "extension",
        "displacement",
        "flexure extension",
        "flexural extension",
        "compressive extension",
        "flexural displacement",
        "compressive displacement",
        "crosshead",
        "position",
    ),
    "force_N": (
        "load",
        "force",
        "flexure load",
        "flexural load",
        "compressive load",
        "flexural force",
        "compressive force",
    ),
    "time_s": ("time", "total time", "test time"),
}
"""What a column is called; the first that is there is taken."""

DELIMITERS = (",", ";", "\t")


def read_instron(path: Path) -> RawCurve:
    """Read a raw file of Bluehill.

    Raises
    ------
    SpecificationError
        On the first defect: file, row, and what to do.
    """
    lines = read_lines(path)
    names, delimiter, columns = _names(path, lines)
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


def _split(line: str, delimiter: str) -> list[str]:
    return next(csv.reader([line], delimiter=delimiter, skipinitialspace=True), [])


def _names(path: Path, lines: Sequence[str]) -> tuple[int, str, dict[str, int]]:
    """Find the line with the columns' names, what is between them, and who is where."""
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
    raise SpecificationError(
        path.name,
        None,
        f"must have a line that names a displacement ({', '.join(NAMES['displacement_mm'][:3])}, "
        f"...) and a force ({', '.join(NAMES['force_N'][:3])}, ...); rename its columns so, or "
        "use the format columns",
    )


def _bare(cell: str) -> str:
    """Return a column's name without its unit."""
    return re.sub(r"\s*\(.*\)$", "", cell).strip().lower()


def _units(
    path: Path,
    cells: Sequence[str],
    columns: Mapping[str, int],
    lines: Sequence[str],
    names: int,
    delimiter: str,
) -> tuple[dict[str, str], int]:
    """Return units by column, beside the names or below, and the index of the line after."""
    beside = [re.search(r"\((.*)\)$", cell.strip()) for cell in cells]
    if all(beside[place] for place in columns.values()):
        found = {n: _known(m[1].strip()) for n, i in columns.items() if (m := beside[i])}
        return found, names + 1
    below = _split(lines[names + 1], delimiter) if names + 1 < len(lines) else []
    units = {}
    for name, place in columns.items():
        text = below[place].strip() if place < len(below) else ""
        if not (text.startswith("(") and text.endswith(")")):
            raise SpecificationError(
                f"{path.name}, row {names + 2}, unit of {cells[place].strip()}",
                text,
                "must be a unit in brackets such as (mm), (N) or (s), below the column's name",
            )
        units[name] = _known(text[1:-1].strip())
    return units, names + 2


def _known(unit: str) -> str:
    """Return a unit as the tables spell it."""
    spelt = {"sec": "s", "inch": "in", "KN": "kN"}
    every = [known for table in UNITS.values() for known in table]
    return unit if unit in every else spelt.get(unit, unit)


def _header(lines: Sequence[str], delimiter: str) -> dict[str, str]:
    """Return the values above the table; a key may itself have commas."""
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


INSTRON = Reader("instron", "What Instron's Bluehill exports as raw data.", read_instron)

"""The line with the names of the columns in a raw file, and the units below or beside them."""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from ramiefenics.measured.readers.header import BLANKS, split_line
from ramiefenics.measured.readers.naming import (
    assign_columns,
    known_unit,
    last_unit,
    plain,
    quantities_of,
    split_unit,
)
from ramiefenics.measured.readers.words import COMMENTS, OTHER_UNITS
from ramiefenics.measured.tables import UNITS, parse_number
from ramiefenics.specification import SpecificationError

DELIMITERS = (",", ";", "\t", BLANKS)

NUMBERS = re.compile(r'[\d\s.,;:+\-eE"]*')
"""A line that has numbers only, and is passed over for speed."""

CLOCK = re.compile(r"\d+:\d\d:\d\d(?:[.,]\d*)?")
"""Time of day or since the start, in hours, minutes and seconds."""


@dataclass(frozen=True)
class Block:
    """Neighbouring columns that hold the record of one specimen.

    Attributes
    ----------
    label
        Name of the specimen; empty if the file has only one.
    start
        Index of the first of the columns.
    names
        Names of the columns.
    columns
        Index, within the block, of the column of each quantity, see `assign_columns`.
    units
        Units of these quantities; "" for a time whose unit is not stated.
    """

    label: str
    start: int
    names: Sequence[str]
    columns: Mapping[str, int]
    units: Mapping[str, str]


@dataclass(frozen=True)
class Heading:
    """Names of the columns of a table.

    Attributes
    ----------
    row, first
        Indices of the line with the names, and of the first line below names and units.
    delimiter
        Delimiter of the cells; `BLANKS` for two or more blanks.
    width
        Number of columns.
    blocks
        Columns by specimen.
    """

    row: int
    first: int
    delimiter: str
    width: int
    blocks: tuple[Block, ...]


def is_clock(cell: str) -> bool:
    """Return whether a cell states a time as hours, minutes and seconds."""
    return CLOCK.fullmatch(cell.strip()) is not None


def find_heading(path: Path, lines: Sequence[str]) -> Heading | None:
    """Return the first heading with force and displacement, or else with force and time.

    Parameters
    ----------
    path
        File, named in errors.
    lines
        Lines of the file; those that begin as comments do are passed over.

    Raises
    ------
    SpecificationError
        If two columns could equally well be the same quantity, or a unit is missing.
    """
    second_best = None
    for row, line in enumerate(lines):
        if line.lstrip().startswith(COMMENTS) or NUMBERS.fullmatch(line):
            continue
        for delimiter in DELIMITERS:
            heading = _heading(path, lines, row, delimiter)
            if heading and "displacement_mm" in heading.blocks[0].columns:
                return heading
            second_best = second_best or heading
    return second_best


def _heading(path: Path, lines: Sequence[str], row: int, delimiter: str) -> Heading | None:
    cells = split_line(lines[row], delimiter)
    if sum(map(bool, map(quantities_of, map(_bare, cells)))) < 2:
        return None
    next_row = next((n for n in range(row + 1, len(lines)) if lines[n].strip(' \t",;')), row)
    below = split_line(lines[next_row], delimiter) if next_row > row else []
    if delimiter == BLANKS and below:
        below = lines[next_row].split()
    below = [cell.strip().strip("()[]\uff08\uff09 ") for cell in below]
    below += [""] * (len(cells) - len(below))
    units = column_units(cells, below)
    blocks = []
    for number, (start, stop) in enumerate(_blocks(cells), start=1):
        place = f"{path.name}, row {row + 1}"
        names, own = cells[start:stop], units[start:stop]
        columns = assign_columns(place, names, own)
        if not columns:
            return None
        for name, index in columns.items():
            if not own[index] and name != "time_s":
                where = f"{path.name}, row {next_row + 1}, unit of {names[index].strip()}"
                allowed = (
                    "must be a unit such as (mm), (N) or (s), below the column's name or beside it"
                )
                raise SpecificationError(where, below[start + index], allowed)
        label = _label(lines, row, delimiter, start) or str(number)
        own_units = {name: own[index] for name, index in columns.items()}
        blocks.append(Block(label, start, names, columns, own_units))
    first = next_row + 1 if _are_units(below) else row + 1
    return Heading(row, first, delimiter, len(cells), tuple(blocks))


def _bare(cell: str) -> str:
    return split_unit(cell)[0]


def _blocks(cells: Sequence[str]) -> Iterator[tuple[int, int]]:
    """Yield first and last index, exclusive, of columns whose names repeat; all if none do."""
    names = [plain(cell) for cell in cells]
    named = next((n for n in range(len(names), 0, -1) if names[n - 1]), 0)
    for size in range(2, named // 2 + 1):
        if named % size == 0 and names[:named] == names[:size] * (named // size):
            yield from ((start, start + size) for start in range(0, named, size))
            return
    yield 0, len(names)


def _label(lines: Sequence[str], row: int, delimiter: str, start: int) -> str:
    """Return what stands above the first column of a block."""
    above = split_line(lines[row - 1], delimiter) if row else []
    return above[start].strip() if start < len(above) else ""


def _are_units(cells: Sequence[str]) -> bool:
    """Return whether a line has units and no values."""
    values = [math.isfinite(parse_number(c.replace(",", "."))) or is_clock(c) for c in cells]
    known = [*(unit for table in UNITS.values() for unit in table), *OTHER_UNITS]
    return not any(values) and any(known_unit(cell) in known for cell in cells)


def column_units(names: Sequence[str], below: Sequence[str]) -> list[str]:
    """Return the units of columns, or "" where none is stated.

    Parameters
    ----------
    names
        Names of the columns, which may end with the unit.
    below
        Cells of the next line, which may be units.
    """
    units = []
    below = below if _are_units(below) else ()
    for name, cell in itertools.zip_longest(names, below[: len(names)], fillvalue=""):
        bare, unit = split_unit(name)
        unit = unit or known_unit(cell)
        for quantity in quantities_of(bare):
            unit = unit or last_unit(bare, quantity.rpartition("_")[2])
        units.append(unit)
    return units

"""Plain text of a testing machine: columns of numbers, and comments."""

from __future__ import annotations

import functools
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from ramiefenics.measured.raw import RawCurve, read_numbers
from ramiefenics.measured.readers.base import OtherFormat, Reader
from ramiefenics.measured.readers.heading_line import column_units
from ramiefenics.measured.readers.naming import assign_columns, is_quantity
from ramiefenics.measured.readers.words import COMMENTS
from ramiefenics.measured.tables import Row, make_table, parse_number, read_lines, unit_factor
from ramiefenics.specification import SpecificationError
from ramiefenics.specification.checks import check_number

QUANTITIES = {"displacement": "mm", "force": "N", "time": "s"}
"""Quantities that a column may hold, with the units that are used internally."""

SKIPPED = "-"

SEPARATORS = (r"\s*;\s*", r"\s*\t\s*", r"\s*,\s+", r"\s+", r",")
"""Patterns of what separates cells, tried in turn."""


@dataclass(frozen=True)
class TextColumns:
    """Meaning of the columns of a text file.

    Attributes
    ----------
    columns
        Columns in order: ``displacement``, ``force`` or ``time`` with a unit, such as
        ``displacement_mm`` or ``force_kN``; ``-`` for a column that is something else.
    speed_mm_per_min
        Speed of the crosshead; required if there is no displacement.
    rate_Hz
        Rows per second, from which the time is calculated if there is no column for it.
    """

    columns: tuple[str, ...] = ("displacement_mm", "force_N")
    speed_mm_per_min: float | None = None
    rate_Hz: float | None = None

    def __post_init__(self) -> None:
        """Check that force and displacement can be obtained."""
        for name in ("speed_mm_per_min", "rate_Hz"):
            if getattr(self, name) is not None:
                check_number(self, name, above=0.0)
        named = [column for column in self.columns if column != SKIPPED]
        for column in named:
            quantity, _, unit = column.partition("_")
            if quantity not in QUANTITIES:
                allowed = f"must be {', '.join(QUANTITIES)} with a unit, such as force_N, or -"
                raise SpecificationError("columns", column, allowed)
            unit_factor(f"unit of columns.{column}", unit, QUANTITIES[quantity])
        there = [column.partition("_")[0] for column in named]
        text = ",".join(self.columns)
        if len(set(there)) != len(there):
            raise SpecificationError("columns", text, "must not name a quantity twice")
        if "force" not in there:
            raise SpecificationError("columns", text, "must have a force, for instance force_N")
        timed = "time" in there or self.rate_Hz is not None
        if "displacement" not in there and not (timed and self.speed_mm_per_min is not None):
            allowed = "must have a displacement, or time (or a rate) and the crosshead's speed"
            raise SpecificationError("columns", text, allowed)


def read_columns(
    path: Path,
    columns: tuple[str, ...] | None = None,
    speed_mm_per_min: float | None = None,
    rate_Hz: float | None = None,
) -> RawCurve:
    """Read a text file of columns, whose possible meanings are those of `TextColumns`.

    Lines that begin with # % // or ' are comments, and so are lines without any number before the
    first row. If `columns` is not given, the last of these lines that names a force, and a
    displacement or a time, has the order of the columns; quantities without a unit there are in mm,
    N and s. Every row must have as many cells as there are columns.

    Raises
    ------
    SpecificationError
        On the first defect; the message names file, row and remedy.
    """
    rows, above = _rows(path)
    titles: Sequence[str] = ()
    units: Sequence[str] = ()
    stated = columns is not None
    if columns is None:
        titles, units, columns = _titled(path, above, len(rows[0].cells))
    layout = TextColumns(columns, speed_mm_per_min, rate_Hz)
    names = ["" if name == SKIPPED else name for name in layout.columns]
    table = read_numbers(path, make_table(path, names, rows), [*filter(None, names)])
    found, origin = pd.DataFrame(index=table.index), {}
    for place, column in ((names.index(name), name) for name in map(str, table)):
        quantity, _, unit = column.partition("_")
        inside = QUANTITIES[quantity]
        found[f"{quantity}_{inside}"] = unit_factor(column, unit, inside) * table[column]
        title = repr(titles[place]) if titles else place + 1
        assumed = "" if stated or (titles and units[place]) else ", assumed"
        origin[quantity] = f"column {title} ({unit}{assumed})"
    if "time_s" not in found and layout.rate_Hz is not None:
        found["time_s"] = np.arange(len(table)) / layout.rate_Hz
    if "displacement_mm" not in found:
        assert layout.speed_mm_per_min is not None
        found["displacement_mm"] = layout.speed_mm_per_min / 60.0 * found["time_s"]
        origin["displacement"] = f"{layout.speed_mm_per_min:g} mm/min times the time"
    order = [name for name in ("time_s", "displacement_mm", "force_N") if name in found]
    return RawCurve(path, found[order], origin=origin)


def _rows(path: Path) -> tuple[list[Row], list[str]]:
    """Return the rows of numbers, and the lines above the first of them."""
    rows: list[Row] = []
    above: list[str] = []
    split: Callable[[str], list[str]] | None = None
    for number, line in enumerate(read_lines(path), start=1):
        text = line.strip()
        if split is None and (text.startswith(COMMENTS) or not _any_number(text)):
            above.append(text)
        elif text and not text.startswith(COMMENTS):
            split = split or _splitter(text)
            rows.append(Row(number, split(text)))
    if not rows:
        raise OtherFormat(path.name, None, "has no row of numbers")
    return rows, above


def _titled(
    path: Path, above: Sequence[str], width: int
) -> tuple[Sequence[str], Sequence[str], tuple[str, ...]]:
    """Return titles, units and meanings of columns, by the last line above them that has titles."""
    plain = [line.lstrip("#%/' ") for line in above]
    for number, line in reversed([*enumerate(plain, start=1)]):
        for pattern in (*SEPARATORS, r"\s{2,}"):
            titles = re.split(pattern, line)
            if len(titles) != width:
                continue
            where = f"{path.name}, row {number}"
            units = column_units(titles, re.split(pattern, "".join(plain[number : number + 1])))
            places = assign_columns(where, titles, units)
            columns = [SKIPPED] * width
            for name, place in places.items():
                quantity, inside = name.split("_")
                columns[place] = f"{quantity}_{units[place] or inside}"
            if places:
                return titles, units, tuple(columns)
            if line == above[number - 1] and any(map(is_quantity, titles)):
                allowed = "must name a force and a displacement; state with --columns what they are"
                raise SpecificationError(f"{where}, columns", ", ".join(titles), allowed)
    return (), (), TextColumns.columns


def _any_number(text: str) -> bool:
    cells = re.split(r"[;,\s]+", text)
    return any(np.isfinite(parse_number(cell)) for cell in cells)


def _splitter(text: str) -> Callable[[str], list[str]]:
    """Return a function that splits rows as the first one requires.

    A comma between digits may be a decimal one, and separates cells only if nothing else does.
    """
    for pattern in SEPARATORS:
        if re.search(pattern, text):
            return functools.partial(re.split, pattern)
    return lambda row: [row]


COLUMNS = Reader("columns", "Plain text: numbers in columns, and comments.", read_columns)

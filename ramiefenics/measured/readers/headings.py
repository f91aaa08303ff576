"""Raw data with a line of headings: text exports of most machines, and Excel workbooks.

Instron's Bluehill, ZwickRoell's testXpert, MTS TestSuite, Shimadzu's Trapezium and others write a
header of keys and values, the names of the columns, their units (beside the names, in them or
below), and rows. Cells are separated by commas, semicolons, tabs or several blanks, quoted or not,
and have a decimal point or comma:

    Specimen properties : Diameter,"14,0",mm

    Time,Extension,Load
    (s),(mm),(N)
    "0,1","0,02","1,5"

Several specimens may be in sheets of their own, or side by side.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import replace
from io import BytesIO
from pathlib import Path
from zipfile import BadZipFile, ZipFile

import pandas as pd

from ramiefenics.measured.raw import RawCurve, read_numbers
from ramiefenics.measured.readers.base import OtherFormat, Reader
from ramiefenics.measured.readers.header import BLANKS, SPEED, read_header, stated
from ramiefenics.measured.readers.heading_line import Block, Heading, find_heading, is_clock
from ramiefenics.measured.readers.naming import split_unit
from ramiefenics.measured.readers.words import COLUMN_NAMES
from ramiefenics.measured.tables import Row, make_table, read_lines, split_cells, unit_factor
from ramiefenics.specification import SpecificationError
from ramiefenics.specification.reading import LARGEST_BYTES, read_bytes

WORKBOOKS = (".xlsx", ".xlsm")

OLD_WORKBOOK = b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1"
"""First bytes of workbooks of Excel before 2007."""


NEEDED = (
    f"must have a line that names a displacement ({', '.join(COLUMN_NAMES['displacement_mm'][:3])},"
    f" ...) and a force ({', '.join(COLUMN_NAMES['force_N'][:2])}, ...)"
)


def read_headings(path: Path, speed_mm_per_min: float | None = None) -> list[RawCurve]:
    """Read a raw file with headings.

    Parameters
    ----------
    path
        The file.
    speed_mm_per_min
        Speed of the crosshead, from which the displacement is calculated if no column has it; by
        default that in the file's header.

    Raises
    ------
    SpecificationError
        On the first defect; the message names file, row and remedy.
    """
    curves = []
    sheets, others = _found(path)
    shared = read_header(others, "\t")
    for label, lines, heading in sheets:
        header = shared | read_header(lines[: heading.row], heading.delimiter)
        speeds = {*stated(header, SPEED).values()}
        speed = speed_mm_per_min or (speeds.pop() if len(speeds) == 1 else None)
        for block, rows in zip(heading.blocks, _rows(path, lines, heading), strict=True):
            try:
                curve = _curve(path, heading, block, rows, speed)
            except SpecificationError as error:
                raise error if len(sheets) == 1 else error.inside(f"sheet {label}") from error
            names = [label] if len(sheets) > 1 else []
            names += [block.label] if len(heading.blocks) > 1 else []
            curves.append(replace(curve, header=header, specimen=" ".join(names)))
    return curves


def _found(path: Path) -> tuple[list[tuple[str, list[str], Heading]], list[str]]:
    """Return name, lines and headings of sheets that have these, and the lines of the others."""
    content = read_bytes(path)
    if content.startswith(OLD_WORKBOOK):
        allowed = "must be saved as .xlsx or CSV, as the older format of Excel cannot be read"
        raise SpecificationError("file", str(path), allowed)
    if path.suffix.lower() in WORKBOOKS:
        versions = _sheets(path, content)
    else:
        versions = {"": read_lines(path)}
        # Chinese text can pass for a Western encoding
        if find_heading(path, versions[""]) is None and _is_text(content, "gb18030"):
            versions = {"": read_lines(path, ("gb18030",))}
    found, others = [], []
    for label, lines in versions.items():
        if heading := find_heading(path, lines):
            found.append((label, lines, heading))
        else:
            others += lines
    if found:
        return found, others
    remedy = "rename the columns accordingly, or state with --columns what they are"
    raise OtherFormat(path.name, None, f"{NEEDED}; {remedy}")


def _is_text(content: bytes, encoding: str) -> bool:
    try:
        content.decode(encoding)
    except UnicodeDecodeError:
        return False
    return True


def _sheets(path: Path, content: bytes) -> dict[str, list[str]]:
    """Return the sheets of a workbook as lines, with tabs between cells."""
    try:
        with ZipFile(BytesIO(content)) as parts:
            size = sum(part.file_size for part in parts.infolist())
        if size > LARGEST_BYTES:
            raise ValueError(f"unpacked, it would have {size / 1e6:.0f} MB")
        sheets = pd.read_excel(BytesIO(content), sheet_name=None, header=None, dtype=object)
    except (OSError, ValueError, KeyError, BadZipFile, SyntaxError) as error:
        raise SpecificationError("file", str(path), f"cannot be read ({error})") from error
    return {
        str(name): ["\t".join(_text(cell) for cell in row) for row in sheet.itertuples(index=False)]
        for name, sheet in sheets.items()
    }


def _text(cell: object) -> str:
    return "" if cell is None or cell != cell else re.sub(r"\s+", " ", str(cell))


def _rows(path: Path, lines: Sequence[str], heading: Heading) -> Iterator[list[Row]]:
    """Yield the rows of each block of columns, without those in which it has no cells."""
    rows: list[Row] = []
    for number, line in enumerate(lines[heading.first :], start=heading.first + 1):
        if not line.strip(' \t",;'):
            continue
        if heading.delimiter == BLANKS:
            cells = line.split()
        else:
            cells = [*split_cells(path, number, line, heading.delimiter).cells]
        while len(cells) > heading.width and not cells[-1]:
            cells.pop()
        rows.append(Row(number, cells))
    if len(heading.blocks) == 1:
        yield rows
        return
    for block in heading.blocks:
        stop = block.start + len(block.names)
        own = [Row(row.number, row.cells[block.start : stop]) for row in rows]
        yield [row for row in own if any(row.cells)]


def _curve(
    path: Path, heading: Heading, block: Block, rows: list[Row], speed: float | None
) -> RawCurve:
    """Return the curve of a block of columns, in mm, N and s."""
    if not rows:
        raise SpecificationError(path.name, None, f"has no rows of data below row {heading.first}")
    columns, units, notes = dict(block.columns), dict(block.units), []
    if "displacement_mm" not in columns and speed is None:
        only = f"row {heading.row + 1} names a force and a time only"
        remedy = "state the speed of the crosshead with --speed, in mm/min"
        raise SpecificationError(path.name, None, f"{NEEDED}; {only}: {remedy}")
    named = {place: name for name, place in columns.items()}
    table = make_table(path, [named.get(place, "") for place in range(len(block.names))], rows)
    if "time_s" in units and not units["time_s"]:
        if all(map(is_clock, table["time_s"])):
            table["time_s"] = [f"{_seconds(cell):.9g}" for cell in table["time_s"]]
            units["time_s"] = "s"
        elif "displacement_mm" in columns:
            notes.append(f"{path.name}: the time is left out, as its unit is not stated")
            del columns["time_s"]
    curve, origin = read_numbers(path, table, list(columns)), {}
    for name, place in columns.items():
        title, quantity, inside = block.names[place].strip(), *name.split("_")
        where = f"{path.name}, row {heading.first}, unit of {title}"
        curve[name] *= unit_factor(where, units[name], inside)
        origin[quantity] = f"column {split_unit(title)[0]!r} ({units[name]})"
    if "displacement_mm" not in columns and speed is not None:
        curve["displacement_mm"] = speed / 60.0 * curve["time_s"]
        origin["displacement"] = f"{speed:g} mm/min times the time"
    return RawCurve(path, curve, notes=tuple(notes), origin=origin)


def _seconds(clock: str) -> float:
    hours, minutes, seconds = clock.replace(",", ".").split(":")
    return 3600.0 * int(hours) + 60.0 * int(minutes) + float(seconds)


HEADINGS = Reader(
    "headings",
    "Text or Excel with headings, in English, German, French, Spanish or Chinese: Instron, "
    "ZwickRoell, MTS, Shimadzu and others.",
    read_headings,
)

"""Raw files of testing machines, in any format."""

from __future__ import annotations

import logging
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
import pandas as pd

from ramiefenics.measured.records import (
    BACK,
    check_columns,
    check_progress,
    check_steps,
    same_record,
)
from ramiefenics.measured.tables import numbers
from ramiefenics.specification import SpecificationError

log = logging.getLogger(__name__)

REMEDY = "correct it or remove the row, and export one specimen per file"


@dataclass(frozen=True)
class RawCurve:
    """Contents of one raw file.

    Attributes
    ----------
    path
        The file.
    curve
        ``displacement_mm``, ``force_N`` (compression positive), and ``time_s`` if known.
    header
        Other values in the file, by name; names include the unit.
    notes
        Changes that were made to the data, in sentences.
    origin
        Where the file has force, displacement and time, in words, by quantity.
    specimen
        Name of the specimen within the file; empty if the file has only one.
    """

    path: Path
    curve: pd.DataFrame
    header: Mapping[str, str] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    origin: Mapping[str, str] = field(default_factory=dict)
    specimen: str = ""


def read_numbers(path: Path, table: pd.DataFrame, names: Sequence[str]) -> pd.DataFrame:
    """Return columns of a table of text as finite numbers.

    If some of their cells have a comma and none has a point, the comma is a decimal one. Of comma
    and point, the first is left out as a separator of thousands if the other always follows it.

    Parameters
    ----------
    path
        File, named in errors.
    table
        Table of text, see `make_table`.
    names
        Names of the columns.

    Raises
    ------
    SpecificationError
        If a cell is not a number; the message names file, row and column of the first.
    """
    wanted = table[list(names)]
    cells = wanted.to_numpy().ravel()
    for thousands, decimal in (".,", ",."):
        grouped = [cell for cell in cells if thousands in cell]
        form = rf"[+-]?\d{{1,3}}(\{thousands}\d{{3}})+\{decimal}\d+"
        if any(decimal in cell for cell in cells) and all(re.fullmatch(form, c) for c in grouped):
            wanted = wanted.map(lambda c, t=thousands, d=decimal: c.replace(t, "").replace(d, "."))
            break
    found = {name: numbers(path, wanted, name, REMEDY) for name in names}
    return pd.DataFrame(found, wanted.index)


def tidy(raw: RawCurve) -> RawCurve:
    """Make compression positive, and cut off the unloading.

    Parameters
    ----------
    raw
        Curve as recorded, indexed by the numbers of the rows in the file.

    Raises
    ------
    SpecificationError
        If it is not a record of a bending test, see the checks in `ramiefenics.measured.records`.
    """
    path, curve, notes = raw.path, raw.curve, [*raw.notes]
    check_columns(path, curve)
    for name in ("force_N", "displacement_mm"):
        values = curve[name].to_numpy()
        # median of several rows: the load cell may not be zeroed, and one row may be an outlier
        from_start = values - np.median(values[:5])
        if -from_start.min() > from_start.max():
            if name == "displacement_mm":  # a position, whose origin is arbitrary once turned
                values = values - values[0]
            curve = curve.assign(**{name: -values})
            notes.append(f"{path.name}: sign of {name} reversed, compression counts as positive")
    check_steps(path, curve)  # else an outlier would pass for the end, and the rest for unloading
    travel = curve["displacement_mm"].to_numpy()
    end = int(travel.argmax())
    if travel[end] - travel[end:].min() > BACK * np.ptp(travel):
        left_out = len(travel) - 1 - end
        notes.append(f"{path.name}: the last {left_out} rows, those of the unloading, left out")
        curve = curve.iloc[: end + 1]
    check_progress(path, curve)
    return replace(raw, curve=curve.reset_index(drop=True), notes=tuple(notes))


def read_all(
    paths: Sequence[str | Path], read: Callable[[Path], Sequence[RawCurve]]
) -> dict[str, RawCurve]:
    """Read raw files with one reader, each curve under a unique name.

    Returns
    -------
    dict
        Curves by the name of the file without its suffix. Where two files have the same name, that
        of the folder is put in front; where a file has several specimens, theirs are appended.

    Raises
    ------
    SpecificationError
        If there is no file, if folder and name occur twice, or if two files have the same content.
    """
    files = [Path(path) for path in paths]
    if not files:
        raise SpecificationError("raw", None, "must name at least one file")
    stems = [file.stem for file in files]
    named: dict[str, RawCurve] = {}
    for file, stem in zip(files, stems, strict=True):
        parent = file.resolve().parent.name
        of_file = stem if stems.count(stem) == 1 else f"{parent}_{stem}"
        for raw in read(file):
            name = re.sub(r"[\W_]+", "_", raw.specimen).strip("_")
            name = f"{of_file}_{name}" if name else of_file
            if name in named:
                allowed = "must not have the same name and folder name as another; rename one"
                raise SpecificationError("raw", str(file), allowed)
            named[name] = raw
            log.info("%s: %d rows", name, len(raw.curve))
    if twins := same_record([raw.curve for raw in named.values()]):
        first, second = ([*named.values()][index] for index in twins)
        allowed = f"must not be a copy of {_place(first)}; leave one of them out"
        raise SpecificationError("raw", _place(second), allowed)
    return named


def _place(raw: RawCurve) -> str:
    return f"{raw.path}, {raw.specimen}" if raw.specimen else str(raw.path)

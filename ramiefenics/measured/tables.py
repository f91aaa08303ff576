"""CSV files of measured numbers: reading, checking, units."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import pandas as pd

from ramiefenics.specification import SpecificationError

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


def read_table(path: Path) -> pd.DataFrame:
    """Read a CSV file with a header, all cells as text.

    Raises
    ------
    SpecificationError
        If it cannot be read, or has no rows.
    """
    try:
        table = pd.read_csv(path, dtype=str, keep_default_na=False, skipinitialspace=True)
    except OSError as error:
        raise SpecificationError("file", str(path), f"cannot be read ({error.strerror})") from error
    except (ValueError, UnicodeDecodeError) as error:
        raise SpecificationError("file", str(path), f"is not a CSV file ({error})") from error
    if table.empty:
        raise SpecificationError("file", str(path), "must have a header and at least one row")
    table.columns = [str(name).strip() for name in table.columns]
    return table


def need_columns(path: Path, table: pd.DataFrame, names: Sequence[str]) -> None:
    """Check that a table has columns.

    Raises
    ------
    SpecificationError
        Naming the first that is missing, and those that are there.
    """
    for name in names:
        if name not in table.columns:
            there = ", ".join(table.columns)
            raise SpecificationError(
                path.name,
                name,
                f"is not among its columns ({there}); name the right one in dataset.toml",
            )


def numbers(path: Path, table: pd.DataFrame, name: str) -> list[float]:
    """Return a column as finite numbers.

    Raises
    ------
    SpecificationError
        Naming file, row (the header is row 1) and column of the first cell that is none.
    """
    values = []
    for row, text in enumerate(table[name], start=2):
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        if not math.isfinite(value):
            raise SpecificationError(
                f"{path.name}, row {row}, column {name}",
                text,
                "must be a number with a decimal point; correct it or remove the row",
            )
        values.append(value)
    return values

"""Measured curves that are drawn beside a simulated one."""

from __future__ import annotations

import io
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Protocol

import pandas as pd

from ramiefenics.specification import SpecificationError
from ramiefenics.specification.reading import read_bytes

COLUMNS = ("displacement_mm", "force_N")


class HasCurve(Protocol):
    """What has one measured curve, such as `RawCurve`."""

    @property
    def curve(self) -> pd.DataFrame:
        """Table with `COLUMNS`."""


class HasCurves(Protocol):
    """What has measured curves by name, such as `Dataset`."""

    @property
    def curves(self) -> Mapping[str, pd.DataFrame]:
        """Tables with `COLUMNS`."""


One = pd.DataFrame | str | Path | HasCurve
"""One measured curve."""

Measured = One | HasCurves | Mapping[str, One]
"""One or more measured curves."""


def measured_curves(given: Measured) -> dict[str, pd.DataFrame]:
    """Return measured curves by name.

    Parameters
    ----------
    given
        A table with `COLUMNS`, its CSV file, a `RawCurve`, several of these by name, or a
        `Dataset`.

    Raises
    ------
    SpecificationError
        If it is something else, or if a table has not these columns.
    """
    several = given if isinstance(given, pd.DataFrame) else getattr(given, "curves", given)
    if isinstance(several, Mapping):
        return {str(name): _table(one) for name, one in several.items()}
    name = Path(given).stem if isinstance(given, (str, Path)) else "measured"
    return {name: _table(given)}


def _table(given: Any) -> pd.DataFrame:
    """Return one measured curve as a table."""
    table, what = given, f"<{type(given).__name__}>"
    if isinstance(given, (str, Path)):
        table, what = _read(Path(given)), str(given)
    elif not isinstance(given, pd.DataFrame):
        table = getattr(given, "curve", given)
    if not isinstance(table, pd.DataFrame):
        allowed = (
            "must be a table with displacement_mm and force_N, its CSV file, what read_raw or "
            "read_dataset returns, or several tables by name"
        )
        raise SpecificationError("measured", what, allowed)
    for name in COLUMNS:
        if name not in table or not pd.api.types.is_numeric_dtype(table[name]):
            defect = "has other cells" if name in table else "is missing"
            allowed = "must have numbers in the columns displacement_mm and force_N"
            raise SpecificationError("measured", what, f"{allowed}; {name} {defect}")
    return table


def _read(path: Path) -> pd.DataFrame:
    """Read a CSV file."""
    if path.is_dir():
        allowed = "must be a CSV file; of a folder of measured data pass read_dataset(folder)"
        raise SpecificationError("measured", str(path), allowed)
    try:
        return pd.read_csv(io.BytesIO(read_bytes(path)))
    except ValueError as error:
        if isinstance(error, SpecificationError):
            raise
        raise SpecificationError("measured", str(path), f"must be a CSV file ({error})") from error

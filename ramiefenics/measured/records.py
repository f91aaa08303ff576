"""Checks of the records of bending tests, whatever files they come from."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pandas as pd

from ramiefenics.specification import SpecificationError

LEAST_ROWS = 20
"""Least number of rows of a curve that is worth comparing."""

MOST = {"force_N": 1e5, "displacement_mm": 1e4}
"""Largest plausible magnitude in each column.

Thick culms of bamboo break at some 10 kN, and no testing machine is 10 m high.
"""

LEAST_CHANGE = {"force_N": 1e-6, "displacement_mm": 1e-3}
"""Least change that counts as one; no machine that bends stalks resolves less."""

BACK = 0.01
"""Share of the range by which the displacement may go back, due to vibration and rounding."""

STEP = 0.1
"""Share of the range by which the displacement may advance between rows; more is a gap."""


def check_columns(path: Path, record: pd.DataFrame) -> None:
    """Check each column of a record, and that the force is not a copy of another column.

    Parameters
    ----------
    path
        File, named in errors.
    record
        ``displacement_mm``, ``force_N``, and ``time_s`` if known, indexed by the numbers of the
        rows in the file.

    Raises
    ------
    SpecificationError
        If there are too few rows, a value is beyond what stalks and machines can reach, force or
        displacement does not change, or the force is a copy of another column.
    """
    if len(record) < LEAST_ROWS:
        allowed = f"must be at least {LEAST_ROWS} for a curve"
        raise SpecificationError(f"{path.name}, number of rows", len(record), allowed)
    for name, most in MOST.items():
        values, unit = record[name], name.rpartition("_")[2]
        allowed = f"must be within ±{most:g} {unit}; check the column and its unit"
        _check_rows(path, values, values.abs() <= most, allowed)
        least = LEAST_CHANGE[name]
        if np.ptp(values) < least:
            allowed = f"must change by {least:g} {unit} or more; is it the right column?"
            raise SpecificationError(f"{path.name}, {name}", float(values.iloc[0]), allowed)
    for name in record.columns.difference(["force_N"]):
        if np.array_equal(record[name], record["force_N"]):
            allowed = f"must not be the same as {name} in every row; check the columns"
            raise SpecificationError(f"{path.name}, force_N", None, allowed)


def check_time(path: Path, record: pd.DataFrame) -> None:
    """Check that the time of a record, if there is one, never goes back.

    Raises
    ------
    SpecificationError
        If it goes back.
    """
    if "time_s" in record:
        time = record["time_s"]
        _check_rows(path, time, ~(time.diff() < 0.0), "must not go back; put the rows in order")


def check_progress(path: Path, record: pd.DataFrame) -> None:
    """Check that the displacement and the time of a record advance.

    Raises
    ------
    SpecificationError
        If either goes back, or the displacement has too few different values.
    """
    travel = record["displacement_mm"]
    number = travel.nunique()
    if number < LEAST_ROWS:
        allowed = f"must be at least {LEAST_ROWS} for a curve"
        raise SpecificationError(f"{path.name}, number of displacements", number, allowed)
    check_time(path, record)
    allowed = (
        f"must not go back by more than {100 * BACK:g} % of the range; cut the curve before "
        "unloading"
    )
    _check_rows(path, travel, travel.cummax() - travel <= BACK * np.ptp(travel), allowed)


def check_steps(path: Path, record: pd.DataFrame) -> None:
    """Check that the displacement of a record has no gaps.

    Raises
    ------
    SpecificationError
        If it advances too far from one row to the next.
    """
    travel = record["displacement_mm"]
    allowed = (
        f"must not exceed that of the previous row by more than {100 * STEP:g} % of the range, as "
        "nothing was measured in between; correct the row, or begin after it"
    )
    _check_rows(path, travel, ~(travel.diff() > STEP * np.ptp(travel)), allowed)


def _check_rows(path: Path, values: pd.Series[float], right: pd.Series[bool], allowed: str) -> None:
    for row, value in values[~right].items():
        raise SpecificationError(f"{path.name}, row {row}, {values.name}", value, allowed)


def same_record(records: Sequence[pd.DataFrame]) -> tuple[int, int] | None:
    """Return the indices of two records that are the same to the last digit, or None.

    No two stalks bend alike: one of the two files is a copy of the other.
    """
    seen: dict[bytes, int] = {}
    for index, record in enumerate(records):
        content = record[["displacement_mm", "force_N"]].to_numpy(dtype=np.float64).tobytes()
        if content in seen:
            return seen[content], index
        seen[content] = index
    return None

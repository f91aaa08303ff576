"""Files of measured curves: the loading and what follows it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd

from ramiefenics.measured.layout import Layout
from ramiefenics.measured.records import check_columns, check_progress, check_steps, check_time
from ramiefenics.measured.tables import need_columns, numbers, read_table
from ramiefenics.specification import SpecificationError

HELD = 1e-3
"""Share of the range within which a displacement counts as the largest; in a hold it drifts."""


def read_curve(path: Path, layout: Layout, follows: bool) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Read and check the file of a curve.

    Parameters
    ----------
    path
        The file.
    layout
        Names and units of the columns.
    follows
        Whether something follows the loading, which must then reach the largest displacement.

    Returns
    -------
    tuple
        The loading, by ascending ``displacement_mm``, and the rows after it, as recorded; both with
        ``force_N``, and ``time_s`` if known.

    Raises
    ------
    SpecificationError
        On the first defect; the message names file, row and remedy.
    """
    table = read_table(path)
    columns, units = layout.columns, layout.units
    need_columns(path, table, [columns.displacement, columns.force])
    wanted = {"displacement_mm": "displacement", "force_N": "force"}
    if columns.time in table.columns:
        wanted["time_s"] = "time"
    record = pd.DataFrame(
        {
            name: numbers(path, table, getattr(columns, what)) * units.factor(what)
            for name, what in wanted.items()
        },
        table.index,
    )
    check_columns(path, record)
    end = _end_of_loading(path, record) if follows else len(record)
    curve, after = record.iloc[:end], record.iloc[end:]
    check_progress(path, curve)
    check_steps(path, curve)
    least, largest = float(curve["force_N"].min()), float(curve["force_N"].max())
    if largest <= -least:
        allowed = (
            f"must be above 0 N, and larger in magnitude than the least force, {least:.6g} N: "
            "compression counts as positive; reverse the sign, or zero the load cell"
        )
        raise SpecificationError(f"{path.name}, largest force", largest, allowed)
    curve = curve.sort_values("displacement_mm", kind="stable", ignore_index=True)
    return curve, after.reset_index(drop=True)


def _end_of_loading(path: Path, record: pd.DataFrame) -> int:
    """Return the number of rows up to the largest displacement."""
    check_time(path, record)
    travel = record["displacement_mm"].to_numpy()
    end = 1 + int(np.argmax(travel >= travel.max() - HELD * np.ptp(travel)))
    if end == len(record):
        allowed = (
            "must be above 0, as protocol.then states what follows the loading, which must reach "
            "the largest displacement; correct protocol.then for this curve"
        )
        raise SpecificationError(
            f"{path.name}, number of rows after the largest displacement", 0, allowed
        )
    return end

"""Unloading of measured specimens, as separate curves."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd

from ramiefenics.measured.dataset import Dataset
from ramiefenics.measured.record import Record

FROM_TURN = 0.95
"""Share of the largest displacement up to which unloading is compared.

Beyond it, friction reverses within a travel that machines do not reproduce.
"""

LEAST_FORCE = 0.1
"""Share of the largest force down to which unloading is compared; then contact is lost."""

LEAST_RANGE = 0.1
"""Least range of unloading that is compared, as a share of the largest displacement."""

RELOADS = 0.01
"""Increase that counts as another loading, as a share of the largest displacement."""

SAME_TURN = 0.02
"""Largest relative difference between turning points that are replaced by a single one."""


def unloads(dataset: Dataset) -> bool:
    """Return whether the unloading of any specimen can be compared."""
    return any(_way_back(record) is not None for record in dataset.records)


def with_unloading(dataset: Dataset) -> Dataset:
    """Return a data set in which unloading after the first loading is a separate record.

    The test of this record has the whole path, that of the loading record only the loading. There
    is no such record where displacements were zeroed by the line through the straight part, which
    unloading does not have.
    """
    turns = _turns([_end_mm(r) for r in dataset.records if r.test.protocol.then])
    records: list[Record] = []
    for record in dataset.records:
        protocol = record.test.protocol
        if not protocol.then:
            records.append(record)
            continue
        usual = dataset.baseline.protocol.travel_mm  # the same, as specimens inform one another
        loading = replace(record.test, protocol=replace(protocol, travel_mm=usual, then=()))
        curve = _way_back(record)
        if curve is None:
            records.append(replace(record, test=loading))
            continue
        records.append(replace(record, test=loading, after=pd.DataFrame()))
        turn = min(turns, key=lambda at: abs(at - _end_mm(record)))
        records.append(
            replace(
                record,
                name=f"{record.name}, unloading",
                test=replace(record.test, protocol=replace(protocol, travel_mm=turn)),
                curve=curve,
                range_mm=(_lowest_mm(curve, record), FROM_TURN * _end_mm(record)),
                after=pd.DataFrame(),
            )
        )
    return replace(dataset, records=tuple(records))


def _end_mm(record: Record) -> float:
    return float(record.curve["displacement_mm"].iloc[-1])


def _turns(ends_mm: list[float]) -> list[float]:
    """Return turning points, one for all that hardly differ: the largest of them."""
    turns: list[float] = []
    for end in sorted(ends_mm, reverse=True):
        if not turns or end < (1.0 - SAME_TURN) * turns[-1]:
            turns.append(end)
    return turns


def _way_back(record: Record) -> pd.DataFrame | None:
    """Return the first unloading, by ascending displacement; None if it is not to be compared."""
    if record.after.empty or record.straight_mm is not None:
        return None
    at, end = record.after["displacement_mm"].to_numpy(), _end_mm(record)
    lowest = np.minimum.accumulate(at)
    again = np.flatnonzero(at - lowest > RELOADS * end)
    stop = int(again[0]) if len(again) else len(at)
    before = np.append(end, lowest[:-1])
    back = (at < before) & (np.arange(len(at)) < stop)
    curve = record.after[back].iloc[::-1].reset_index(drop=True)
    if len(curve) < 2 or curve["displacement_mm"].iloc[-1] < FROM_TURN * end:
        return None
    enough = _lowest_mm(curve, record) < (FROM_TURN - LEAST_RANGE) * end
    return curve if enough else None


def _lowest_mm(curve: pd.DataFrame, record: Record) -> float:
    """Return the displacement from which on the force is large enough to be compared."""
    small = curve["force_N"] < LEAST_FORCE * record.curve["force_N"].max()
    last = int(np.flatnonzero(small)[-1]) if small.any() else 0
    return float(curve["displacement_mm"].iloc[last])

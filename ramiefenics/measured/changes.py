"""Changes to the specification by the columns of a table."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from ramiefenics.measured.layout import listed
from ramiefenics.measured.tables import need_columns, numbers
from ramiefenics.specification import BendingTest, SpecificationError, override
from ramiefenics.specification.numerics import DOMAINS

PATH, TEXT = "protocol.then", "group"
"""The only keys whose columns do not hold numbers, but a list as in TOML or nothing, and text."""


def changes_by_row(
    path: Path, table: pd.DataFrame, keys: Mapping[str, Any], length: float
) -> list[list[str]]:
    """Return the changes that each row of a table makes, in the form that `override` takes.

    Parameters
    ----------
    path, table
        File and its contents, see `read_table`.
    keys
        Column with the values of each key of the specification; of several columns, the mean is
        taken.
    length
        Value of the table's unit of length in mm.

    Raises
    ------
    SpecificationError
        If there is no such column, a cell is not a number, or there are several columns for a key
        without numbers.
    """
    columns = {key: listed(value) for key, value in keys.items()}
    need_columns(path, table, [name for names in columns.values() for name in names])
    changes: list[list[str]] = [[] for _ in range(len(table))]
    for key, names in columns.items():
        if key in (PATH, TEXT) and len(names) > 1:
            allowed = "must be a single column, because only numbers have a mean"
            raise SpecificationError(f"dataset.toml, {key}", names, allowed)
        if key == PATH:
            values = [cell or "[]" for cell in table[names[0]]]
        elif key == TEXT:
            values = [json.dumps(cell) for cell in table[names[0]]]
        else:
            unit = length if key.endswith("_mm") else 1.0
            means = np.mean([numbers(path, table, name) for name in names], axis=0)
            values = [repr(unit * float(mean)) for mean in means]
        for row, value in zip(changes, values, strict=True):
            row.append(f"{key}={value}")
    return changes


def changed(test: BendingTest, changes: Iterable[str]) -> BendingTest:
    """Return the test with values changed, on a larger domain if they require one.

    Raises
    ------
    SpecificationError
        If a key is unknown or a value is refused.
    """
    whole = override(test, [*changes, "numerics.domain=full"])
    domain = max(test.numerics.domain, whole.least_domain[0], key=DOMAINS.index)
    return replace(whole, numerics=replace(whole.numerics, domain=domain))

"""Tables on top of each other, as text, and as Markdown."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import pandas as pd


def stack(parts: Mapping[Any, pd.DataFrame], label: str) -> pd.DataFrame:
    """Return tables on top of each other, the first column saying which is whose."""
    return pd.concat(parts, names=[label]).reset_index(level=0).reset_index(drop=True)


def cells(data: pd.DataFrame, digits: int = 4) -> list[list[str]]:
    """Return the rows of a table as text, numbers to so many digits; what is NaN is empty."""

    def cell(value: object) -> str:
        if isinstance(value, float):
            return "" if value != value else f"{value:.{digits}g}"  # NaN is not itself
        return "" if value is None else str(value)

    return [[cell(value) for value in row] for row in data.itertuples(index=False)]


def plain(data: pd.DataFrame) -> str:
    """Return a table in columns: texts to the left, numbers to the right."""
    rows = [list(map(str, data.columns)), *cells(data)]
    numeric = [pd.api.types.is_numeric_dtype(dtype) for dtype in data.dtypes]
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    lines = (
        "  ".join(
            text.rjust(width) if right else text.ljust(width)
            for text, width, right in zip(row, widths, numeric, strict=True)
        )
        for row in rows
    )
    return "\n".join(line.rstrip() for line in lines)


def markdown(data: pd.DataFrame) -> str:
    """Return a table in Markdown."""
    lines = ["| " + " | ".join(map(str, data.columns)) + " |", "|---" * len(data.columns) + "|"]
    lines += ["| " + " | ".join(row) + " |" for row in cells(data, 6)]
    return "\n".join(lines) + "\n"

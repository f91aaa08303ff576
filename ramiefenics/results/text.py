"""Conversion of tables: stacked, as text, for spreadsheets, and as Markdown."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import pandas as pd

from ramiefenics.specification.explained import ENDING, unit_of

FORMULA = ("=", "+", "-", "@", "\t", "\r")
"""First characters by which spreadsheets recognise a formula."""

SPELLINGS = {"Nmm": "N mm", "percent": "%", "cpu": "CPU", "anova": "ANOVA", "f": "F"}
"""Spellings of parts of names."""


def stack(parts: Mapping[Any, pd.DataFrame], label: str) -> pd.DataFrame:
    """Return tables stacked on top of each other; the first column names the table of each row."""
    return pd.concat(parts, names=[label]).reset_index(level=0).reset_index(drop=True)


def cells(data: pd.DataFrame, digits: int = 4) -> pd.DataFrame:
    """Return a table as text, with numbers to `digits` digits; NaN and None become empty."""

    def cell(value: object) -> str:
        if isinstance(value, float):
            return "" if value != value else f"{value + 0.0:.{digits}g}"  # NaN is not itself; no -0
        return "" if value is None else str(value)

    return data.astype(object).map(cell)


def words_of(name: str) -> str:
    """Return the name of a column or table as words, with its unit in brackets."""
    unit = SPELLINGS.get(unit_of(name), unit_of(name))
    words = (SPELLINGS.get(word, word) for word in ENDING.sub("", name).split("_"))
    return f"{' '.join(words)} ({unit})" if unit else " ".join(words)


def label_of(key: str) -> str:
    """Return the last part of a dotted key as words that begin a line, with its unit."""
    words = words_of(key.rpartition(".")[2])
    return f"{words[:1].upper()}{words[1:]}"


def unspoken(data: pd.DataFrame) -> pd.DataFrame:
    """Return a table for a file, without cells that a spreadsheet would run as a formula.

    Text that begins like a formula and is not a number gets an apostrophe in front, by which
    spreadsheets recognise text.
    """

    def plain(cell: object) -> object:
        if isinstance(cell, str) and cell[:1] in FORMULA and not _is_number(cell):
            return f"'{cell}"
        return cell

    texts = data.select_dtypes(exclude="number").columns
    return data.assign(**{name: data[name].map(plain) for name in texts}).rename(columns=plain)


def text_columns(data: pd.DataFrame) -> list[str]:
    """Return the columns in which there is text, by their names in the file of the table."""
    columns = unspoken(data).items()
    return [str(name) for name, column in columns if any(isinstance(cell, str) for cell in column)]


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def markdown(data: pd.DataFrame) -> str:
    """Return a table in Markdown, with numbers to six digits."""
    lines = ["| " + " | ".join(map(str, data.columns)) + " |", "|---" * len(data.columns) + "|"]
    lines += ["| " + " | ".join(row) + " |" for row in cells(data, 6).itertuples(index=False)]
    return "\n".join(lines) + "\n"

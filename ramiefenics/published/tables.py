"""Tables 1 to 8 of the published study, and the numbers in its text, as data frames."""

from __future__ import annotations

from importlib import resources

import pandas as pd

from ramiefenics.published.rounding import Printed
from ramiefenics.specification import SpecificationError

NUMBERS = range(1, 9)

LABELS = ("level", "source")
"""Columns that contain text."""


def published_table(number: int) -> pd.DataFrame:
    """Return a table of the study as printed, including its contradictions.

    Units are in the names of the columns; ratios, Poisson's ratios and friction coefficients have
    none. Tables 1, 3 and 7, which list parameters, become one row with a column for each parameter.
    "<0.0001" in Table 6 is read as 0.0001. ``ramiefenics/published/data/README.md`` lists where a
    table contradicts itself or the text.

    Parameters
    ----------
    number
        Number of the table, 1 to 8.

    Raises
    ------
    SpecificationError
        If there is no table of that number.
    """
    return _numbers(printed_table(number))


def published_text() -> pd.DataFrame:
    """Return the numbers in the study's text as one row, with units in the names of the columns."""
    return _numbers(_read("text.csv"))


def printed_table(number: int) -> pd.DataFrame:
    """Return a table of the study with all cells as the printed text; see `published_table`.

    Raises
    ------
    SpecificationError
        If there is no table of that number.
    """
    if number not in NUMBERS:
        raise SpecificationError("table", number, "must be a whole number from 1 to 8")
    return _read(f"table{number}.csv")


def printed_values() -> dict[str, Printed]:
    """Return the numbers of Tables 1, 3 and 7 and of the text as printed, by name."""
    frames = [*(printed_table(number) for number in (1, 3, 7)), _read("text.csv")]
    return {str(n): Printed.read(frame[n][0]) for frame in frames for n in frame}


def _read(name: str) -> pd.DataFrame:
    file = resources.files("ramiefenics.published") / "data" / name
    with file.open(encoding="utf-8") as stream:
        frame = pd.read_csv(stream, dtype=str, keep_default_na=False)
    if list(frame.columns) == ["name", "value", "label"]:  # a list of parameters
        return pd.DataFrame([dict(zip(frame["name"], frame["value"], strict=True))])
    return frame


def _numbers(frame: pd.DataFrame) -> pd.DataFrame:
    frame = frame.copy()
    for name in frame:
        if name not in LABELS:
            frame[name] = pd.to_numeric(frame[name].str.removeprefix("<"))
    return frame

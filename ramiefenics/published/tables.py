"""Tables 1 to 8 of the published study, and the numbers in its text, as data frames."""

from __future__ import annotations

from importlib import resources

import pandas as pd

from ramiefenics.published.rounding import Printed
from ramiefenics.specification import SpecificationError

NUMBERS = range(1, 9)

LABELS = ("level", "source")
"""Columns of text."""


def published_table(number: int) -> pd.DataFrame:
    """Return a table of the study as printed, contradictions included.

    Units are in the names of the columns; ratios, Poisson's ratios and friction coefficients
    have none. Tables 1, 3 and 7, which list parameters, become one row with a column for each.
    "<0.0001" in Table 6 is read as 0.0001. Where a table contradicts itself or the text is told
    in ``ramiefenics/published/data/README.md``.

    Parameters
    ----------
    number
        1 to 8.

    Raises
    ------
    SpecificationError
        If there is no table of that number.
    """
    return _numbers(printed_table(number))


def published_text() -> pd.DataFrame:
    """Return numbers that the study's text prints, in one row with units in the columns' names."""
    return _numbers(_read("text.csv"))


def printed_table(number: int) -> pd.DataFrame:
    """Return the same as `published_table`, all cells as the text that is printed.

    Raises
    ------
    SpecificationError
        If there is no table of that number.
    """
    if number not in NUMBERS:
        raise SpecificationError("table", number, "must be a whole number from 1 to 8")
    return _read(f"table{number}.csv")


def printed_values() -> dict[str, Printed]:
    """Return by name what Tables 1, 3 and 7 and the text print, with its last digit."""
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

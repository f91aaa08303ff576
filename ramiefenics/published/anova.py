"""Check a printed analysis of variance against itself."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import pandas as pd
from scipy import stats

from ramiefenics.published.rounding import Printed, recompute

RESIDUAL, LACK, PURE = "residual", "lack of fit", "pure error"


@dataclass(frozen=True)
class Row:
    """Source, sum of squares and degrees of freedom of a row, and the cells that follow."""

    source: str
    sum_of_squares: Printed
    df: int
    cells: dict[str, str]


def check_anova(table: pd.DataFrame) -> pd.DataFrame:
    """Recompute mean squares, F and p of an analysis of variance from its sums of squares.

    A mean square is the sum of squares over its degrees of freedom; F the mean square over the
    residual's, that of the lack of fit over the pure error's; p the upper tail of the F
    distribution (Fisher 1925; Myers, Montgomery & Anderson-Cook 2016, ch. 2). The printed p is
    also held against the printed F: where it follows from that one, the F was wrong before.

    Parameters
    ----------
    table
        Text cells, so that their last digits are known: ``source``, ``sum_of_squares``, ``df``,
        ``mean_square``, ``f_value``, ``p_value``; a unit may follow after an underscore. Needs a
        row named residual; others of note are lack of fit, pure error and total.

    Returns
    -------
    pandas.DataFrame
        One row per printed number: ``source``, ``quantity``, ``printed``, ``recomputed``,
        ``low``, ``high`` (its range over all that round to the printed inputs), ``holds``.
    """
    rows = {row.source.lower(): row for row in _rows(table)}
    found: list[dict[str, object]] = []
    for name, row in rows.items():
        error = rows[PURE if name == LACK else RESIDUAL]
        for quantity, cell in row.cells.items():
            source = {"source": row.source, "quantity": quantity, "printed": cell}
            found.append(source | _verdict(cell, *_recomputed(quantity, row, error)))
        if row.cells.keys() >= {"F", "p"}:
            followed = recompute(
                lambda f, row=row, error=error: float(stats.f.sf(f, row.df, error.df)),
                Printed.read(row.cells["F"]),
            )
            source = {"source": row.source, "quantity": "p of the printed F"}
            found.append(source | {"printed": row.cells["p"]} | _verdict(row.cells["p"], *followed))
    return pd.DataFrame([*found, *_sums(rows)])


def _rows(table: pd.DataFrame) -> Iterator[Row]:
    names = ("source", "sum_of_squares", "df", "mean_square", "f_value", "p_value")
    short = {column: next(n for n in names if str(column).startswith(n)) for column in table}
    for line in table.rename(columns=short).to_dict("records"):
        told = {"mean square": "mean_square", "F": "f_value", "p": "p_value"}
        cells = {quantity: line[name] for quantity, name in told.items()}
        yield Row(
            line["source"],
            Printed.read(line["sum_of_squares"]),
            int(line["df"]),
            {quantity: cell for quantity, cell in cells.items() if cell},
        )


def _recomputed(quantity: str, row: Row, error: Row) -> tuple[float, float, float]:
    if quantity == "mean square":
        return recompute(lambda squares: squares / row.df, row.sum_of_squares)

    def f_value(squares: float, errors: float) -> float:
        return (squares / row.df) / (errors / error.df)

    def p_value(squares: float, errors: float) -> float:
        return float(stats.f.sf(f_value(squares, errors), row.df, error.df))

    formula = f_value if quantity == "F" else p_value
    return recompute(formula, row.sum_of_squares, error.sum_of_squares)


def _sums(rows: dict[str, Row]) -> Iterator[dict[str, object]]:
    """Check that parts add up: of the residual, and of the total."""
    total = next((name for name in rows if name.endswith("total")), "")
    for whole, parts in ((RESIDUAL, (LACK, PURE)), (total, ("model", RESIDUAL))):
        if whole not in rows or not rows.keys() >= set(parts):
            continue
        said = {"source": rows[whole].source, "quantity": f"sum of {parts[0]} and {parts[1]}"}
        printed = str(rows[whole].sum_of_squares)
        added = recompute(lambda a, b: a + b, *(rows[part].sum_of_squares for part in parts))
        yield said | {"printed": printed} | _verdict(printed, *added)


def _verdict(cell: str, value: float, low: float, high: float) -> dict[str, object]:
    bound = Printed.read(cell.removeprefix("<"))
    holds = low <= bound.value if cell.startswith("<") else bound.agrees(low, high)
    return {"recomputed": value, "low": low, "high": high, "holds": holds}

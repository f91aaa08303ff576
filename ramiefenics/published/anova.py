"""Check the consistency of a printed analysis of variance."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import pandas as pd
from scipy import stats

from ramiefenics.published.rounding import Printed, recompute

RESIDUAL, LACK, PURE = "residual", "lack of fit", "pure error"


@dataclass(frozen=True)
class Row:
    """A row: source, sum of squares, degrees of freedom, and the printed cells that follow."""

    source: str
    sum_of_squares: Printed
    df: int
    cells: dict[str, str]


def check_anova(table: pd.DataFrame) -> pd.DataFrame:
    """Recompute mean squares, F and p of an analysis of variance from its sums of squares.

    A mean square is the sum of squares over its degrees of freedom. F is the mean square over that
    of the residual, or for the lack of fit over that of the pure error. p is the upper tail of the
    F distribution (Fisher 1925; Myers, Montgomery & Anderson-Cook 2016, ch. 2). The printed p is
    also compared with the printed F. If it follows from the latter, F was wrong before p was
    computed, and not misprinted afterwards.

    Parameters
    ----------
    table
        Cells as text, so that their last digits are known, in the columns ``source``,
        ``sum_of_squares``, ``df``, ``mean_square``, ``f_value`` and ``p_value``; a unit may follow
        after an underscore. There must be a row named residual. Rows named lack of fit, pure error,
        model and total are recognised.

    Returns
    -------
    pandas.DataFrame
        One row per check: ``source``, ``quantity``, ``printed``, ``recomputed``, ``low`` and
        ``high`` (its range over all inputs that round to the printed ones), ``holds``.
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
    """Check that the parts of the residual and those of the total add up."""
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

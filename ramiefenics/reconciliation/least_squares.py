"""Least squares and analysis of variance of polynomial models, for designs of any rank."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy import stats

from ramiefenics.calibration.terms import Term, model_matrix, term_name


@dataclass(frozen=True)
class Fit:
    """A model fitted to a design and its responses.

    Parameters
    ----------
    terms
        Terms of the model.
    rank
        Rank of the model matrix; less than the number of terms if the design cannot tell them
        apart.
    coefficients
        Coefficients by term; NaN if the design does not determine them.
    sums_of_squares, df
        Sums of squares and degrees of freedom, by term (type III: the increase of the residual sum
        of squares if the term is left out) and for ``model``, ``residual``, ``lack of fit``,
        ``pure error`` and ``total`` (corrected for the mean).
    """

    terms: tuple[Term, ...]
    rank: int
    coefficients: dict[Term, float]
    sums_of_squares: dict[Term | str, float]
    df: dict[Term | str, int]

    @property
    def r_squared(self) -> float:
        """Coefficient of determination."""
        total = self.sums_of_squares["total"]
        return self.sums_of_squares["model"] / total if total > 0.0 else float("nan")

    def anova(self, factors: Sequence[str]) -> pd.DataFrame:
        """Return the analysis of variance as a table.

        F compares the lack of fit with the pure error, and everything else with the residual.
        """
        rows = []
        for source, squares in self.sums_of_squares.items():
            df = self.df[source]
            row = {
                "source": source if isinstance(source, str) else term_name(source, factors),
                "sum_of_squares": squares,
                "df": df,
            }
            if source != "total" and df:
                row["mean_square"] = squares / df
            error = "pure error" if source == "lack of fit" else "residual"
            if source not in ("residual", "pure error", "total") and df and self.df[error]:
                noise = self.sums_of_squares[error] / self.df[error]
                row["f_value"] = squares / df / noise if noise > 0.0 else np.inf
                row["p_value"] = float(stats.f.sf(row["f_value"], df, self.df[error]))
            rows.append(row)
        return pd.DataFrame(rows)


def fit(
    points: NDArray[np.float64], responses: NDArray[np.float64], terms: tuple[Term, ...]
) -> Fit:
    """Fit a model by least squares, whatever the rank of the design.

    Lack of fit is the residual less the pure error, which is the scatter of repeated points (Myers,
    Montgomery & Anderson-Cook 2016, ch. 2).

    Parameters
    ----------
    points
        Coded factors, shape (runs, factors).
    responses
        Responses in any unit, shape (runs,).
    terms
        Terms of the model, including the intercept.
    """
    matrix = model_matrix(points, terms)
    inverse = np.linalg.pinv(matrix)
    open_to_design = np.abs(np.diag(inverse @ matrix) - 1.0) > 1e-9
    values = [float(v) for v in np.where(open_to_design, np.nan, inverse @ responses)]
    residual, rank = _left_over(matrix, responses)
    total = float(np.sum((responses - responses.mean()) ** 2))
    squares: dict[Term | str, float] = {"model": total - residual}
    df: dict[Term | str, int] = {"model": rank - 1}
    for number, term in enumerate(terms):
        if any(term):
            without, rank_without = _left_over(np.delete(matrix, number, axis=1), responses)
            df[term] = rank - rank_without
            squares[term] = without - residual if df[term] else 0.0
    _, group = np.unique(np.round(points, 9), axis=0, return_inverse=True)
    repeats = pd.Series(responses).groupby(np.ravel(group))
    pure = float(((repeats.transform("mean") - responses) ** 2).sum())
    runs = len(responses)
    squares |= {"residual": residual, "lack of fit": residual - pure, "pure error": pure}
    squares |= {"total": total}
    df |= {"residual": runs - rank, "lack of fit": repeats.ngroups - rank}
    df |= {"pure error": runs - repeats.ngroups, "total": runs - 1}
    return Fit(terms, rank, dict(zip(terms, values, strict=True)), squares, df)


def _left_over(matrix: NDArray[np.float64], responses: NDArray[np.float64]) -> tuple[float, int]:
    """Return the residual sum of squares and the rank."""
    solution, _, rank, _ = np.linalg.lstsq(matrix, responses, rcond=None)
    return float(np.sum((responses - matrix @ solution) ** 2)), int(rank)

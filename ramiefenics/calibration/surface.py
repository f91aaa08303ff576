"""Response surfaces: polynomials fitted to designed runs, with analysis of variance.

Least squares and the t and F statistics are computed by statsmodels. Each term is tested by its
partial sum of squares (type III), that is, by what it adds to all other terms, in coded units.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import pandas as pd
import statsmodels.api as sm
from scipy import stats

from ramiefenics.calibration.factors import Array
from ramiefenics.calibration.terms import Term, model_matrix, model_slopes, term_name
from ramiefenics.specification import SpecificationError

SAME = 9
"""Number of decimals of the coded values to which equal points agree."""

EQUAL = 1e-9
"""Fraction of the range of a response within which repeats count as equal.

Repeats of an experiment never agree so closely, those of a deterministic simulation do.
"""


ALONE = 1e-8
"""Value of one minus leverage below which a run alone determines some coefficient."""


@dataclass(frozen=True)
class Surface:
    """A polynomial that approximates a response.

    Attributes
    ----------
    response
        Name of the response.
    names
        Names of the factors.
    terms
        Terms of the polynomial, the constant first.
    points, values
        Runs to which it was fitted: coded points, shape (n, k), and responses, shape (n,). Repeats
        that gave equal values count once.
    merged
        Number of equal repeats that were left out.
    """

    response: str
    names: tuple[str, ...]
    terms: tuple[Term, ...]
    points: Array
    values: Array
    merged: int = 0

    @cached_property
    def fit(self) -> Any:
        """Result of the least-squares fit by statsmodels."""
        return sm.OLS(self.values, model_matrix(self.points, self.terms)).fit()

    @property
    def labels(self) -> list[str]:
        """Names of the terms."""
        return [term_name(term, self.names) for term in self.terms]

    @cached_property
    def _estimates(self) -> Array:
        """Coefficients in the order of the terms; cached because they are needed many times."""
        return np.asarray(self.fit.params)

    def predict(self, points: Array) -> Array:
        """Return the response at coded points of shape (n, k)."""
        return np.asarray(model_matrix(points, self.terms) @ self._estimates)

    def slopes(self, points: Array) -> Array:
        """Return the derivatives with respect to the coded factors, shape (n, k)."""
        return np.einsum("ntk,t->nk", model_slopes(points, self.terms), self._estimates)

    def standard_error(self, points: Array) -> Array:
        """Return the standard error of the mean response at coded points, shape (n,)."""
        rows = model_matrix(points, self.terms)
        return np.sqrt(np.einsum("ni,ij,nj->n", rows, self.fit.cov_params(), rows))

    @cached_property
    def _left_out(self) -> Array:
        """Errors in predicting each run from all others; NaN if these cannot predict it."""
        left = 1.0 - self.fit.get_influence().hat_matrix_diag
        return np.where(left > ALONE, self.fit.resid / np.maximum(left, ALONE), np.nan)

    @property
    def press(self) -> float:
        """Sum of squared errors of prediction, each run left out in turn (Allen 1974).

        A run that alone determines a coefficient cannot be predicted, and does not count.
        """
        return float(np.nansum(np.square(self._left_out)))

    @property
    def prediction_error(self) -> float:
        """Root mean square error in predicting a run left out: the error of the surface itself."""
        predicted = int(np.isfinite(self._left_out).sum())
        return math.sqrt(self.press / predicted) if predicted else math.inf

    @property
    def quality(self) -> dict[str, float]:
        """R2, adjusted R2, predicted R2, PRESS, residual standard deviation and AICc.

        Predicted R2 is ``1 - PRESS / total``.
        """
        predicted = np.isfinite(self._left_out)
        told = float(np.square(self.values[predicted] - self.values.mean()).sum())
        return {
            "R2": float(self.fit.rsquared),
            "R2_adjusted": float(self.fit.rsquared_adj),
            "R2_predicted": 1.0 - self.press / told if told > 0.0 else math.nan,
            "PRESS": self.press,
            "residual_deviation": math.sqrt(self.fit.mse_resid),
            "AICc": aicc(float(self.fit.ssr), len(self.values), len(self.terms)),
        }

    def coefficients(self) -> pd.DataFrame:
        """Return one row per term, in coded units: estimate, its error, t, p, 95 % interval."""
        low, high = self.fit.conf_int().T
        return pd.DataFrame(
            {
                "term": self.labels,
                "estimate": self.fit.params,
                "standard_error": self.fit.bse,
                "t": self.fit.tvalues,
                "p": self.fit.pvalues,
                "low": low,
                "high": high,
            }
        )

    def anova(self) -> pd.DataFrame:
        """Return the analysis of variance, with lack of fit tested against pure error.

        The columns are ``source``, ``sum_of_squares``, ``df``, ``mean_square``, ``F`` and ``p``.
        If no repeats differ there is no pure error, and F and p of the lack of fit are NaN.
        """
        fit, mean_square = self.fit, float(self.fit.mse_resid)
        parts = np.square(fit.tvalues[1:]) * mean_square  # sums of squares, one per coefficient
        within, within_df = self._pure_error()
        rows = [("model", float(fit.ess), int(fit.df_model), mean_square, int(fit.df_resid))]
        rows += [
            (name, float(part), 1, mean_square, int(fit.df_resid))
            for name, part in zip(self.labels[1:], parts, strict=True)
        ]
        rows.append(("residual", float(fit.ssr), int(fit.df_resid), math.nan, 0))
        lack_df = int(fit.df_resid) - within_df
        error = within / within_df if within_df else math.nan
        rows.append(("lack of fit", float(fit.ssr) - within, lack_df, error, within_df))
        rows.append(("pure error", within, within_df, math.nan, 0))
        rows.append(("total", float(fit.centered_tss), len(self.values) - 1, math.nan, 0))
        return pd.DataFrame([_anova_row(*row) for row in rows])

    def _pure_error(self) -> tuple[float, int]:
        """Return the sum of squares and the degrees of freedom within repeats."""
        groups = repeats(self.points)
        within = [float(np.square(v - v.mean()).sum()) for v in (self.values[g] for g in groups)]
        return sum(within), len(self.values) - len(groups)

    def diagnostics(self) -> pd.DataFrame:
        """Return one row per run: fitted, residual, leverage, studentised residual, Cook's D.

        Residuals are externally studentised, that is, divided by their standard deviation as
        estimated without the run (Belsley, Kuh and Welsch 1980, eq. 2.26). They are NaN for runs
        that alone determine a coefficient. Cook's distance is that of Cook (1977).
        """
        influence = self.fit.get_influence()
        residual, predicted = self.fit.resid, self._left_out
        left = 1.0 - influence.hat_matrix_diag
        with np.errstate(divide="ignore", invalid="ignore"):
            # residual variance without the run, from the leverage, so that no model is refitted
            rest = (float(self.fit.ssr) - residual * predicted) / (self.fit.df_resid - 1.0)
            studentised = residual / np.sqrt(rest * left)
        return pd.DataFrame(
            {
                "value": self.values,
                "fitted": self.fit.fittedvalues,
                "residual": self.fit.resid,
                "leverage": influence.hat_matrix_diag,
                "studentised": np.where(left > ALONE, studentised, np.nan),
                "cook": influence.cooks_distance[0],
            }
        )

    @property
    def normality_p(self) -> float:
        """Value of p in Shapiro and Wilk's (1965) test for normality of the residuals.

        It is NaN if the residuals are zero apart from rounding errors.
        """
        if np.ptp(self.fit.resid) <= EQUAL * max(np.ptp(self.values), 1e-300):
            return math.nan
        return float(stats.shapiro(self.fit.get_influence().resid_studentized_internal).pvalue)

    def notes(self) -> list[str]:
        """Return what a reader of the statistics should know, one sentence each."""
        told = []
        if self.merged:
            told.append(
                f"{self.merged} repeats gave the same number to all digits, as a deterministic "
                "simulation does: they count once, there is no pure error, and t, F and p compare "
                "terms with the lack of fit of the polynomial, not with noise."
            )
        elif not self._pure_error()[1]:
            told.append("No run is repeated: lack of fit cannot be told from pure error.")
        table = self.diagnostics()
        far = _fitted_runs(table["studentised"].abs() > 3.0)
        if far:
            told.append(f"Studentised residuals beyond 3 in {far}.")
        strong = _fitted_runs(table["cook"] > 1.0)
        if strong:
            told.append(f"Dominant in the fit (Cook's distance above 1): {strong}.")
        return told


def fit_surface(
    response: str,
    names: Sequence[str],
    terms: Sequence[Term],
    points: Array,
    values: Array,
) -> Surface:
    """Fit a polynomial to the runs that have a value.

    Parameters
    ----------
    response, names
        Name of the response, and names of the factors.
    terms
        Terms of the polynomial.
    points, values
        Coded points, shape (n, k), and responses, shape (n,); NaN where a run has none.

    Raises
    ------
    SpecificationError
        If the runs are too few, or cannot tell the terms apart.
    """
    known = np.isfinite(values)
    points, values = np.asarray(points)[known], np.asarray(values)[known]
    points, values, merged = _merge(points, values)
    if len(values) <= len(terms):
        allowed = (
            f"must be more than the {len(terms)} terms of the model; only distinct, completed "
            "runs count"
        )
        raise SpecificationError(f"runs with {response}", len(values), allowed)
    matrix = model_matrix(points, terms)
    if np.linalg.matrix_rank(matrix) < len(terms):
        raise SpecificationError(
            "model",
            f"{len(terms)} terms",
            "must be one whose terms the design can tell apart, such as 'linear'; some are aliases",
        )
    return Surface(response, tuple(names), tuple(terms), points, values, merged)


def repeats(points: Array) -> list[Array]:
    """Return the indices of equal points, one array per distinct point, in order."""
    groups: dict[tuple[float, ...], list[int]] = {}
    for index, row in enumerate(np.round(points, SAME) + 0.0):
        groups.setdefault(tuple(row), []).append(index)
    return [np.array(group) for group in groups.values()]


def aicc(residual_sum: float, number: int, coefficients: int) -> float:
    """Return Akaike's criterion corrected for small samples (Hurvich and Tsai 1989).

    Constants that are equal for all models of the same data are left out. The criterion is infinite
    if there are too few runs.
    """
    k = coefficients + 1  # the variance is a parameter too
    if number - k - 1 <= 0:
        return math.inf
    likelihood = number * math.log(max(residual_sum, 1e-300) / number)
    return likelihood + 2.0 * k + 2.0 * k * (k + 1) / (number - k - 1)


def _merge(points: Array, values: Array) -> tuple[Array, Array, int]:
    """Merge repeats if all of them gave equal values, as only a deterministic simulation does."""
    groups = repeats(points)
    if not len(values):
        return points, values, 0
    scale = max(float(np.ptp(values)), EQUAL * float(np.abs(values).max()))
    if any(np.ptp(values[group]) > EQUAL * scale for group in groups):
        return points, values, 0
    first = [group[0] for group in groups]
    return points[first], values[first], len(values) - len(first)


def _anova_row(source: str, total: float, df: int, error: float, error_df: int) -> dict[str, Any]:
    mean = total / df if df else math.nan
    ratio = mean / error if error > 0.0 else math.nan
    p = float(stats.f.sf(ratio, df, error_df)) if error_df and df else math.nan
    return {
        "source": source,
        "sum_of_squares": total,
        "df": df,
        "mean_square": mean,
        "F": ratio,
        "p": p,
    }


def _fitted_runs(which: pd.Series) -> str:
    """Return the numbers of the chosen runs, counted from 1, as text; empty if there are none."""
    numbers = [str(number + 1) for number in np.flatnonzero(which)]
    if not numbers:
        return ""
    return f"fitted {'run' if len(numbers) == 1 else 'runs'} {', '.join(numbers)}"

"""Whether groups differ, which ones, and by how much.

Independent values are compared by Welch's (1951) analysis of variance, which does not assume equal
variances, and pair by pair by Welch's t-test. Values from the same unit (a plant, a specimen tested
twice) are not independent. For these, a mixed model with a random effect of the unit is fitted
instead. If every unit belongs to one group, it is tested with as many degrees of freedom as there
are units less groups, which is conservative. If units occur in several groups, these are compared
within the units: the model is that of the means by unit and group, and the degrees of freedom are
those of an analysis of variance with repeated measures, for two groups those of the paired t-test.
The p-values of pairs are adjusted by Holm's (1979) method over the pairs of a
quantity. The effect size is Hedges' (1981) g: the difference over the standard deviation within
groups, corrected for small samples.
"""

from __future__ import annotations

import itertools
import math
import warnings
from collections.abc import Sequence

import numpy as np
import pandas as pd
from scipy.special import gammaln
from scipy.stats import f as fisher
from scipy.stats import t as student
from statsmodels.regression.mixed_linear_model import MixedLM
from statsmodels.stats.multitest import multipletests
from statsmodels.stats.oneway import anova_oneway

from ramiefenics.measured.noise import Array
from ramiefenics.reduction.groups import LEVEL, ordered

FEWEST = 2
"""Least number of units (of values, if these are independent) in a group that is compared."""


def differences(
    curves: pd.DataFrame,
    groups: Sequence[str],
    quantities: Sequence[str],
    units: Sequence[str] | None = None,
) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Compare groups.

    Parameters
    ----------
    curves
        Quantities, with one row per curve.
    groups
        Group of each row.
    quantities
        Names of the columns of `curves` to be compared.
    units
        Unit of each row, such as a plant, whose rows are not independent of each other; by default
        all rows are independent. A unit of the same name in two groups is one and the same.

    Returns
    -------
    tests
        One row per quantity: ``method``, ``F``, its degrees of freedom ``df`` and ``df_within``,
        ``p`` for the hypothesis that the means of all groups are equal, and ``eta_squared``, the
        share of the variance that lies between groups.
    pairs
        One row per quantity and pair: ``difference`` of the means (second less first) with its
        95 % interval from ``low`` to ``high``, ``p`` (adjusted by Holm's method) and Hedges' ``g``.
    """
    tests, pairs = [], []
    for name in quantities:
        table = pd.DataFrame({"value": curves[name].to_numpy(float), "group": list(groups)})
        table["unit"] = [str(k) for k in range(len(table))] if units is None else list(units)
        table = table[np.isfinite(table["value"])]
        counts = table.groupby("group")["unit"].nunique()
        used = [group for group in ordered(list(groups)) if counts.get(group, 0) >= FEWEST]
        table = table[table["group"].isin(used)]
        if len(used) < 2 or (table.groupby("group")["value"].std() == 0.0).any():
            continue
        test, found = _compared(table, used)
        tests.append({"quantity": name, **test, "eta_squared": _between(table)})
        adjusted = multipletests([pair["p"] for pair in found], method="holm")[1]
        for pair, p in zip(found, adjusted, strict=True):
            pairs.append({"quantity": name, **pair, "p": float(p)})
    return pd.DataFrame(tests), pd.DataFrame(pairs)


def _welch(table: pd.DataFrame, used: Sequence[str]) -> tuple[dict[str, object], list[dict]]:
    parts = {group: table["value"][table["group"] == group].to_numpy() for group in used}
    found = anova_oneway(list(parts.values()), use_var="unequal")
    test = {
        "method": "Welch",
        "F": float(found.statistic),
        "df": float(found.df_num),
        "df_within": float(found.df_denom),
        "p": float(found.pvalue),
    }
    pairs = []
    for (first, a), (second, b) in itertools.combinations(parts.items(), 2):
        errors = np.array([a.var(ddof=1) / len(a), b.var(ddof=1) / len(b)])
        freedom = errors.sum() ** 2 / (errors**2 / (len(a) - 1, len(b) - 1)).sum()
        pooled = ((len(a) - 1) * a.var(ddof=1) + (len(b) - 1) * b.var(ddof=1)) / (
            len(a) + len(b) - 2
        )
        sizes = (b.mean() - a.mean(), math.sqrt(errors.sum()), math.sqrt(pooled))
        pairs.append(_pair(first, second, *sizes, freedom, len(a) + len(b) - 2))
    return test, pairs


def few_units(groups: Sequence[str], units: Sequence[str]) -> list[str]:
    """Return the groups that are not compared, as they have too few units."""
    counts = pd.Series(list(units)).groupby(list(groups)).nunique()
    return [group for group in ordered(list(groups)) if counts[group] < FEWEST]


def in_several_groups(groups: Sequence[str], units: Sequence[str]) -> list[str]:
    """Return the units that occur in several groups."""
    counts = pd.Series(list(groups)).groupby(list(units), sort=False).nunique()
    return list(counts.index[counts > 1])


def _compared(table: pd.DataFrame, used: Sequence[str]) -> tuple[dict[str, object], list[dict]]:
    """Return the test of all groups and the comparison of pairs, by the method that fits."""
    if in_several_groups(list(table["group"]), list(table["unit"])):
        means = table.groupby(["group", "unit"])["value"].mean().reset_index()
        freedom = len(means) - len(used) - means["unit"].nunique() + 1
        return _mixed(means, used, max(freedom, 1), "mixed model, within units")
    if table.duplicated("unit").any():
        return _mixed(table, used, table["unit"].nunique() - len(used), "mixed model")
    return _welch(table, used)


def _mixed(
    table: pd.DataFrame, used: Sequence[str], freedom: int, method: str
) -> tuple[dict[str, object], list[dict]]:
    belongs = np.array([[group == name for name in used] for group in table["group"]], dtype=float)
    units = table["unit"].to_numpy()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # statsmodels warns if the random effect has no variance
        fit = MixedLM(table["value"].to_numpy(), belongs, groups=units).fit(reml=True)
    number = len(used)
    means, covariance = np.asarray(fit.fe_params), np.asarray(fit.cov_params())[:number, :number]
    contrasts = np.eye(number)[1:] - np.eye(number)[0]
    apart = contrasts @ means
    statistic = apart @ np.linalg.solve(contrasts @ covariance @ contrasts.T, apart) / (number - 1)
    test = {
        "method": method,
        "F": float(statistic),
        "df": float(number - 1),
        "df_within": float(freedom),
        "p": float(fisher.sf(statistic, number - 1, freedom)),
    }
    within = math.sqrt(float(fit.scale + np.asarray(fit.cov_re)[0, 0]))
    pairs = []
    for (i, first), (j, second) in itertools.combinations(enumerate(used), 2):
        variance = covariance[i, i] + covariance[j, j] - 2.0 * covariance[i, j]
        sizes = (means[j] - means[i], math.sqrt(variance), within)
        pairs.append(_pair(first, second, *sizes, freedom, freedom))
    return test, pairs


def _pair(
    first: str,
    second: str,
    difference: float,
    error: float,
    within: float,
    freedom: float,
    values: float,
) -> dict[str, object]:
    half = float(student.ppf((1.0 + LEVEL) / 2.0, freedom)) * error
    # Hedges (1981), Eq. 6e: corrects the bias of g for small samples
    exact = math.exp(gammaln(values / 2.0) - gammaln((values - 1.0) / 2.0)) / math.sqrt(values / 2)
    return {
        "first": first,
        "second": second,
        "difference": difference,
        "low": difference - half,
        "high": difference + half,
        "p": float(2.0 * student.sf(abs(difference) / error, freedom)),
        "g": exact * difference / within,
    }


def _between(table: pd.DataFrame) -> float:
    values: Array = table["value"].to_numpy()
    means = table.groupby("group")["value"].transform("mean").to_numpy()
    return float(((means - values.mean()) ** 2).sum() / ((values - values.mean()) ** 2).sum())

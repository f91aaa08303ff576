"""Means by group, with confidence intervals."""

from __future__ import annotations

import math
import warnings
from collections.abc import Sequence

import numpy as np
import pandas as pd
from scipy.stats import bootstrap, shapiro
from scipy.stats import t as student

from ramiefenics.measured.noise import Array

LEVEL = 0.95
RESAMPLES = 9999
NOT_NORMAL = 0.05
"""Value of p in the Shapiro-Wilk test below which the bootstrap interval is used."""

ENOUGH = 20
"""Least number of values for a bootstrap interval to have the stated coverage.

With five values, it covers only 85 to 90 %.
"""

COLUMNS = (
    "n",
    "mean",
    "sd",
    "low",
    "high",
    "interval",
    "student_low",
    "student_high",
    "bootstrap_low",
    "bootstrap_high",
    "normal_p",
)


def describe(values: Array, seed: int = 0) -> dict[str, object]:
    """Return the mean, the standard deviation and 95 % confidence intervals of the mean.

    Student's interval is valid for normal values. The other interval is that of the bias-corrected
    and accelerated bootstrap with 9999 resamples (Efron 1987). ``low`` and ``high`` are the ends of
    the interval named by ``interval``: the bootstrap's if there are 20 values or more and Shapiro
    and Wilk's (1965) test finds them not normal (p < 0.05), otherwise Student's, because the
    bootstrap's is too narrow for fewer values. Entries for which there are too few values are NaN.

    Parameters
    ----------
    values
        Values of one group; those that are not finite are left out.
    seed
        Seed of the resampling.
    """
    values = values[np.isfinite(values)]
    number = len(values)
    found: dict[str, object] = dict.fromkeys(COLUMNS, math.nan)
    found |= {"n": number, "interval": "none"}
    if number == 0:
        return found
    found["mean"] = mean = float(values.mean())
    if number == 1:
        return found
    found["sd"] = sd = float(values.std(ddof=1))
    half = float(student.ppf((1.0 + LEVEL) / 2.0, number - 1)) * sd / math.sqrt(number)
    found |= {"student_low": mean - half, "student_high": mean + half, "interval": "student"}
    if number >= 3 and sd > 0.0:
        found["normal_p"] = normal = float(shapiro(values).pvalue)
        low, high = _bootstrap(values, seed)
        found |= {"bootstrap_low": low, "bootstrap_high": high}
        many = number >= ENOUGH
        if many and normal < NOT_NORMAL and math.isfinite(low) and math.isfinite(high):
            found["interval"] = "bootstrap"
    found["low"], found["high"] = (found[f"{found['interval']}_{end}"] for end in ("low", "high"))
    return found


def _bootstrap(values: Array, seed: int) -> tuple[float, float]:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # a degenerate interval is NaN, which is warning enough
        result = bootstrap(
            (values,),
            np.mean,
            confidence_level=LEVEL,
            n_resamples=RESAMPLES,
            method="BCa",
            rng=np.random.default_rng(seed),
        )
    interval = result.confidence_interval
    return float(interval.low), float(interval.high)


def ordered(groups: Sequence[str]) -> list[str]:
    """Return every group once: in ascending order if all are numbers, otherwise as they occur."""
    names = list(dict.fromkeys(groups))
    try:
        return sorted(names, key=float)
    except ValueError:
        return names


def by_group(
    curves: pd.DataFrame, groups: Sequence[str], quantities: Sequence[str], seed: int = 0
) -> pd.DataFrame:
    """Return one row per group and quantity, with the columns of `describe`.

    Parameters
    ----------
    curves
        Quantities, with one row per curve.
    groups
        Group of each row.
    quantities
        Names of the columns of `curves` to be described.
    seed
        Seed of the resampling.
    """
    rows = []
    for group in ordered(groups):
        part = curves[np.asarray(groups) == group]
        for name in quantities:
            found = describe(part[name].to_numpy(dtype=float), seed)
            rows.append({"group": group, "quantity": name, **found})
    return pd.DataFrame(rows, columns=["group", "quantity", *COLUMNS])

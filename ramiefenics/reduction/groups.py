"""Means by group, and how far they can be trusted."""

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
"""Of the Shapiro-Wilk test: below this probability the bootstrap's interval is the one to use."""

ENOUGH = 20
"""Values with which a bootstrap interval covers what it says; of five it covers 85 to 90 %."""

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
    """Return mean, standard deviation and 95 % confidence intervals of the mean.

    Student's interval holds for normal values. The other is the bias-corrected and accelerated
    bootstrap of 9999 resamples (Efron 1987). ``low`` and ``high`` are the one that ``interval``
    names: the bootstrap's where Shapiro and Wilk's (1965) test finds 20 values or more not normal
    (p < 0.05), else Student's, as the bootstrap's is too narrow for fewer. What so few values do
    not give is NaN.

    Parameters
    ----------
    values
        Of one group; those that are not finite are left out.
    seed
        Of the resampling.
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
        warnings.simplefilter("ignore")  # where it cannot be had it is NaN, which says enough
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
    """Return every group once: numbers ascending, names as they come."""
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
        One row per specimen.
    groups
        Group of each row.
    quantities
        Columns of `curves`.
    seed
        Of the resampling.
    """
    rows = []
    for group in ordered(groups):
        part = curves[np.asarray(groups) == group]
        for name in quantities:
            found = describe(part[name].to_numpy(dtype=float), seed)
            rows.append({"group": group, "quantity": name, **found})
    return pd.DataFrame(rows, columns=["group", "quantity", *COLUMNS])

"""Comparison of groups, against R's example, SciPy, and data in which plants share effects."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from scipy.stats import ttest_ind

from ramiefenics.reduction.differences import differences

# R's data set PlantGrowth (Dobson 1983, An Introduction to Statistical Modelling): dried weight
PLANT_GROWTH = {
    "ctrl": (4.17, 5.58, 5.18, 6.11, 4.50, 4.61, 5.17, 4.53, 5.33, 5.14),
    "trt1": (4.81, 4.17, 4.41, 3.59, 5.87, 3.83, 6.03, 4.89, 4.32, 4.69),
    "trt2": (6.31, 5.12, 5.54, 5.50, 5.37, 5.29, 4.92, 6.15, 5.80, 5.26),
}


def test_example_of_r() -> None:
    """``oneway.test(weight ~ group, PlantGrowth)``: F = 5.181, df = 2, 17.128, p = 0.01739."""
    groups = [name for name, values in PLANT_GROWTH.items() for _ in values]
    curves = pd.DataFrame({"weight": np.concatenate(list(PLANT_GROWTH.values()))})
    tests, pairs = differences(curves, groups, ["weight"])
    (test,) = tests.to_dict("records")
    assert test["F"] == pytest.approx(5.181, abs=5e-4)
    assert (test["df"], test["df_within"]) == pytest.approx((2.0, 17.128), abs=5e-4)
    assert test["p"] == pytest.approx(0.01739, abs=5e-6)
    # sums of squares of R's aov: 3.766 between, 10.492 within
    assert test["eta_squared"] == pytest.approx(3.766 / (3.766 + 10.492), abs=1e-4)
    raw = [
        ttest_ind(PLANT_GROWTH[b], PLANT_GROWTH[a], equal_var=False)
        for a, b in pairs[["first", "second"]].to_numpy()
    ]
    holm = sorted(one.pvalue for one in raw)
    assert sorted(pairs["p"])[0] == pytest.approx(3.0 * holm[0])
    for row, one in zip(pairs.to_dict("records"), raw, strict=True):
        interval = one.confidence_interval()
        assert (row["low"], row["high"]) == pytest.approx((interval.low, interval.high))


def test_size_of_a_difference_has_hedges_factor() -> None:
    """For two groups of five it is Cohen's d times 0.903 (Hedges 1981, Table 1, eight degrees)."""
    a, b = np.array([1.0, 2.0, 3.0, 4.0, 5.0]), np.array([2.0, 4.0, 4.0, 6.0, 9.0])
    curves = pd.DataFrame({"x": np.concatenate([a, b])})
    (pair,) = differences(curves, ["a"] * 5 + ["b"] * 5, ["x"])[1].to_dict("records")
    cohen = (b.mean() - a.mean()) / np.sqrt((a.var(ddof=1) + b.var(ddof=1)) / 2.0)
    assert pair["g"] == pytest.approx(0.903 * cohen, rel=5e-4)


def test_roots_of_one_plant_are_not_independent() -> None:
    """Plants differ but groups do not: if plants are known, one comparison in twenty is wrong."""
    rng, wrong, naive = np.random.default_rng(4), 0, 0
    groups = ["a"] * 20 + ["b"] * 20
    plants = [f"{k // 5}" for k in range(40)]
    for _ in range(12):
        curves = pd.DataFrame({"x": np.repeat(rng.normal(0.0, 1.0, 8), 5) + rng.normal(0, 0.5, 40)})
        tests, _ = differences(curves, groups, ["x"], plants)
        assert tests["method"].tolist() == ["mixed model"]
        wrong += tests["p"].iloc[0] < 0.05
        naive += differences(curves, groups, ["x"])[0]["p"].iloc[0] < 0.05
    assert wrong <= 3  # of 12 at 5 %: there are more in one case of 500
    assert naive > 3


# R's data set sleep (Cushny and Peebles 1905; Student 1908): extra hours of ten patients, two drugs
SLEEP = (
    (0.7, -1.6, -0.2, -1.2, -0.1, 3.4, 3.7, 0.8, 0.0, 2.0),
    (1.9, 0.8, 1.1, 0.1, -0.1, 4.4, 5.5, 1.6, 4.6, 3.4),
)


def test_groups_of_the_same_units_are_compared_within_them() -> None:
    """R's paired t-test of sleep: t = 4.0621, df = 9, p = 0.002833, interval 0.7001 to 2.4599."""
    patients = [f"{k}" for k in range(10)] * 2
    curves = pd.DataFrame({"hours": np.concatenate(SLEEP)})
    tests, pairs = differences(curves, ["1"] * 10 + ["2"] * 10, ["hours"], patients)
    (test,), (pair,) = tests.to_dict("records"), pairs.to_dict("records")
    assert test["method"] == "mixed model, within units"
    assert test["F"] == pytest.approx(4.0621**2, rel=1e-4)
    assert (test["df"], test["df_within"]) == (1.0, 9.0)
    assert (test["p"], pair["p"]) == pytest.approx((0.002833, 0.002833), abs=2e-6)
    assert (pair["low"], pair["high"]) == pytest.approx((0.7001, 2.4599), abs=1e-4)


def test_repeats_within_unit_and_group_add_no_degrees_of_freedom() -> None:
    groups = ["1"] * 20 + ["2"] * 20
    patients = [f"{k}" for k in range(10) for _ in range(2)] * 2
    hours = np.repeat(np.concatenate(SLEEP), 2) + np.tile([-0.3, 0.3], 20)
    tests, _ = differences(pd.DataFrame({"hours": hours}), groups, ["hours"], patients)
    assert tests["df_within"].tolist() == [9.0]
    assert tests["p"].iloc[0] == pytest.approx(0.002833, abs=2e-6)


def test_what_cannot_be_compared_is_left_out() -> None:
    curves = pd.DataFrame({"x": [1.0, 2.0, np.nan, 3.0], "y": [1.0, 1.0, 2.0, 2.0]})
    tests, pairs = differences(curves, ["a", "a", "b", "b"], ["x", "y"])
    assert tests.empty
    assert pairs.empty
    assert differences(curves, ["a"] * 4, ["x"])[0].empty

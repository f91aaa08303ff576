"""Response surfaces, against textbooks, other formulas and the published regression."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

import ramiefenics as rf
from ramiefenics.calibration.designs import central_composite
from ramiefenics.calibration.selection import removable, select_surface
from ramiefenics.calibration.surface import Surface, aicc, fit_surface
from ramiefenics.calibration.terms import model_matrix, model_terms
from ramiefenics.reconciliation.printed_design import table5

SQRT2 = np.sqrt(2.0)


@pytest.fixture(scope="module")
def montgomery() -> Surface:
    """Montgomery, Design and Analysis of Experiments (2001), chapter 11: yield of a process."""
    corners = [[-1, -1], [-1, 1], [1, -1], [1, 1]]
    axes = [[SQRT2, 0], [-SQRT2, 0], [0, SQRT2], [0, -SQRT2]]
    points = np.array(corners + [[0, 0]] * 5 + axes, dtype=float)
    values = [76.5, 77.0, 78.0, 79.5, 79.9, 80.3, 80.0, 79.7, 79.8, 78.4, 75.6, 78.5, 77.0]
    return select_surface("max_force_N", ["A", "B"], points, np.array(values), "quadratic", "none")


@pytest.fixture(scope="module")
def published() -> tuple[np.ndarray, np.ndarray]:
    """Return Table 5 with seven rows corrected, so that it is a central composite design."""
    found = rf.reconcile(*table5())
    return found.repairs[0], found.printed.responses


def by_source(surface: Surface) -> pd.DataFrame:
    return surface.anova().set_index("source")


def test_textbook_analysis_of_variance(montgomery: Surface) -> None:
    # as printed: sum of squares, degrees of freedom, F, p
    expected = {
        "model": (28.25, 5, 79.85, 0.0),
        "A": (7.92, 1, 111.93, 0.0),
        "B": (2.12, 1, 30.01, 0.0009),
        "A^2": (13.18, 1, 186.22, 0.0),
        "B^2": (6.97, 1, 98.56, 0.0),
        "A B": (0.25, 1, 3.53, 0.1022),
        "lack of fit": (0.28, 3, 1.78, 0.2897),
    }
    table = by_source(montgomery)
    for source, (total, df, ratio, p) in expected.items():
        row = table.loc[source]
        assert row["sum_of_squares"] == pytest.approx(total, abs=0.0051)
        assert row["df"] == df
        assert row["F"] == pytest.approx(ratio, abs=0.0051)
        assert row["p"] == pytest.approx(p, abs=0.000051)
    assert table.loc["residual", "sum_of_squares"] == pytest.approx(0.50, abs=0.0051)
    assert table.loc["pure error", "sum_of_squares"] == pytest.approx(0.21, abs=0.0051)
    assert table.loc["pure error", "df"] == 4
    assert table.loc["total", "sum_of_squares"] == pytest.approx(28.74, abs=0.0051)


def test_textbook_coefficients_and_quality(montgomery: Surface) -> None:
    # Montgomery: 79.94 + 0.99 A + 0.52 B - 1.38 A^2 - 1.00 B^2 + 0.25 A B; PRESS 2.35
    found = dict(zip(montgomery.labels, montgomery.fit.params, strict=True))
    printed = {"constant": 79.94, "A": 0.99, "B": 0.52, "A^2": -1.38, "B^2": -1.0, "A B": 0.25}
    for name, value in printed.items():
        assert found[name] == pytest.approx(value, abs=0.0051)
    quality = montgomery.quality
    assert quality["R2"] == pytest.approx(0.9828, abs=5.1e-5)
    assert quality["R2_adjusted"] == pytest.approx(0.9705, abs=5.1e-5)
    assert quality["R2_predicted"] == pytest.approx(0.9184, abs=5.1e-5)
    assert quality["PRESS"] == pytest.approx(2.35, abs=0.0051)


def test_press_is_what_leaving_out_gives(montgomery: Surface) -> None:
    total = 0.0
    for out in range(len(montgomery.values)):
        others = np.arange(len(montgomery.values)) != out
        matrix = model_matrix(montgomery.points, montgomery.terms)
        beta, *_ = np.linalg.lstsq(matrix[others], montgomery.values[others], rcond=None)
        total += float(montgomery.values[out] - matrix[out] @ beta) ** 2
    assert montgomery.press == pytest.approx(total)


def test_studentised_residuals_and_cook_are_what_leaving_out_gives(montgomery: Surface) -> None:
    table, matrix = montgomery.diagnostics(), model_matrix(montgomery.points, montgomery.terms)
    n, p = matrix.shape
    for out in (0, 5, 12):
        others = np.arange(n) != out
        beta, rest, *_ = np.linalg.lstsq(matrix[others], montgomery.values[others], rcond=None)
        sigma = np.sqrt(rest[0] / (n - 1 - p))
        residual = montgomery.fit.resid[out]
        leverage = table["leverage"][out]
        expected = residual / (sigma * np.sqrt(1.0 - leverage))
        assert table["studentised"][out] == pytest.approx(expected)
        shift = matrix @ (beta - montgomery.fit.params)
        cook = shift @ shift / (p * montgomery.fit.mse_resid)
        assert table["cook"][out] == pytest.approx(cook)


def test_the_published_regression_comes_out_of_the_repaired_design(
    published: tuple[np.ndarray, np.ndarray],
) -> None:
    surface = select_surface("max_force_N", ["X1", "X2", "X3"], *published, "interaction", "none")
    found = dict(zip(surface.labels, surface.fit.params, strict=True))
    # Eq. 5, to its digits
    printed = {"constant": 84.51, "X2": 0.43, "X3": 0.76, "X1 X2": -0.19, "X2 X3": -0.16}
    for name, value in printed.items():
        assert found[name] == pytest.approx(value, abs=0.0051)
    table = by_source(surface)
    # Table 6: sums of squares and what follows from them, which its F of X3 and X2X3 do not
    for source, total in {
        "model": 10.98,
        "X2": 2.54,
        "X3": 7.89,
        "X1 X2": 0.28,
        "X2 X3": 0.21,
        "residual": 0.52,
        "lack of fit": 0.41,
        "pure error": 0.11,
        "total": 11.5,
    }.items():
        assert table.loc[source, "sum_of_squares"] == pytest.approx(total, abs=0.0051)
    assert table.loc["model", "F"] == pytest.approx(45.57, abs=0.0051)
    assert table.loc["X2", "F"] == pytest.approx(63.2, abs=0.051)
    assert table.loc["lack of fit", "F"] == pytest.approx(2.39, abs=0.0051)
    assert table.loc["lack of fit", "p"] == pytest.approx(0.18, abs=0.0051)
    assert table.loc["X3", "F"] == pytest.approx(7.89 / (0.52 / 13), rel=0.01)


@pytest.mark.parametrize("rule", ["p", "aicc"])
def test_selection_keeps_the_published_terms_and_their_hierarchy(
    rule: str, published: tuple[np.ndarray, np.ndarray]
) -> None:
    surface = select_surface("max_force_N", ["X1", "X2", "X3"], *published, "quadratic", rule)
    # X1 has no effect of its own (p = 0.96), but stays because a product contains it
    assert surface.labels == ["constant", "X1", "X2", "X3", "X1 X2", "X2 X3"]


@pytest.mark.parametrize("rule", ["p", "aicc"])
def test_selection_finds_the_terms_that_made_the_data(rule: str) -> None:
    points, extra = central_composite(3).coded, 0
    for seed in range(20):
        noise = np.random.default_rng(seed).normal(0.0, 0.1, len(points))
        values = 3.0 + 2.0 * points[:, 0] + 1.5 * points[:, 1] * points[:, 2] + noise
        surface = select_surface("max_force_N", list("ABC"), points, values, "quadratic", rule)
        assert {"A", "B", "C", "B C"} <= set(surface.labels)
        extra += len(surface.labels) - 5
    # each of 5 absent terms is kept with a probability of about 0.05, by AICc somewhat more
    assert extra / 20 < 1.0


def test_only_terms_that_nothing_contains_may_go() -> None:
    terms = [(0, 0), (1, 0), (0, 1), (2, 0)]
    assert removable(terms) == [(0, 1), (2, 0)]
    assert removable([(0, 0)]) == []


def test_a_deterministic_response_has_no_pure_error() -> None:
    points = central_composite(2, centres=5).coded
    values = np.exp(0.3 * points[:, 0]) + points[:, 1] ** 3
    surface = select_surface("max_force_N", ["A", "B"], points, values, rule="none")
    assert surface.merged == 4
    assert len(surface.values) == 9
    table = by_source(surface)
    assert table.loc["pure error", "df"] == 0
    assert np.isnan(table.loc["lack of fit", "F"])
    assert np.isnan(table.loc["lack of fit", "p"])
    assert table.loc["lack of fit", "df"] == table.loc["residual", "df"] == 3
    assert any("deterministic" in note for note in surface.notes())
    values[-1] += 0.01  # repeats that differ count as separate runs
    noisy = select_surface("max_force_N", ["A", "B"], points, values, rule="none")
    assert noisy.merged == 0
    # the runs on a circle do not predict their only centre, so PRESS leaves it out
    assert np.isnan(surface.diagnostics()["studentised"][8])
    assert np.isfinite(surface.prediction_error)
    assert by_source(noisy).loc["pure error", "df"] == 4


def test_intervals_of_coefficients_hold_as_often_as_they_say() -> None:
    points = central_composite(2).coded
    generator, terms = np.random.default_rng(2), model_terms(2, "quadratic")
    truth = np.array([1.0, 2.0, 0.0, 0.5, -1.0, 0.3])
    covered = []
    for _ in range(300):
        values = model_matrix(points, terms) @ truth + generator.normal(0.0, 0.4, len(points))
        table = fit_surface("max_force_N", ["A", "B"], terms, points, values).coefficients()
        covered.append((table["low"] <= truth) & (truth <= table["high"]))
    # 1800 coefficients, about six independent ones per set: 0.95 +- 3 times 0.006
    assert np.mean(covered) == pytest.approx(0.95, abs=0.02)


def test_surfaces_predict_with_slope_and_error(montgomery: Surface) -> None:
    at = np.array([[0.3, -0.6], [0.0, 0.0]])
    for factor in range(2):
        step = np.zeros(2)
        step[factor] = 1e-5
        central = (montgomery.predict(at + step) - montgomery.predict(at - step)) / 2e-5
        assert montgomery.slopes(at)[:, factor] == pytest.approx(central)
    # at the centre, with five repeats: sigma / sqrt(5); corners and axial points do not help
    expected = np.sqrt(montgomery.fit.mse_resid / 5.0)
    assert montgomery.standard_error(at)[1] == pytest.approx(expected)


def test_failed_runs_are_left_out(montgomery: Surface) -> None:
    values = montgomery.values.copy()
    values[3] = np.nan
    surface = fit_surface("max_force_N", ["A", "B"], montgomery.terms, montgomery.points, values)
    assert len(surface.values) == 12


def test_too_few_or_confounded_runs_are_refused() -> None:
    corners = central_composite(2, centres=1).coded[:5]
    with pytest.raises(rf.SpecificationError, match="must be more than the 6 terms"):
        select_surface("max_force_N", ["A", "B"], corners, np.arange(5.0))
    cube = central_composite(3, centres=8).coded
    cube = cube[~np.isclose(np.abs(cube), 8.0**0.25).any(axis=1)]  # no axial points
    values = np.random.default_rng(0).normal(size=len(cube))
    with pytest.raises(rf.SpecificationError, match="some are aliases"):
        select_surface("max_force_N", list("ABC"), cube, values)
    with pytest.raises(rf.SpecificationError, match="must be one of p, aicc, none"):
        select_surface("max_force_N", list("ABC"), cube, values, "linear", "best")


def test_aicc_is_that_of_the_likelihood() -> None:
    # -2 log L of normal errors minus the constant n (1 + log 2 pi), plus Hurvich and Tsai's penalty
    n, k, residual = 20, 4, 3.0
    log_likelihood = -0.5 * n * (1.0 + np.log(2.0 * np.pi * residual / n))
    full = -2.0 * log_likelihood + 2 * (k + 1) * n / (n - (k + 1) - 1)
    assert aicc(residual, n, k) == pytest.approx(full - n * (1.0 + np.log(2.0 * np.pi)))
    assert aicc(residual, 5, 4) == np.inf


def test_one_run_that_dominates_the_fit_is_told_in_the_singular() -> None:
    points = np.array([[-1.0], [-0.9], [-0.8], [-0.7], [1.0]])
    values = np.array([0.0, 0.2, 0.1, 0.3, 9.0])
    told = fit_surface("max_force_N", ["a"], model_terms(1, "linear"), points, values).notes()
    assert "Dominant in the fit (Cook's distance above 1): fitted run 5." in told

"""Optima, equally good sets and identifiability in cases with known answers."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import pytest
from scipy import stats

import ramiefenics as rf
from ramiefenics.calibration import posterior
from ramiefenics.calibration.designs import central_composite
from ramiefenics.calibration.desirability import Goal, most_desirable, overall
from ramiefenics.calibration.factors import Factor, Space
from ramiefenics.calibration.identifiability import in_words, information, profile
from ramiefenics.calibration.misfit import Misfit, Targets
from ramiefenics.calibration.optimum import find_optimum, level_points
from ramiefenics.calibration.posterior import draw_posterior
from ramiefenics.calibration.surface import Surface, fit_surface
from ramiefenics.calibration.terms import model_terms

Function = Callable[[np.ndarray], np.ndarray]


def exact(function: Function, number: int = 2, alpha: str = "face") -> Surface:
    """Return a surface that reproduces a quadratic function without error."""
    points = central_composite(number, alpha).coded
    names = [f"X{i + 1}" for i in range(number)]
    terms = model_terms(number, "quadratic")
    return fit_surface("max_force_N", names, terms, points, function(points))


def misfit_of(
    functions: Sequence[Function],
    values: Sequence[float],
    errors: Sequence[float],
    number: int = 2,
    alpha: str = "face",
) -> Misfit:
    surfaces = tuple(exact(function, number, alpha) for function in functions)
    names = tuple(f"r{i}" for i in range(len(functions)))
    targets = Targets(names, np.array(values), np.diag(np.square(errors)))
    return Misfit(surfaces, targets, central_composite(number, alpha).region)


def plane(*slopes: float) -> Function:
    return lambda points: points @ np.array(slopes)


def test_the_best_point_of_a_plane_is_the_foot_of_the_perpendicular() -> None:
    optimum, used = find_optimum(misfit_of([plane(3.0, 4.0)], [2.5], [0.1]))
    assert optimum.met
    assert used.discrepancy == ()
    assert optimum.best == pytest.approx([0.3, 0.4], abs=1e-6)  # 2.5 / 5 along (3, 4) / 5
    assert optimum.predicted == pytest.approx([2.5])


def test_the_equally_good_set_is_the_band_of_the_error() -> None:
    error = 0.3 / np.sqrt(stats.chi2.ppf(0.95, 1))
    optimum, _ = find_optimum(misfit_of([plane(1.0, 0.0)], [0.0], [error]))
    assert optimum.share == pytest.approx(0.3, abs=0.005)  # -0.3 to 0.3 of -1 to 1
    extent = np.array([optimum.good.min(axis=0), optimum.good.max(axis=0)])
    assert extent[:, 0] == pytest.approx([-0.3, 0.3], abs=0.005)
    assert extent[:, 1] == pytest.approx([-1.0, 1.0], abs=0.005)
    assert np.abs(optimum.good[:, 0]).max() <= 0.3 + 1e-6


def test_a_target_out_of_reach_is_met_nowhere_and_counts_as_the_models_error() -> None:
    misfit = misfit_of([plane(3.0, 4.0)], [100.0], [1.0], alpha="rotatable")
    optimum, used = find_optimum(misfit)
    assert not optimum.met
    radius = np.sqrt(2.0)  # steepest ascent to the edge of the region
    assert optimum.best == pytest.approx([0.6 * radius, 0.8 * radius], abs=1e-5)
    assert optimum.predicted == pytest.approx([5.0 * radius])
    assert used.discrepancy == pytest.approx((100.0 - 5.0 * radius,))
    assert optimum.share == pytest.approx(1.0)  # all points are about as far away
    assert profile(used, 0, optimum.best).verdict == "not determined"


def test_several_responses_meet_in_a_point() -> None:
    def bowl(points: np.ndarray) -> np.ndarray:
        return (points[:, 0] - 0.4) ** 2 + points[:, 1] ** 2

    misfit = misfit_of([bowl, plane(1.0, 1.0)], [0.0, 0.4], [0.01, 0.01])
    optimum, _ = find_optimum(misfit)
    assert optimum.best == pytest.approx([0.4, 0.0], abs=1e-3)


def test_level_points_lie_on_the_level_and_all_over_it() -> None:
    surface = exact(lambda points: np.square(points).sum(axis=1), 3, "rotatable")
    region = central_composite(3).region
    points = level_points(surface, 1.0, region, 2000)
    assert np.linalg.norm(points, axis=1) == pytest.approx(1.0, abs=1e-6)
    assert np.abs(points.mean(axis=0)).max() < 0.06  # about 2000 points all over a sphere
    assert len(level_points(surface, 100.0, region, 500)) == 0


@pytest.mark.parametrize("alpha", ["rotatable", "face"])
@pytest.mark.parametrize("value", [0.0, 6.0])
def test_one_number_never_determines_a_parameter_of_three(alpha: str, value: float) -> None:
    # wherever the target lies, more of one factor can be traded for less of the others, up to the
    # region's edge
    misfit = misfit_of([plane(10.0, 10.0, 10.0)], [value], [0.1], 3, alpha)
    optimum, used = find_optimum(misfit)
    profiles = [profile(used, number, optimum.best) for number in range(3)]
    assert {found.verdict for found in profiles} == {"not determined"}
    space = Space(tuple(Factor(f"X{i}", (f"k{i}",), 0.0, 1.0) for i in range(3)))
    told = in_words(space, profiles, information(used, optimum.best))
    assert "One combination of the 3 parameters is determined" in told[-1]


def test_desirabilities_are_those_of_derringer_and_suich() -> None:
    target = Goal("target", 2.0, 6.0, 3.0, exponent=2.0)
    values = np.array([1.0, 2.0, 2.5, 3.0, 4.5, 6.0, 7.0])
    assert target.desirability(values) == pytest.approx([0.0, 0.0, 0.25, 1.0, 0.25, 0.0, 0.0])
    assert Goal("maximum", 2.0, 6.0).desirability(values) == pytest.approx(
        [0.0, 0.0, 0.125, 0.25, 0.625, 1.0, 1.0]
    )
    assert Goal("minimum", 2.0, 6.0).desirability(values) == pytest.approx(
        [1.0, 1.0, 0.875, 0.75, 0.375, 0.0, 0.0]
    )
    for bad in (("best", 1.0, 2.0, None), ("target", 1.0, 2.0, 3.0), ("maximum", 2.0, 1.0, None)):
        with pytest.raises(rf.SpecificationError):
            Goal(*bad)


def test_the_most_desirable_point_is_that_of_an_exhaustive_search() -> None:
    # Montgomery's process (2001, chapter 11): the yield should be large, the viscosity 65
    def yields(x: np.ndarray) -> np.ndarray:
        a, b = x.T
        return 79.94 + 0.995 * a + 0.515 * b - 1.376 * a**2 - 1.001 * b**2 + 0.25 * a * b

    def viscosity(x: np.ndarray) -> np.ndarray:
        a, b = x.T
        return 70.0 - 0.155 * a - 0.948 * b - 0.6875 * a**2 - 6.6875 * b**2 - 1.25 * a * b

    surfaces = [exact(yields, alpha="rotatable"), exact(viscosity, alpha="rotatable")]
    goals = [Goal("maximum", 70.0, 80.0), Goal("target", 62.0, 68.0, 65.0)]
    region = central_composite(2).region
    line = np.linspace(-region.reach, region.reach, 1001)
    grid = np.column_stack([part.ravel() for part in np.meshgrid(line, line)])
    grid = grid[region.contains(grid)]
    best = overall(surfaces, goals, grid).max()
    point, found = most_desirable(surfaces, goals, region)
    assert region.contains(point)
    assert found == pytest.approx(best, abs=2e-3)  # error of a grid with steps of 0.003
    assert found >= best
    unwanted = [Goal("maximum", 200.0, 300.0), goals[1]]
    assert most_desirable(surfaces, unwanted, region)[1] == 0.0


def test_profiles_of_a_linear_model_are_the_normal_intervals() -> None:
    # y = A x with independent errors: x = inv(A) y, covariance inv(A) S inv(A)'
    matrix, truth, errors = np.array([[2.0, 1.0], [1.0, -1.0]]), np.array([0.2, -0.1]), (0.2, 0.1)
    misfit = misfit_of([plane(*row) for row in matrix], matrix @ truth, errors)
    optimum, used = find_optimum(misfit)
    inverse = np.linalg.inv(matrix)
    covariance = inverse @ np.diag(np.square(errors)) @ inverse.T
    assert optimum.best == pytest.approx(truth, abs=1e-5)
    for factor in range(2):
        found = profile(used, factor, optimum.best)
        half = 1.959964 * np.sqrt(covariance[factor, factor])
        assert found.verdict == "determined"
        assert found.low == pytest.approx(truth[factor] - half, abs=1e-3)
        assert found.high == pytest.approx(truth[factor] + half, abs=1e-3)
        assert found.share == pytest.approx(half, abs=1e-3)
    known = information(used, optimum.best)
    assert np.linalg.inv(covariance) == pytest.approx(
        known.directions.T @ np.diag(known.eigenvalues) @ known.directions, rel=1e-4
    )
    assert known.determined.all()


def test_one_number_does_not_fix_two_parameters() -> None:
    misfit = misfit_of([plane(3.0, 4.0)], [0.5], [0.1])
    optimum, used = find_optimum(misfit)
    profiles = [profile(used, factor, optimum.best) for factor in range(2)]
    # 3 X1 + 4 X2 = 0.5 +- 0.2 within [-1, 1]: X1 may have any value, X2 at most
    # (0.5 + 0.2 + 3) / 4, but only because X1 must not be below -1
    assert [found.verdict for found in profiles] == ["not determined", "not determined"]
    assert profiles[0].by_others == (False, False)
    assert profiles[1].by_others == (True, True)
    assert profiles[1].high == pytest.approx((0.5 + 1.96 * 0.1 + 3.0) / 4.0, abs=2e-3)
    assert profiles[1].low == pytest.approx((0.5 - 1.96 * 0.1 - 3.0) / 4.0, abs=2e-3)
    known = information(used, optimum.best)
    assert known.eigenvalues == pytest.approx([(5.0 / 0.1) ** 2, 0.0], abs=1e-6)
    assert known.directions[0] == pytest.approx([0.6, 0.8])
    assert list(known.determined) == [True, False]
    assert known.errors[1] == np.inf
    space = Space(
        (
            Factor("X1", ("fixture.friction.dynamic",), 0.0, 0.2),
            Factor("X2", ("fixture.indenter_radius_mm",), 4.0, 6.0),
        )
    )
    told = " ".join(in_words(space, profiles, known))
    assert "X1 is not determined by these data: with the others adjusted" in told
    assert "X2 is not determined by these data: it is kept between" in told
    assert "One combination of the 2 parameters is determined" in told
    assert "0.60 X1 +0.80 X2" in told


def test_ranges_that_hardly_matter_do_not_make_a_parameter_undetermined() -> None:
    misfit = misfit_of([plane(0.1, 1.0)], [0.0], [0.2])
    optimum, used = find_optimum(misfit)
    profiles = [profile(used, factor, optimum.best) for factor in range(2)]
    # 0.1 X1 + X2 = 0 +- 0.39: X2 is within 0.39 if X1 is fixed, and within 0.49 otherwise
    assert [found.verdict for found in profiles] == ["not determined", "determined"]
    assert profiles[1].high == pytest.approx(1.96 * 0.2 + 0.1, abs=2e-3)
    assert profiles[1].at_edge
    space = Space(tuple(Factor(f"X{i}", (f"k{i}",), 0.0, 1.0) for i in (1, 2)))
    told = in_words(space, profiles, information(used, optimum.best))
    assert told[1].startswith("X2 is determined, within the ranges given for X1: 0.254 to 0.746")
    steep = misfit_of([plane(2.0, 1.0)], [0.0], [0.2])
    optimum, used = find_optimum(steep)
    assert not profile(used, 0, optimum.best).at_edge
    assert profile(used, 0, optimum.best).by_others == (True, True)


def test_targets_that_are_missed_are_not_said_to_be_fitted() -> None:
    optimum, used = find_optimum(misfit_of([plane(3.0, 4.0)], [100.0], [1.0]))
    profiles = [profile(used, factor, optimum.best) for factor in range(2)]
    space = Space(tuple(Factor(f"X{i}", (f"k{i}",), 0.0, 1.0) for i in (1, 2)))
    told = in_words(space, profiles, information(used, optimum.best), optimum.met)
    assert "miss the targets equally, once the misfit that remains counts as an error" in told[0]
    assert "fit equally well" not in " ".join(told)


def test_a_parameter_without_effect_is_not_determined_and_one_side_may_be_open() -> None:
    misfit = misfit_of([plane(1.0, 0.0)], [0.9], [0.2])
    optimum, used = find_optimum(misfit)
    first, second = (profile(used, factor, optimum.best) for factor in range(2))
    assert first.verdict == "bounded below"
    assert first.low == pytest.approx(0.9 - 1.96 * 0.2, abs=1e-3)
    assert first.high is None
    assert second.verdict == "not determined"
    assert second.share == 1.0
    assert second.rise == pytest.approx(0.0, abs=1e-6)


@pytest.mark.slow
def test_profile_intervals_cover_the_truth_as_often_as_they_say() -> None:
    def curved(points: np.ndarray) -> np.ndarray:
        return 2.0 * points[:, 0] + 0.5 * points[:, 0] * points[:, 1] + 0.3 * points[:, 1] ** 2

    functions = [curved, plane(1.0, -1.0), plane(0.3, 1.0)]
    truth, errors = np.array([[0.2, -0.1]]), np.array([0.15, 0.12, 0.2])
    values = np.array([function(truth)[0] for function in functions])
    generator, covered = np.random.default_rng(4), 0
    clean = misfit_of(functions, values, errors)
    repeats = 300
    for _ in range(repeats):
        seen = values + generator.normal(0.0, errors)
        targets = Targets(clean.targets.names, seen, clean.targets.covariance)
        misfit = Misfit(clean.surfaces, targets, clean.region)
        _, least = misfit.least()
        # the truth is inside the interval if the profile has risen by less than 3.84 there
        covered += misfit.least((0, truth[0, 0]))[1] - least <= stats.chi2.ppf(0.95, 1)
    spread = np.sqrt(0.95 * 0.05 / repeats)
    assert covered / repeats == pytest.approx(0.95, abs=3.0 * spread)


def test_posterior_is_the_normal_one_of_a_linear_model(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(posterior, "STEPS", 2500)
    matrix, truth, errors = np.array([[2.0, 1.0], [1.0, -1.0]]), np.array([0.2, -0.1]), (0.2, 0.1)
    misfit = misfit_of([plane(*row) for row in matrix], matrix @ truth, errors)
    found = draw_posterior(misfit)
    inverse = np.linalg.inv(matrix)
    covariance = inverse @ np.diag(np.square(errors)) @ inverse.T
    assert found.trusted
    # some thousand independent draws
    assert found.samples.mean(axis=0) == pytest.approx(truth, abs=0.01)
    assert np.cov(found.samples.T) == pytest.approx(covariance, rel=0.1)
    assert found.contraction == pytest.approx(1.0 - np.diag(covariance) / (1.0 / 3.0), abs=0.02)


def test_posterior_draws_are_the_same_every_time(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(posterior, "STEPS", posterior.DISCARDED + 50)
    misfit = misfit_of([plane(2.0, 1.0)], [0.2], (0.1,))
    once, again = draw_posterior(misfit), draw_posterior(misfit)
    assert np.array_equal(again.samples, once.samples)


def test_posterior_without_information_is_the_prior(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(posterior, "STEPS", 2000)
    found = draw_posterior(misfit_of([plane(1.0, 0.0)], [0.0], [100.0], alpha="rotatable"))
    assert found.contraction == pytest.approx(0.0, abs=0.08)
    assert np.linalg.norm(found.samples, axis=1).max() <= np.sqrt(2.0) + 1e-6


def test_correlated_errors_are_whitened() -> None:
    covariance = np.array([[0.04, 0.03], [0.03, 0.09]])
    surfaces = (exact(plane(1.0, 0.0)), exact(plane(0.0, 1.0)))
    targets = Targets(("a", "b"), np.zeros(2), covariance)
    misfit = Misfit(surfaces, targets, central_composite(2, "face").region)
    point = np.array([0.3, -0.2])
    expected = point @ np.linalg.inv(covariance) @ point
    assert misfit.of(point[None]) == pytest.approx([expected])

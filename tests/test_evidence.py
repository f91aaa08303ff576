"""The statistics of discovery against dense Gaussians and known probabilities."""

import numpy as np
import pytest
from scipy.stats import multivariate_normal

from ramiefenics.discovery.evidence import WHITE, Evidence, Scatter
from ramiefenics.discovery.verdict import (
    bootstrap_p_value,
    gains_without_each,
    measure_gain,
    misfit_chance,
    rivals,
    smooth,
)

N, M, FACTOR_SD = 5, 12, 0.3
X = (np.arange(M) + 1.0) / M
SCATTER = Scatter(tau=0.07, sigma=0.008, length=0.08)


@pytest.fixture
def curves():
    """Derivatives by two factors, a nuisance, a signature; different in every specimen."""
    size = np.linspace(0.8, 1.2, N)[:, None]
    by_factors = np.stack([size * X, size * X**2], axis=1)
    nuisance = 0.01 * np.stack([np.cos(np.pi * X) * size], axis=1)
    signature = size**2 * np.sin(2 * np.pi * X)
    return by_factors, nuisance, signature


def dense(by_factors, nuisance, scatter):
    """The covariance as the module's docstring states it."""
    distance = np.abs(np.arange(M)[:, None] - np.arange(M)) / M
    noise = np.exp(-distance / scatter.length) + WHITE**2 * np.eye(M)
    whole = np.zeros((N * M, N * M))
    for s in range(N):
        block = slice(s * M, (s + 1) * M)
        own = scatter.tau**2 * by_factors[s].T @ by_factors[s]
        whole[block, block] = scatter.sigma**2 * noise + own
    for column in np.concatenate([FACTOR_SD * by_factors, nuisance], axis=1).transpose(1, 0, 2):
        whole += np.outer(column.ravel(), column.ravel())
    return whole


def test_likelihood_is_that_of_a_dense_gaussian(curves):
    by_factors, nuisance, signature = curves
    residual = np.random.default_rng(1).normal(0.0, 0.02, (N, M))
    evidence = Evidence(residual, by_factors, nuisance, FACTOR_SD)
    values, amplitudes, _ = evidence.log_likelihoods(
        [SCATTER], np.array([0 * signature, signature]), [(0, 0), (-9, 9)], residual[..., None]
    )
    gaussian = multivariate_normal(cov=dense(by_factors, nuisance, SCATTER))
    constant = -0.5 * N * M * np.log(2 * np.pi)
    for value, a in zip(values[0, :, 0], amplitudes[0, :, 0], strict=True):
        expected = gaussian.logpdf((residual - a * signature).ravel()) - constant
        assert value == pytest.approx(expected, abs=1e-8)


def test_left_out_is_the_conditional_mean(curves):
    by_factors, nuisance, _ = curves
    rng = np.random.default_rng(2)
    evidence = Evidence(rng.normal(0.0, 0.02, (N, M)), by_factors, nuisance, FACTOR_SD)
    fit = evidence.fit()
    whole = dense(by_factors, nuisance, fit.scatter)
    data = evidence.residual.ravel()
    predicted = evidence.left_out(fit)
    for s in range(N):
        out = np.arange(N * M) // M == s
        weights = np.linalg.solve(whole[np.ix_(~out, ~out)], data[~out])
        assert np.allclose(predicted[s], whole[np.ix_(out, ~out)] @ weights, atol=1e-10)


def test_a_strong_effect_is_measured(curves):
    by_factors, nuisance, signature = curves
    clean = Evidence(np.zeros((N, M)), by_factors, nuisance, FACTOR_SD)
    noise = clean.draw(SCATTER, 1, np.random.default_rng(3))[..., 0]
    evidence = Evidence(noise + 0.05 * signature, by_factors, nuisance, FACTOR_SD)
    fit = evidence.fit(signature, (-1.0, 1.0))
    assert abs(fit.amplitude - 0.05) < 3.0 * fit.error
    assert fit.log_likelihood > evidence.fit().log_likelihood + 10.0


@pytest.mark.parametrize("factor_sd", [0.05, 0.3])
def test_what_a_factor_could_do_as_well_is_as_uncertain_as_the_factor(curves, factor_sd):
    """Only the sum of the two shows in the data: the prior of one is the error of the other."""
    by_factors, _, _ = curves
    nothing = np.zeros((N, 1, M))
    evidence = Evidence(np.zeros((N, M)), by_factors, nothing, factor_sd)
    scatter = Scatter(tau=0.0, sigma=1e-4, length=0.08)
    square = evidence.products(scatter, by_factors[None, :, 0])[0, 0]
    # the noise adds less than 1e-4 of a curve's height, over five specimens
    assert square**-0.5 == pytest.approx(factor_sd, rel=1e-4)


def test_bounds_of_amplitudes_are_kept(curves):
    by_factors, nuisance, signature = curves
    evidence = Evidence(-0.05 * signature, by_factors, nuisance, FACTOR_SD)
    assert evidence.fit(signature, (0.0, 1.0)).amplitude == 0.0


@pytest.mark.slow
def test_chance_is_uniform_where_there_is_nothing(curves):
    """Of 60 data sets without effect about 60 p have a chance below p (binomial, 4 sd)."""
    by_factors, nuisance, signature = curves
    clean = Evidence(np.zeros((N, M)), by_factors, nuisance, FACTOR_SD)
    draws = clean.draw(SCATTER, 60, np.random.default_rng(4))
    found = []
    for k in range(60):
        evidence = Evidence(draws[..., k], by_factors, nuisance, FACTOR_SD)
        base, best = evidence.fit(), evidence.fit(signature, (-1.0, 1.0))
        gain = best.log_likelihood - base.log_likelihood
        rng = np.random.default_rng(k)
        found.append(bootstrap_p_value(evidence, base, signature[None], [(-1.0, 1.0)], gain, rng))
    for p in (0.1, 0.3, 0.5, 0.7):
        assert abs(np.mean(np.array(found) < p) - p) < 4.0 * (p * (1 - p) / 60) ** 0.5


def test_gain_counts_specimens_not_points():
    """The same specimens, each with ten times the points, are no more evidence."""
    rng = np.random.default_rng(5)
    before = rng.normal(0.0, 1.0, (8, 1)) * np.ones(10)
    after = rng.normal(0.0, 0.6, (8, 1)) * np.ones(10)
    many = [np.repeat(errors, 10, axis=1) for errors in (before, after)]
    few = measure_gain(before, after, np.random.default_rng(6))
    assert few.interval == pytest.approx(measure_gain(*many, np.random.default_rng(6)).interval)
    assert few.interval[0] < few.ratio < few.interval[1]
    assert few.ratio == pytest.approx((after**2).mean() ** 0.5 / (before**2).mean() ** 0.5)


@pytest.mark.parametrize(("size", "seen"), [(0.0, False), (0.03, True)])
def test_what_all_specimens_share_and_no_factor_explains_is_a_misfit(curves, size, seen):
    by_factors, nuisance, _ = curves
    clean = Evidence(np.zeros((N, M)), by_factors, nuisance, FACTOR_SD)
    noise = clean.draw(SCATTER, 1, np.random.default_rng(7))[..., 0]
    residual = noise + size * np.cos(3 * np.pi * X)
    modes = smooth(N, M)
    narrow, wide = (
        Evidence(residual, by_factors, np.concatenate([nuisance, share * modes], axis=1), FACTOR_SD)
        for share in (0.003, 0.03)
    )
    p = misfit_chance(narrow, wide, narrow.fit(), np.random.default_rng(8))
    assert (p < 0.005) == seen


def test_rivals_are_those_within_odds_of_twenty():
    gains = {"a": 10.0, "b": 7.5, "c": 6.9, "d": 9.0}
    assert rivals(gains, "a") == ["d", "b"]


def test_own_part_is_the_conditional_mean_of_own_deviations(curves):
    by_factors, nuisance, _ = curves
    errors = np.random.default_rng(9).normal(0.0, 0.02, (N, M))
    evidence = Evidence(errors, by_factors, nuisance, FACTOR_SD)
    fit = evidence.fit()
    left = evidence.without_own(fit, errors)
    distance = np.abs(np.arange(M)[:, None] - np.arange(M)) / M
    noise = np.exp(-distance / fit.scatter.length) + WHITE**2 * np.eye(M)
    for s in range(N):
        own = fit.scatter.tau**2 * by_factors[s].T @ by_factors[s]
        whole = fit.scatter.sigma**2 * noise + own
        assert np.allclose(errors[s] - own @ np.linalg.solve(whole, errors[s]), left[s], atol=1e-10)


@pytest.mark.parametrize("offset", [0.0, 1.0])
def test_mean_factors_are_the_conditional_mean(curves, offset):
    """Of d and the mean of b_s, also where the data contradict the prior of d."""
    by_factors, nuisance, _ = curves
    noise = np.random.default_rng(11).normal(0.0, 0.02, (N, M))
    residual = noise + offset * by_factors[:, 0]
    evidence = Evidence(residual, by_factors, nuisance, FACTOR_SD)
    fit = evidence.fit()
    weights = np.linalg.solve(dense(by_factors, nuisance, fit.scatter), residual.ravel())
    flat = by_factors.transpose(1, 0, 2).reshape(2, -1)
    # d has the same covariance with all specimens, and b_s with its own: over N for the mean
    share = FACTOR_SD**2 + fit.scatter.tau**2 / N
    assert np.allclose(evidence.mean_log_factors(fit), share * flat @ weights, atol=1e-10)


def test_one_specimen_cannot_speak_for_an_effect(curves):
    by_factors, nuisance, signature = curves
    clean = Evidence(np.zeros((N, M)), by_factors, nuisance, FACTOR_SD)
    noise = clean.draw(SCATTER, 1, np.random.default_rng(10))[..., 0]
    for everywhere, size in ((True, 0.05), (False, 0.3)):
        share = np.ones(N) if everywhere else np.eye(N)[2]
        evidence = Evidence(
            noise + size * share[:, None] * signature, by_factors, nuisance, FACTOR_SD
        )
        gain = evidence.fit(signature, (-1, 1)).log_likelihood - evidence.fit().log_likelihood
        without = gains_without_each(evidence, evidence, signature, (-1.0, 1.0))
        assert gain > 5.0
        assert (without.min() > 3.0) == everywhere
        assert everywhere or without.argmin() == 2

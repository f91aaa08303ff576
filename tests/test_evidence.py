"""The statistics of discovery, against dense Gaussians and known probabilities."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import multivariate_normal

import ramiefenics as rf
from ramiefenics.discovery.curves.blocks import Blocks
from ramiefenics.discovery.statistics import bootstrap
from ramiefenics.discovery.statistics.broken import find_broken
from ramiefenics.discovery.statistics.causes import (
    Causes,
    all_sets,
    find_causes,
    log_evidence_gains,
    log_priors,
)
from ramiefenics.discovery.statistics.evidence import (
    BROKEN,
    DRIFT_LENGTH,
    WHITE,
    Evidence,
    Suspect,
)
from ramiefenics.discovery.statistics.fit import Fit
from ramiefenics.discovery.statistics.fit_scatter import (
    fit_scatter,
    log_evidence,
    log_evidence_slope,
)
from ramiefenics.discovery.statistics.freedom import degrees_of_freedom
from ramiefenics.discovery.statistics.gain import measure_gain
from ramiefenics.discovery.statistics.hidden import cosines, limits
from ramiefenics.discovery.statistics.scatter import (
    ALIKE,
    DRIFT,
    LENGTH,
    NOISE,
    OWN,
    SPREAD,
    Scatter,
)
from ramiefenics.discovery.statistics.verdict import resting_on_one, without_fit

M, FACTOR_SD = 16, 0.1
X = (np.arange(M) + 1.0) / M
SCATTER = Scatter(own=(0.07, 0.04), noise=0.008, length=0.08, drift=0.004)
NAMES = ("A", "B", "B", "C", "D", "E", "E", "F")
"""Specimens of the eight curves; two of them were tested twice."""


def effect(name: str, per_specimen: bool = False, low: float = -9.0) -> rf.Effect:
    """Return a stand-in for an effect of which only the signature matters."""
    return rf.Effect(
        name, "", "", "1", (low, 9.0), 1.0, lambda test, amplitude: test, per_specimen=per_specimen
    )


def evidence(
    amplitudes: Mapping[str, float], seed: int = 1, names: tuple[str, ...] = NAMES
) -> Evidence:
    """Draw curves from a model with effects of these amplitudes."""
    rng = np.random.default_rng(seed)
    size = rng.normal(1.0, 0.1, len(names))[:, None]
    by_factors = np.stack([size * X, size * X**2], axis=1)
    nuisance = 0.005 * np.stack([np.cos(np.pi * X) * size], axis=1)
    shapes = {
        "swing": np.sin(2 * np.pi * X),
        "ripple": np.sin(5 * np.pi * X),
        "tilt": size * np.cos(np.pi * X),
        "late": np.clip(X - 0.6, 0.0, None),
    }
    suspects = {name: Suspect(effect(name), 0.05 * size * shape) for name, shape in shapes.items()}
    blocks = Blocks.of(names, M)
    clean = Evidence(
        np.zeros((len(names), M)), by_factors, by_factors, nuisance, FACTOR_SD, blocks, suspects
    )
    drawn = blocks.curves(clean.draw(SCATTER, 1, rng))[:, 0]
    for name, amplitude in amplitudes.items():
        drawn = drawn + amplitude * suspects[name].signature
    return replace(clean, residual=drawn)


def dense(found: Evidence, scatter: Scatter, chosen: tuple[str, ...] = ()) -> np.ndarray:
    """Return the covariance as stated in the docstring of `evidence`, curve by curve."""
    number, names = len(found.residual), found.blocks.specimen
    distance = np.abs(np.arange(M)[:, None] - np.arange(M)) / M
    whole = np.zeros((number * M, number * M))
    for r in range(number):
        block = slice(r * M, (r + 1) * M)
        noise = np.exp(-distance / scatter.length) + WHITE**2 * np.eye(M)
        whole[block, block] += (scatter.noise * found.roughness[r]) ** 2 * noise
        whole[block, block] += scatter.drift**2 * np.exp(-0.5 * (distance / DRIFT_LENGTH) ** 2)
        if names[r] in found.broken:
            noise = np.exp(-distance / LENGTH[0]) + WHITE**2 * np.eye(M)
            rough = np.median(np.abs(np.diff(found.residual[r], 2)))
            smooth = np.exp(-0.5 * (distance / DRIFT_LENGTH) ** 2)
            slip = np.minimum(np.arange(M)[:, None], np.arange(M)) + 1.0  # at any displacement
            whole[block, block] = (rough + 1e-8) ** 2 * noise + BROKEN**2 * (smooth + slip / M)
    counts = np.repeat([float(name not in found.broken) for name in names], M)
    same = np.kron(names[:, None] == names, np.ones((M, M)))
    for k, own in enumerate(scatter.own):
        column = counts * found.by_own[:, k].ravel()
        whole += np.outer(column, column) * (FACTOR_SD**2 + own**2 * same)
    for column in found.nuisance.transpose(1, 0, 2).reshape(-1, number * M):
        whole += np.outer(counts * column, counts * column)
    for name in chosen:
        column = counts * found.signatures[:, found.names.index(name)].ravel()
        whole += np.outer(column, column) * (1.0 + scatter.spread.get(name, 0.0) ** 2 * same)
    return whole


@pytest.mark.parametrize("broken", [frozenset(), frozenset({1})])
@pytest.mark.parametrize("chosen", [(), ("tilt",), ("swing", "ripple")])
def test_evidence_is_that_of_a_dense_gaussian(chosen, broken):
    """Curves of the same specimen are correlated; bounds are far away."""
    found = replace(evidence({"swing": 1.0}), broken=broken)
    scatter = replace(SCATTER, spread=dict.fromkeys(chosen[:1], 0.3))
    which = tuple(sorted(found.names.index(name) for name in chosen))
    reduced = found.whiten(scatter).reduce()
    value = reduced.log_evidence[0] + log_evidence_gains(reduced, found.bounds, [which])[0, 0]
    gaussian = multivariate_normal(cov=dense(found, scatter, chosen))
    constant = -0.5 * found.residual.size * np.log(2 * np.pi)
    assert value == pytest.approx(gaussian.logpdf(found.residual.ravel()) - constant, abs=1e-7)


def test_bounds_are_integrated_over():
    """The evidence of one amplitude is integrated numerically between its bounds."""
    found = evidence({"swing": 0.2})
    bounded = effect("swing", low=0.0)
    suspects = {"swing": replace(found.suspects["swing"], effect=bounded)}
    found = replace(found, suspects=suspects)
    reduced = found.whiten(SCATTER).reduce()
    gain = log_evidence_gains(reduced, found.bounds, [(0,)])[0, 0]
    amplitude = np.linspace(0.0, 6.0, 20001)  # times `scale`; the bound of 9 / 1.5 is there
    prior = np.exp(-0.5 * amplitude**2) / np.trapezoid(np.exp(-0.5 * amplitude**2), amplitude)
    likelihood = np.exp(amplitude * reduced.onto[0, 0] - 0.5 * amplitude**2 * reduced.gram[0, 0])
    expected = np.log(np.trapezoid(prior * likelihood, amplitude))
    assert gain == pytest.approx(expected, abs=1e-5)


def test_sets_are_counted_and_weighed():
    sets = all_sets(5)
    assert len(sets) == 1 + 5 + 10 + 10
    weights = np.exp(log_priors(sets, 5))
    by_size = [sum(w for s, w in zip(sets, weights, strict=True) if len(s) == k) for k in range(4)]
    assert by_size == pytest.approx([0.5, 0.3, 0.15, 0.05])
    assert len(all_sets(2)) == 4


@pytest.mark.parametrize("hidden", [(), ("swing",), ("swing", "ripple")])
def test_all_that_is_there_is_found_and_nothing_else(hidden):
    found = evidence(dict.fromkeys(hidden, 1.0), seed=5)
    causes = find_causes(found)
    assert set(causes.best) == set(hidden)
    if hidden:
        assert causes.groups() == [(name,) for name in causes.best]
    assert causes.none == pytest.approx(0.0 if hidden else 1.0, abs=0.3)
    assert causes.probability.sum() == pytest.approx(1.0)


def test_a_part_that_cannot_be_simulated_does_not_make_a_set_rest_on_one_specimen():
    found = evidence({"swing": 1.0, "ripple": 1.0}, seed=5)
    causes = find_causes(found, impossible=[("swing",)])
    assert set(causes.best) == {"swing", "ripple"}
    assert causes.gain(["swing"]) == -np.inf
    assert resting_on_one(Fit(found, causes.best, causes.scatter), causes) == {}


def test_what_is_probable_without_a_fit_is_told():
    found = evidence({"swing": 1.0, "ripple": 1.0}, seed=5)
    causes = find_causes(found)
    assert without_fit(Fit(found, ("swing",), SCATTER), causes) == {"ripple"}
    assert without_fit(Fit(found, causes.best, SCATTER), causes) == set()


def test_two_names_of_one_thing_make_a_group():
    found = evidence({"swing": 1.0})
    twin = replace(found.suspects["swing"], effect=effect("sway"))
    causes = find_causes(replace(found, suspects={**found.suspects, "sway": twin}))
    assert [set(group) for group in causes.groups()] == [{"swing", "sway"}]
    inclusion = causes.inclusion()
    assert inclusion["swing"] == pytest.approx(inclusion["sway"])
    assert cosines(Fit(found, (), SCATTER)).keys() >= {("swing", "ripple")}


def test_groups_are_those_given_that_there_is_something():
    """Nothing has a probability of 0.2; of the rest, 0.7 and 0.28 are shares of 0.875 and 0.35."""
    sets = all_sets(3)
    share = {(): 0.2, (0,): 0.52, (1,): 0.1, (0, 1): 0.18}
    wanted = np.log([share.get(chosen, 1e-12) for chosen in sets])
    causes = Causes(("a", "b", "c"), sets, wanted - log_priors(sets, 3), SCATTER, SCATTER)
    assert causes.inclusion() == pytest.approx({"a": 0.7, "b": 0.28, "c": 0.0}, abs=1e-6)
    assert causes.groups() == [("a", "b")]


@pytest.mark.parametrize("lead", [0.5, 3.0, 12.0])
def test_probabilities_are_averages_over_errors_of_the_evidence(lead: float):
    """Of two sets whose evidences err independently by 1, the difference errs by the root of 2."""
    sets = ((), (0,))
    prior = log_priors(sets, 1)
    causes = Causes(("a",), sets, np.zeros(2), SCATTER, SCATTER)
    score = np.array([0.0, lead]) - prior
    sources = np.where(np.eye(2) == 1.0, score, -np.inf)
    averaged = causes.averaged(sources, 1.0)
    x = np.linspace(-12.0, 12.0, 2001)
    weight = np.exp(-0.25 * x**2) / np.exp(-0.25 * x**2).sum()
    expected = weight @ (1.0 / (1.0 + np.exp(lead + x)))
    # 400 random errors give a mean to a twentieth of their standard deviation
    assert averaged.none == pytest.approx(expected, rel=0.25)
    assert causes.averaged(sources, 0.0).none == pytest.approx(1.0 / (1.0 + np.exp(lead)))


def test_left_out_is_the_conditional_mean():
    found = evidence({"swing": 1.0})
    fit = Fit(found, ("swing",), SCATTER)
    # predictions do not include errors of the simulator
    whole, left = dense(found.of_simulation(), SCATTER, ("swing",)), fit.left_out()
    data, specimen = found.residual.ravel(), np.repeat(found.blocks.specimen, M)
    for s in range(found.blocks.number):
        out = specimen == s
        weights = np.linalg.solve(whole[np.ix_(~out, ~out)], data[~out])
        predicted = whole[np.ix_(out, ~out)] @ weights
        assert np.allclose(data[out] - predicted, left[found.blocks.specimen == s].ravel())


def test_factors_are_the_conditional_mean():
    found = evidence({})
    fit = Fit(found, (), SCATTER)
    weights = np.linalg.solve(dense(found, SCATTER), found.residual.ravel())
    flat = found.by_own.transpose(1, 0, 2).reshape(2, -1)
    assert np.allclose(fit.common_log_factors, FACTOR_SD**2 * flat @ weights, atol=1e-10)
    specimen = np.repeat(found.blocks.specimen, M)
    for s in range(found.blocks.number):
        own = np.array(SCATTER.own) ** 2 * (flat * (specimen == s) @ weights)
        assert np.allclose(fit.log_factors[s], fit.common_log_factors + own, atol=1e-10)


def test_what_is_left_is_the_conditional_mean_of_the_noise():
    found = evidence({"tilt": 1.0})
    scatter = replace(SCATTER, spread={"tilt": 0.5})
    left, simulator = Fit(found, ("tilt",), scatter).remaining()
    nothing = {name: 0.0 * getattr(found, name) for name in ("by_own", "by_common", "nuisance")}
    noise = dense(replace(found, **nothing), scatter)
    expected = noise @ np.linalg.solve(dense(found, scatter, ("tilt",)), found.residual.ravel())
    assert np.allclose((left - simulator).ravel(), expected, atol=1e-10)


def test_a_broken_specimen_is_found_and_does_not_decide():
    found = evidence({"swing": 1.0})
    wrong = found.residual - 0.15 * ((X > 0.5) & (found.blocks.specimen == 3)[:, None])
    broken = find_broken(replace(found, residual=wrong), ("swing",))
    assert broken.broken == frozenset({3})
    assert find_broken(found, ("swing",)).broken == frozenset()
    without = [name != "D" for name in NAMES]
    rest = replace(
        found,
        residual=found.residual[without],
        by_common=found.by_common[without],
        by_own=found.by_own[without],
        nuisance=found.nuisance[without],
        blocks=Blocks.of(tuple(np.array(NAMES)[without]), M),
        suspects={n: replace(s, signature=s.signature[without]) for n, s in found.suspects.items()},
    )
    each = [fit_scatter(e, ("swing",)) for e in (broken, rest)]
    assert each[0].logarithms() == pytest.approx(each[1].logarithms(), abs=1e-4)  # of a minimum
    amplitudes = [Fit(e, ("swing",), SCATTER).amplitudes["swing"] for e in (broken, rest)]
    assert amplitudes[0] == pytest.approx(amplitudes[1], rel=1e-9)


def test_a_broken_specimen_is_no_sign_of_amplitudes_that_differ():
    """Its slip looks like an effect of this specimen alone, of ten times the typical amplitude."""
    found = evidence({})
    late = replace(found.suspects["late"], effect=effect("late", True))
    found = replace(found, suspects={**found.suspects, "late": late})
    slipped = found.residual - 0.5 * late.signature * (found.blocks.specimen == 3)[:, None] * 20.0
    broken = replace(found, residual=slipped, broken=frozenset({3}))
    assert fit_scatter(broken, ("late",)).spread["late"] < 1.0


@pytest.mark.parametrize("high", [3.0, 9.0])
def test_amplitudes_of_specimens_stay_within_bounds(high):
    """Specimens have amplitudes of -2 to 6; where 3 is the most, they differ by less."""
    found = evidence({})
    swing = replace(effect("swing", True, -high), bounds=(-high, high))
    each = np.linspace(-2.0, 6.0, found.blocks.number)[found.blocks.specimen]
    signature = found.suspects["swing"].signature
    found = replace(
        found,
        residual=found.residual + each[:, None] * signature,
        suspects={**found.suspects, "swing": Suspect(swing, signature)},
    )
    fit = Fit(found, ("swing",), fit_scatter(found, ("swing",)))
    scale = float(found.scale[found.names.index("swing")])
    own = fit._by_own_amplitudes(fit._without_shared()) / signature
    amplitudes = np.median(own, axis=1) + fit.amplitudes["swing"]
    assert (amplitudes.max() > 5.0) == (high > 6.0)
    assert amplitudes.max() < high + 0.2 * scale


def test_it_is_found_by_how_much_specimens_differ():
    """The prior, which expects less, and six specimens allow 30 %."""
    found = evidence({})
    each = np.linspace(-2.0, 6.0, found.blocks.number)
    swing = replace(found.suspects["swing"], effect=effect("swing", True))
    change = each[found.blocks.specimen, None] * swing.signature
    found = replace(
        found, residual=found.residual + change, suspects={**found.suspects, "swing": swing}
    )
    fit = Fit(found, ("swing",), fit_scatter(found, ("swing",)))
    assert fit.sd_between_specimens == {"swing": pytest.approx(each.std(ddof=1), rel=0.3)}


def test_scatter_is_estimated():
    """So few specimens allow a factor of two, and 20 % for the noise."""
    many = tuple(f"S{k}" for k in range(24))
    found = fit_scatter(evidence({}, seed=3, names=many))
    assert found.noise == pytest.approx(SCATTER.noise, rel=0.2)
    for value, true in zip(found.own, SCATTER.own, strict=True):
        assert 0.5 < value / true < 2.0


@pytest.mark.parametrize("broken", [frozenset(), frozenset({1})])
def test_slopes_by_standard_deviations_are_those_of_small_differences(broken):
    found = evidence({"swing": 1.0})
    suspects = {n: replace(s, effect=effect(n, True)) for n, s in found.suspects.items()}
    found = replace(found, suspects=suspects, broken=broken)
    scatter, chosen, small = replace(SCATTER, spread={"tilt": 0.2}), ("swing", "tilt"), 1e-5
    _, slope = log_evidence_slope(found, chosen, scatter)
    middle = scatter.logarithms()
    for index, step in enumerate(small * np.eye(len(middle))):
        up, down = (
            log_evidence(found, chosen, scatter.moved(middle + side * step)) for side in (1, -1)
        )
        assert slope[index] == pytest.approx((up - down) / (2 * small), rel=1e-5, abs=1e-5)


@pytest.mark.parametrize("coefficients", [2, 3, 6])
def test_coefficients_between_specimens_cost_degrees_of_freedom(coefficients: int) -> None:
    """One mean and c slopes of n specimens that differ by one factor leave n - 1 - c.

    The prior of the factor's standard deviation, which is the estimated one here, counts for half
    the precision of its logarithm.
    """
    number, rng = 12, np.random.default_rng(3)
    left = number - 1.0 - coefficients
    one = np.tile(X, (number, 1))[:, None]
    columns = np.linalg.qr(np.vander(np.arange(number), coefficients + 1, increasing=True))[0]
    own = rng.standard_normal(number)
    own -= columns @ (columns.T @ own)
    own *= OWN[0] * left**0.5 / np.linalg.norm(own)
    residual = own[:, None] * X + 1e-4 * rng.standard_normal((number, M))
    blocks = Blocks.of(tuple(map(str, range(number))), M)
    differing = columns[:, 1:, None] * X
    found = Evidence(residual, one, one, differing, 1.0, blocks, learned=coefficients)
    fit = Fit(found, (), fit_scatter(found))

    def variances(fit: Fit) -> np.ndarray:
        _, covariance = fit.evidence.whiten(fit.scatter).deviations(())
        return np.diagonal(covariance)[1:]

    freedom = degrees_of_freedom(fit, variances)
    assert freedom == pytest.approx(left + 0.5 / OWN[1] ** 2, abs=0.15)  # the noise is not nothing


def test_factors_far_from_what_was_stated_are_a_conflict():
    found = evidence({})
    assert Fit(found, (), SCATTER).conflict() > 0.01
    far = found.residual + 0.6 * found.by_own[:, 0]
    shifted = replace(found, residual=far)
    assert Fit(shifted, (), fit_scatter(shifted)).conflict() < 1e-3


def test_limits_hold_what_is_there_and_name_what_imitates_it():
    found = evidence({"tilt": 0.5, "swing": 1.0})
    fit = Fit(found, ("swing",), SCATTER)
    told = limits([fit], find_causes(found), ["first", "second"])
    assert told["tilt"].low < 0.5 < told["tilt"].high
    # a signature equal to that of a factor is as uncertain as the factor
    same = Suspect(effect("same"), found.by_own[:, 0])
    found = replace(found, suspects={**found.suspects, "same": same})
    fit = Fit(found, ("swing",), SCATTER)
    limit = limits([fit], find_causes(found), ["first", "second"])["same"]
    assert limit.imitated_by[0] == "first"
    assert limit.high - limit.low > 2 * 1.5 * FACTOR_SD


def test_what_one_probable_set_does_not_exclude_is_not_excluded():
    found = evidence({"swing": 1.0})
    fits = [Fit(found, names, SCATTER) for names in ((), ("swing",))]
    causes = find_causes(found)
    some = (fits, fits[:1], fits[1:])
    both, *each = (limits(fits, causes, ["first", "second"]) for fits in some)
    for name, limit in both.items():
        assert limit.low == min(one[name].low for one in each)
        assert limit.high == max(one[name].high for one in each)
        assert limit.imitated_by == each[0][name].imitated_by


def test_two_effects_for_which_a_third_was_taken_are_not_excluded():
    """It has the signature of both together, and is more probable a priori than both."""
    found = evidence({"swing": 1.0, "ripple": 1.0})
    both = Suspect(effect("both"), sum(found.suspects[n].signature for n in ("swing", "ripple")))
    found = replace(found, suspects={**found.suspects, "both": both})
    causes = find_causes(found)
    assert causes.best == ("both",)
    told = limits([Fit(found, ("both",), causes.scatter)], causes, ["first", "second"])
    for name in ("swing", "ripple"):
        assert told[name].low < 0.0
        assert 1.0 < told[name].high < 2.0


def test_a_limit_beyond_a_bound_is_larger_than_nothing():
    """Data that speak for a negative amplitude do not exclude all of the positive ones."""
    found = evidence({"swing": -3.0})
    bounded = replace(found.suspects["swing"], effect=effect("swing", low=0.0))
    suspects = {**found.suspects, "swing": bounded}
    found = replace(found, suspects=suspects)
    limit = limits([Fit(found, (), SCATTER)], find_causes(found), ["a", "b"])["swing"]
    # far in the tail of a normal distribution the density falls exponentially
    assert limit.low == 0.0
    assert 0.0 < limit.high < 0.3


def test_what_is_left_of_an_imitated_signature_excludes_nothing():
    """Factors imitate all but a hundredth of this signature."""
    found = evidence({})
    swing = found.suspects["swing"].signature
    nearly = Suspect(effect("nearly"), found.by_own[:, 0] + 0.2 * swing)
    found = replace(found, factor_sd=10.0, suspects={"nearly": nearly})
    fit = Fit(found, (), replace(SCATTER, noise=1e-4, drift=1e-6))
    limit = limits([fit], find_causes(found), ["a", "b"])["nearly"]
    assert (limit.low, limit.high) == (-9.0, 9.0)


@pytest.mark.slow
def test_p_values_are_uniform_where_there_is_nothing(monkeypatch):
    """Of 60 data sets without effects, about 60 p have a p-value below p (binomial, 4 sd)."""
    monkeypatch.setattr(bootstrap, "DRAWS", 300)
    effects, misfits = [], []
    for k in range(60):
        found, rng = evidence({}, seed=100 + k), np.random.default_rng(k)
        nothing = fit_scatter(found)
        effects.append(bootstrap.p_value_of_effect(found, nothing, rng))
        misfits.append(bootstrap.p_value_of_misfit(Fit(found, (), nothing), rng))
    for p in (0.1, 0.3, 0.5, 0.7):
        for values in (effects, misfits):
            assert abs(np.mean(np.array(values) < p) - p) < 4.0 * (p * (1 - p) / 60) ** 0.5


@pytest.mark.parametrize(("size", "seen"), [(0.0, False), (0.03, True)])
def test_what_all_specimens_share_and_no_factor_explains_is_a_misfit(size, seen):
    found = evidence({}, seed=7)
    found = replace(found, residual=found.residual + size * np.cos(3 * np.pi * X))
    nothing, rng = fit_scatter(found), np.random.default_rng(8)
    assert (bootstrap.p_value_of_misfit(Fit(found, (), nothing), rng) < 0.005) == seen


def test_gain_counts_specimens_not_points():
    """Ten times as many points on the same specimens are no more evidence."""
    rng = np.random.default_rng(5)
    before = rng.normal(0.0, 1.0, (8, 1)) * np.ones(10)
    after = rng.normal(0.0, 0.6, (8, 1)) * np.ones(10)

    def measured(times: int):
        errors = [np.repeat(part, times, axis=1) for part in (before, after, before)]
        return measure_gain(*errors, np.arange(8), np.random.default_rng(6))

    few = measured(1)
    assert few.interval == pytest.approx(measured(10).interval)
    assert few.interval[0] < few.ratio < few.interval[1]
    assert few.ratio == pytest.approx((after**2).mean() ** 0.5 / (before**2).mean() ** 0.5)


def test_prior_of_scatter_is_a_correlated_gaussian():
    scatter = replace(SCATTER, own=(0.4, 0.1, 0.02), spread={"swing": 0.2})
    priors = np.array([*[OWN] * 3, NOISE, LENGTH, DRIFT, SPREAD])
    correlation = np.eye(len(priors))
    correlation[:3, :3] = ALIKE + (1.0 - ALIKE) * np.eye(3)
    sd = priors[:, 1]
    gaussian = multivariate_normal(np.log(priors[:, 0]), correlation * np.outer(sd, sd))
    at, middle = scatter.logarithms(), np.log(priors[:, 0])
    assert scatter.log_prior() == pytest.approx(gaussian.logpdf(at) - gaussian.logpdf(middle))
    slope, precision = scatter.prior_derivatives()
    for k, step in enumerate(1e-4 * np.eye(len(at))):
        up, down = gaussian.logpdf(at + step), gaussian.logpdf(at - step)
        assert slope[k] == pytest.approx((up - down) / 2e-4, rel=1e-6)
        curvature = (2.0 * gaussian.logpdf(at) - up - down) / 1e-8
        assert precision[k, k] == pytest.approx(curvature, rel=1e-4)

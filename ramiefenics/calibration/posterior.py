"""Posterior of the parameters, sampled with emcee for a flat prior in the region of the design."""

from __future__ import annotations

from dataclasses import dataclass

import emcee
import numpy as np

from ramiefenics.calibration.factors import Array
from ramiefenics.calibration.misfit import Misfit

WALKERS, STEPS, DISCARDED, THIN = 64, 5000, 800, 12
"""Settings of emcee's ensemble sampler (Goodman and Weare 2010; Foreman-Mackey et al. 2013)."""

PRIOR = 8192
"""Number of points that represent the prior."""

ENOUGH = 50.0
"""Least length of a chain in autocorrelation times, as emcee's documentation recommends."""


@dataclass(frozen=True)
class Posterior:
    """Samples of the posterior and of the prior.

    Attributes
    ----------
    samples
        Samples of the posterior, coded, shape (n, k).
    prior
        Samples of the prior, coded.
    chain_length
        Number of steps divided by the longest autocorrelation time. From 50 on, the samples may be
        trusted.
    """

    samples: Array
    prior: Array
    chain_length: float

    @property
    def trusted(self) -> bool:
        """Whether the chain is long enough for the samples to be trusted."""
        return self.chain_length >= ENOUGH

    @property
    def contraction(self) -> Array:
        """Share of each parameter's prior variance that the data remove, shape (k,).

        It is 1 if the data determine the parameter, and 0 if they say nothing about it.
        """
        return np.asarray(1.0 - self.samples.var(axis=0) / self.prior.var(axis=0))

    def quantiles(self, *levels: float) -> Array:
        """Return quantiles of each parameter, coded, shape (levels, k)."""
        return np.quantile(self.samples, levels, axis=0)


def draw_posterior(misfit: Misfit, seed: int = 0) -> Posterior:
    """Return samples of the posterior for a given misfit."""
    region = misfit.region
    prior = region.sample(PRIOR, seed)
    generator = np.random.default_rng(seed)
    chi2 = misfit.of(prior)
    weights = np.exp(-0.5 * (chi2 - chi2.min()))
    # the walkers start from points of the prior, drawn in proportion to the likelihood and moved a
    # little so that no two are the same
    chosen = generator.choice(len(prior), WALKERS, p=weights / weights.sum())
    spread = 1e-3 * region.reach * generator.standard_normal((WALKERS, region.dimension))
    start = region.pull_in(prior[chosen] + spread)

    def log_probability(points: Array) -> Array:
        return np.where(region.contains(points), -0.5 * misfit.of(points), -np.inf)

    sampler = emcee.EnsembleSampler(WALKERS, region.dimension, log_probability, vectorize=True)
    state = emcee.State(start, random_state=np.random.RandomState(seed).get_state())
    sampler.run_mcmc(state, STEPS, skip_initial_state_check=True)
    times = sampler.get_autocorr_time(discard=DISCARDED, quiet=True, tol=0)
    samples = sampler.get_chain(discard=DISCARDED, thin=THIN, flat=True)
    length = (STEPS - DISCARDED) / float(np.max(times))
    return Posterior(np.asarray(samples), prior, length)

"""Posterior of the parameters, by emcee, with a flat prior over the region of the design."""

from __future__ import annotations

from dataclasses import dataclass

import emcee
import numpy as np

from ramiefenics.calibration.factors import Array
from ramiefenics.calibration.misfit import Misfit

WALKERS, STEPS, DISCARDED, THIN = 64, 5000, 800, 12
"""Of emcee's ensemble (Goodman and Weare 2010; Foreman-Mackey et al. 2013)."""

PRIOR = 8192
"""Points that stand for the prior."""

ENOUGH = 50.0
"""Autocorrelation times that a chain must last, by emcee's advice."""


@dataclass(frozen=True)
class Posterior:
    """Draws, and what they tell.

    Attributes
    ----------
    samples
        Coded, shape (n, k).
    prior
        Draws without the data, coded.
    chain_length
        Steps over the longest autocorrelation time: above 50 the draws may be trusted.
    """

    samples: Array
    prior: Array
    chain_length: float

    @property
    def trusted(self) -> bool:
        """Whether the chain is long enough."""
        return self.chain_length >= ENOUGH

    @property
    def contraction(self) -> Array:
        """Share of a parameter's prior variance that the data take away, shape (k,).

        1 where they fix it, 0 where they tell nothing.
        """
        return np.asarray(1.0 - self.samples.var(axis=0) / self.prior.var(axis=0))

    def quantiles(self, *levels: float) -> Array:
        """Return quantiles of every parameter, coded, shape (levels, k)."""
        return np.quantile(self.samples, levels, axis=0)


def draw_posterior(misfit: Misfit, seed: int = 0) -> Posterior:
    """Return draws from the posterior of a misfit."""
    region = misfit.region
    prior = region.sample(PRIOR, seed)
    generator = np.random.default_rng(seed)
    chi2 = misfit.of(prior)
    weights = np.exp(-0.5 * (chi2 - chi2.min()))
    # the cloud to start from: the prior weighted by the likelihood, spread a little so that no two
    # walkers are the same
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

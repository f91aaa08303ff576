"""What the evidence allows to say: none, cause, ambiguous or unknown."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ramiefenics.discovery.evidence import Array, Evidence, Fit, all_scatters

SIGNIFICANCE = 0.001
"""Probability, without any effect, of a likelihood ratio like the best suspect's: one in a thousand
data sets without any is accused."""

RIVAL = 3.0
"""Suspects whose log-likelihood is within that of the best's are not told apart: odds of 20."""

DRAWS = 2000
"""Random data sets from which probabilities are counted."""

MODEL_ERROR = 0.003
"""What the simulator may be wrong by, smoothly and the same way in all specimens, over the peak
force, apart from what its mesh makes."""

MISFIT = 10.0
"""Times the model error: what is missing where something unknown is."""

SMOOTH_MODES = 5
"""Cosines along the displacement that a smooth error is made of."""


@dataclass(frozen=True)
class Score:
    """How a suspect does.

    Attributes
    ----------
    log_likelihood_ratio
        Its log-likelihood less that of the baseline; None if it cannot be tested.
    amplitude, error
        Best value and its standard deviation.
    reason
        Why it cannot be tested, or is not believed; else empty.
    """

    log_likelihood_ratio: float | None
    amplitude: float = 0.0
    error: float = 0.0
    reason: str = ""


def gains_without_each(
    baseline: Evidence, extended: Evidence, signature: Array, limits: tuple[float, float]
) -> Array:
    """Return what an effect gains where one specimen is left out, shape (n,).

    No single specimen, whose handling may be its own, is to decide.

    Parameters
    ----------
    baseline, extended
        The evidence as linearised where the baseline, and the model with the effect, fit best.
    signature, limits
        Of the effect, shape (n, m); its least and largest amplitude.
    """
    gains = []
    for specimen in range(len(signature)):
        rest = np.delete(signature, specimen, axis=0)
        with_effect = extended.without(specimen).fit(rest, limits)
        gains.append(with_effect.log_likelihood - baseline.without(specimen).fit().log_likelihood)
    return np.array(gains)


def smooth(specimens: int, points: int) -> Array:
    """Return cosines of unit size, the same for all specimens, shape (n, modes, m)."""
    x = (np.arange(points) + 0.5) / points
    modes = np.array([np.cos(k * np.pi * x) for k in range(SMOOTH_MODES)])
    return np.broadcast_to(modes, (specimens, *modes.shape)).copy()


def bootstrap_p_value(
    evidence: Evidence,
    fit: Fit,
    signatures: Array,
    limits: Sequence[tuple[float, float]],
    best_gain: float,
    rng: np.random.Generator,
) -> float:
    """Return the probability that some suspect gains as much where there is no effect.

    Random residuals are drawn from the fit without effect, and treated as the measured ones: so
    the number of suspects, their bounds and the number of specimens are counted in.
    """
    scatters = all_scatters(fit.scatter.length)
    draws = evidence.draw(fit.scatter, DRAWS, rng)
    tried = np.concatenate([np.zeros_like(signatures[:1]), signatures])
    values, _, _ = evidence.log_likelihoods(scatters, tried, [(0.0, 0.0), *limits], draws)
    nothing, *suspects = values.max(axis=0)
    gains = np.max(suspects, axis=0) - nothing
    return float((1 + (gains >= best_gain).sum()) / (1 + DRAWS))


def misfit_chance(narrow: Evidence, wide: Evidence, fit: Fit, rng: np.random.Generator) -> float:
    """Return the probability of a common misfit like this where the model is right.

    Parameters
    ----------
    narrow, wide
        The evidence with the simulator's own error as it should be, and with a large one.
    fit
        The best fit of the former.
    rng
        Random numbers.
    """
    scatters = all_scatters(fit.scatter.length)
    draws = narrow.draw(fit.scatter, DRAWS, rng)
    nothing = np.zeros((1, *draws.shape[:2]))

    def gains(residuals: Array) -> Array:
        both = [
            e.log_likelihoods(scatters, nothing, [(0.0, 0.0)], residuals)[0].max(axis=0)[0]
            for e in (wide, narrow)
        ]
        return np.asarray(both[0] - both[1])

    measured = gains(narrow.residual)[0]
    return float((1 + (gains(draws) >= measured).sum()) / (1 + DRAWS))


def rivals(gains: Mapping[str, float], best: str) -> list[str]:
    """Return the other suspects that are not told apart from the best, best first."""
    near = [n for n, g in gains.items() if n != best and gains[best] - g < RIVAL]
    return sorted(near, key=lambda name: -gains[name])


@dataclass(frozen=True)
class Gain:
    """How much better specimens are predicted that the fit has not seen.

    Attributes
    ----------
    before_N, after_N
        Errors of the predicted curves without and with the effect, each specimen left out in turn,
        shape (n, m).
    interval
        Of `ratio`, 95 %, by paired bootstrap: specimens are drawn, not points.
    """

    before_N: Array
    after_N: Array
    interval: tuple[float, float]

    @property
    def rmse_before_N(self) -> float:
        """Root mean square error without the effect."""
        return float(np.sqrt((self.before_N**2).mean()))

    @property
    def rmse_after_N(self) -> float:
        """Root mean square error with the effect."""
        return float(np.sqrt((self.after_N**2).mean()))

    @property
    def ratio(self) -> float:
        """The latter over the former; below 1 is better."""
        return self.rmse_after_N / self.rmse_before_N

    @property
    def shown(self) -> bool:
        """Whether predictions are better by more than chance: all of the interval is below 1."""
        return self.interval[1] < 1.0

    def numbers(self) -> dict[str, Any]:
        """Return what a summary has of it."""
        return {
            "rmse_before": self.rmse_before_N,
            "rmse_after": self.rmse_after_N,
            "ratio": self.ratio,
            "interval": self.interval,
            "shown": self.shown,
        }


def measure_gain(before_N: Array, after_N: Array, rng: np.random.Generator) -> Gain:
    """Return the gain, given errors of left-out predictions, shape (n, m)."""
    before, after = (before_N**2).mean(axis=1), (after_N**2).mean(axis=1)
    picked = rng.integers(0, len(before), (DRAWS, len(before)))
    ratios = np.sqrt(after[picked].mean(axis=1) / before[picked].mean(axis=1))
    low, high = np.quantile(ratios, (0.025, 0.975))
    return Gain(before_N, after_N, (float(low), float(high)))

"""Improvement in the prediction of curves that a fit has not seen."""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ramiefenics.discovery.curves.blocks import Array, Integers
from ramiefenics.discovery.curves.observed import Observed
from ramiefenics.discovery.statistics.fit import Fit

DRAWS = 2000
"""Number of bootstrap samples of the specimens."""


@dataclass(frozen=True)
class Gain:
    """Improvement in the prediction of curves that the fit has not seen.

    Attributes
    ----------
    before_N, after_N, plain_N
        Errors of the predicted curves without and with the effects, and of the mean curve of the
        other specimens as a predictor, shape (r, m); the last is None where it does not apply.
    interval
        95 % interval of `ratio` by a paired bootstrap, in which specimens are drawn, not points.
    """

    before_N: Array
    after_N: Array
    plain_N: Array | None
    interval: tuple[float, float]

    @property
    def rmse_before_N(self) -> float:
        """Root mean square error without the effects."""
        return float(np.sqrt((self.before_N**2).mean()))

    @property
    def rmse_after_N(self) -> float:
        """Root mean square error with the effects."""
        return float(np.sqrt((self.after_N**2).mean()))

    @property
    def rmse_plain_N(self) -> float | None:
        """Root mean square error of the other specimens' mean curve."""
        return None if self.plain_N is None else float(np.sqrt((self.plain_N**2).mean()))

    @property
    def ratio(self) -> float:
        """Error with the effects over that without; below 1 is better."""
        return self.rmse_after_N / self.rmse_before_N

    @property
    def shown(self) -> bool:
        """Whether predictions are better by more than chance: all of the interval is below 1."""
        return self.interval[1] < 1.0

    def numbers(self) -> dict[str, Any]:
        """Return the values for a summary."""
        return {
            "rmse_before": self.rmse_before_N,
            "rmse_after": self.rmse_after_N,
            "rmse_plain": self.rmse_plain_N,
            "ratio": self.ratio,
            "interval": self.interval,
            "shown": self.shown,
        }


def measure_gain(
    before_N: Array,
    after_N: Array,
    plain_N: Array | None,
    specimen: Integers,
    rng: np.random.Generator,
) -> Gain:
    """Return the gain, given the errors of predictions.

    Parameters
    ----------
    before_N, after_N, plain_N
        Errors of predicted left-out curves, as in `Gain`, shape (r, m).
    specimen
        Index of the specimen of each curve, shape (r,).
    rng
        Random number generator.
    """
    names, of = np.unique(specimen, return_inverse=True)
    before, after = (np.bincount(of, (errors**2).mean(axis=1)) for errors in (before_N, after_N))
    picked = rng.integers(0, len(names), (DRAWS, len(names)))
    ratios = np.sqrt(after[picked].mean(axis=1) / before[picked].mean(axis=1))
    low, high = np.quantile(ratios, (0.025, 0.975))
    return Gain(before_N, after_N, plain_N, (float(low), float(high)))


def gains(
    observed: Observed, before: Fit, after: Fit, rng: np.random.Generator
) -> tuple[Gain, Gain]:
    """Return the gains for curves and for their shapes, of left-out specimens not broken.

    Parameters
    ----------
    observed
        Measured curves.
    before, after
        Fits without effects and with them.
    rng
        Random number generator.
    """
    blocks, peaks = observed.blocks, observed.peak_N[:, None]
    whole = np.isin(blocks.specimen, after.evidence.whole)

    def gain(left_before: Array, left_after: Array, scaled: bool) -> Gain:
        plain = plain_errors(observed, scaled)
        errors = ((peaks * left_before)[whole], (peaks * left_after)[whole], plain[whole])
        return measure_gain(*errors, blocks.specimen[whole], rng)

    return (
        gain(before.left_out(), after.left_out(), scaled=False),
        gain(before.left_out_shape(), after.left_out_shape(), scaled=True),
    )


def condition_gain(
    observed: Observed,
    conditions: Sequence[Hashable],
    before: Fit,
    after: Fit,
    rng: np.random.Generator,
) -> Gain | None:
    """Return the gain under left-out conditions; None unless specimens were tested under several.

    Parameters
    ----------
    observed, before, after, rng
        As for `gains`.
    conditions
        Condition of every curve.
    """
    names, blocks = list(dict.fromkeys(conditions)), observed.blocks
    if len(names) < 2 or blocks.most < 2:
        return None
    condition = np.array([names.index(one) for one in conditions])
    whole = np.isin(blocks.specimen, after.evidence.whole)
    errors_before, errors_after = (
        (observed.peak_N[:, None] * fit.left_out_condition(condition))[whole]
        for fit in (before, after)
    )
    return measure_gain(errors_before, errors_after, None, blocks.specimen[whole], rng)


def plain_errors(observed: Observed, scaled: bool) -> Array:
    """Return the errors of the mean curve of all other specimens as a predictor, N, shape (r, m).

    Parameters
    ----------
    observed
        Measured curves; the first of a specimen is compared with the first of others, and so on.
    scaled
        Whether the mean curve is first fitted to each curve by a factor.
    """
    blocks, errors = observed.blocks, np.empty_like(observed.force_N)
    for row, (at, force) in enumerate(zip(observed.at_mm, observed.force_N, strict=True)):
        alike = blocks.place == blocks.place[row]
        others = np.flatnonzero(alike & (blocks.specimen != blocks.specimen[row]))
        curves = [np.interp(at, observed.at_mm[o], observed.force_N[o]) for o in others]
        mean = np.mean(curves, axis=0) if curves else np.zeros_like(force)
        factor = (mean @ force) / (mean @ mean) if scaled and mean.any() else 1.0
        errors[row] = force - factor * mean
    return errors

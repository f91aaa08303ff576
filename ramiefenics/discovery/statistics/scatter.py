"""Scatter of specimens and noise of curves: standard deviations, and their priors."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from ramiefenics.discovery.curves.blocks import Array

OWN, NOISE, LENGTH, DRIFT, SPREAD = (0.05, 1.2), (0.01, 1.0), (0.06, 0.8), (0.004, 1.0), (0.3, 0.7)
"""Median, and standard deviation of the logarithm, of the priors of `Scatter.own`, `noise`,
`length`, `drift` and `spread`."""

ALIKE = 0.75
"""Prior correlation of the logarithms of any two of `Scatter.own`.

Moduli of plant tissue differ between specimens mostly because its density and its water content do,
so where one of them differs much, so do the others."""


@dataclass(frozen=True)
class Scatter:
    """Standard deviations and a correlation length.

    Attributes
    ----------
    own
        Standard deviations of a specimen's own log factors, one for each factor.
    noise
        Typical standard deviation of the curves' noise, relative to the peak force, see `Evidence`.
    length
        Correlation length of the noise, as a share of the range.
    drift
        Standard deviation of the smooth error of a single curve, relative to the peak force.
    spread
        Standard deviation of an effect's amplitude between specimens, relative to `Evidence.scale`,
        by effect.
    """

    own: tuple[float, ...]
    noise: float
    length: float
    drift: float
    spread: dict[str, float] = field(default_factory=dict)

    @classmethod
    def typical(cls, factors: int, effects: tuple[str, ...] = ()) -> Scatter:
        """Return the medians of the priors."""
        spread = dict.fromkeys(effects, SPREAD[0])
        return cls((OWN[0],) * factors, NOISE[0], LENGTH[0], DRIFT[0], spread)

    def logarithms(self) -> Array:
        """Return the logarithms of all values, in the order of the attributes."""
        return np.log([*self.own, self.noise, self.length, self.drift, *self.spread.values()])

    def moved(self, logarithms: Array) -> Scatter:
        """Return the values with other logarithms, in the order of `logarithms`."""
        values = [float(value) for value in np.exp(logarithms)]
        number = len(self.own)
        noise, length, drift, *spread = values[number:]
        names = dict(zip(self.spread, spread, strict=True))
        return Scatter(tuple(values[:number]), noise, length, drift, names)

    def log_prior(self) -> float:
        """Return the log-prior of the values, up to a constant."""
        from_median, precision = self._prior()
        return float(-0.5 * from_median @ precision @ from_median)

    def prior_derivatives(self) -> tuple[Array, Array]:
        """Return first derivatives of `log_prior` by `logarithms`, and minus the second ones."""
        from_median, precision = self._prior()
        return -precision @ from_median, precision

    def _prior(self) -> tuple[Array, Array]:
        """Return the deviations of `logarithms` from their medians, and their prior precision."""
        factors = len(self.own)
        known = [OWN] * factors + [NOISE, LENGTH, DRIFT] + [SPREAD] * len(self.spread)
        median, sd = np.array(known).T
        alike = np.eye(len(known))
        alike[:factors, :factors] += ALIKE * (1.0 - np.eye(factors))
        return self.logarithms() - np.log(median), np.linalg.inv(alike * sd * sd[:, None])

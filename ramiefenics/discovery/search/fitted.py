"""Models fitted to all curves."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ramiefenics.discovery.curves.linearised import Linearised
from ramiefenics.discovery.statistics.fit import Fit

STEADY, STEADY_ERRORS = 0.1, 0.5
"""Changes of log factors, and of an amplitude relative to its standard deviation, below which no
further linearisation is needed to go on."""

SMALLEST = 1e-300


@dataclass(frozen=True)
class Fitted:
    """A model fitted to all curves.

    Attributes
    ----------
    curves
        Its predictions, linearised near where it was fitted.
    fit
        Fit of the linearised model.
    """

    curves: Linearised
    fit: Fit

    @property
    def distance(self) -> float:
        """Distance of the fitted parameters from those where the curves are linearised.

        It is the largest change of a log factor relative to `STEADY`, or of an amplitude relative
        to `STEADY_ERRORS` standard deviations; infinite if the curves are those of other effects.
        """
        model, fit = self.curves.model, self.fit
        if set(fit.chosen) != set(model.effects):
            return math.inf
        whole = fit.evidence.whole
        moves = [np.abs(fit.log_factors - model.log_factors)[whole].max() / STEADY]
        for name, amplitude in fit.amplitudes.items():
            change = abs(amplitude - model.amplitude(name))
            # at a bound the standard deviation may be zero
            moves.append(change and change / max(STEADY_ERRORS * fit.sd(name), SMALLEST))
        return float(max(moves))

    @property
    def steady(self) -> bool:
        """Whether the curves are linearised near enough to the fitted parameters to stop there."""
        return self.distance <= 1.0

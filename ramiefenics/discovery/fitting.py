"""Fitting of common factors, and of an effect with them, by repeated linearisation."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np

from ramiefenics.discovery.comparison import Linearised, Model, Observed, Simulator
from ramiefenics.discovery.evidence import Array, Evidence, Fit
from ramiefenics.discovery.factors import factors
from ramiefenics.discovery.verdict import MODEL_ERROR, smooth
from ramiefenics.effects import Effect
from ramiefenics.measured import Dataset
from ramiefenics.runs.curve import Mapper
from ramiefenics.specification import SpecificationError

ROUNDS = 5
"""Most linearisations of a fit."""

STEADY, STEADY_ERRORS = 0.1, 0.5
"""Changes of log factors, and of an amplitude over its standard deviation, that need no further
linearisation."""

FARTHEST = 0.3
"""Largest change of a log factor in a round: beyond it derivatives tell little."""

SHORTEST = 0.1
"""Share of a move that is tried last where simulations do not reach the end."""


@dataclass(frozen=True)
class Fitted:
    """A model fitted to all specimens.

    Attributes
    ----------
    curves
        Its predictions, linearised near where it was fitted.
    evidence
        For the linearised model.
    fit
        The best amplitude and scatter.
    signature
        Of its effect, over the peak force; None for the baseline.
    """

    curves: Linearised
    evidence: Evidence
    fit: Fit
    signature: Array | None = None

    @property
    def amplitude(self) -> float:
        """Amplitude of its effect."""
        return self.fit.amplitude

    @property
    def log_factors(self) -> Array:
        """Log factors, mean over the specimens, shape (k,)."""
        return self.evidence.mean_log_factors(self.fit, self.signature)

    def remaining(self) -> tuple[Array, Array]:
        """Return what mean factors and effect leave, over the peaks, shape (n, m).

        Also what of that is put down to the simulator.
        """
        explained, nuisance = self.evidence.parts(self.fit, self.signature)
        return self.evidence.residual[..., 0] - explained, nuisance

    def left_out(self) -> Array:
        """Return what a fit to all other specimens leaves of each, over the peaks, (n, m)."""
        residual = self.evidence.residual[..., 0]
        return residual - self.evidence.left_out(self.fit, self.signature)

    def left_out_shape(self) -> Array:
        """Return the same where each specimen's own factors are fitted to its own curve."""
        return self.evidence.without_own(self.fit, self.left_out())


class Fitter:
    """Fits models to a data set.

    Parameters
    ----------
    dataset, observed
        The measured curves.
    simulator
        Predicts them.
    """

    def __init__(self, dataset: Dataset, observed: Observed, simulator: Simulator) -> None:
        self._dataset, self._observed, self._simulator = dataset, observed, simulator

    def baseline(self) -> Fitted:
        """Fit the common factors."""
        used = factors(self._dataset.baseline, self._dataset.layout.fit)
        curves = self._simulator.linearise(Model(used, (0.0,) * len(used)))
        for _ in range(ROUNDS - 1):
            evidence = self.evidence(curves)
            wanted = evidence.mean_log_factors(evidence.fit())
            if np.abs(wanted - curves.model.log_factors).max() < STEADY:
                break
            curves = self._move(curves.model, wanted, 0.0)
        evidence = self.evidence(curves)
        return Fitted(curves, evidence, evidence.fit())

    def extended(self, baseline: Fitted, effect: Effect, amplitude: float) -> Fitted:
        """Fit factors and amplitude together, the latter from a first guess.

        Where the amplitude comes to zero the fit ends: that is the baseline.
        """
        model = dataclasses.replace(baseline.curves.model, effect=effect)
        curves = self._move(model, np.array(model.log_factors), amplitude)
        for number in range(ROUNDS):
            fitted = self._with_effect(curves, effect)
            moves = np.abs(fitted.log_factors - curves.model.log_factors).max()
            change = abs(fitted.amplitude - curves.model.amplitude)
            steady = moves < STEADY and change < STEADY_ERRORS * fitted.fit.error
            if steady or fitted.amplitude == 0.0 or number == ROUNDS - 1:
                break
            curves = self._move(curves.model, fitted.log_factors, fitted.amplitude)
        return fitted

    def confirmed(self, fitted: Fitted, effect: Effect | None, runs: Mapper) -> Fitted:
        """Fit again near the same parameters, with every specimen's curve simulated."""
        curves = self._simulator.confirm(fitted.curves, runs)
        if effect is not None:
            return self._with_effect(curves, effect)
        evidence = self.evidence(curves)
        return Fitted(curves, evidence, evidence.fit())

    def _with_effect(self, curves: Linearised, effect: Effect) -> Fitted:
        assert curves.by_effect is not None  # the model has an effect
        signature = curves.by_effect / self._observed.peak_N[:, None]
        evidence = self.evidence(curves)
        return Fitted(curves, evidence, evidence.fit(signature, effect.bounds), signature)

    def evidence(self, curves: Linearised, model_error: float = MODEL_ERROR) -> Evidence:
        """Return the evidence of a linearised model.

        Its residuals are those of the model with no factors and no effect, by the derivatives: so
        the factors' prior stays where it was, wherever the model is linearised.
        """
        peak = self._observed.peak_N[:, None]
        by_factors = curves.by_factors / peak[..., None]
        residual = (self._observed.force_N - curves.force) / peak
        residual += np.einsum("k,nkm->nm", curves.model.log_factors, by_factors)
        if curves.by_effect is not None:
            residual += curves.model.amplitude * curves.by_effect / peak
        wrong = model_error * smooth(*residual.shape)
        nuisance = np.concatenate([curves.by_mesh / peak[..., None], wrong], axis=1)
        return Evidence(residual, by_factors, nuisance, self._dataset.layout.fit_sd)

    def _move(self, model: Model, log_factors: Array, amplitude: float) -> Linearised:
        """Go to other parameters, or as far as simulations reach the end."""
        here = np.array(model.log_factors)
        step = np.clip(log_factors - here, -FARTHEST, FARTHEST)
        change = amplitude - model.amplitude
        share = 1.0
        while True:
            try:
                wanted = model.at(here + share * step, model.amplitude + share * change)
                return self._simulator.linearise(wanted)
            except SpecificationError:
                share /= 2.0
                if share < SHORTEST:
                    raise

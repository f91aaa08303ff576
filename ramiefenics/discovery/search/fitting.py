"""Fitting of factors, alone and together with effects, by repeated linearisation."""

from __future__ import annotations

import dataclasses
import logging
from collections.abc import Collection, Mapping

import numpy as np

from ramiefenics.discovery.curves.blocks import Array, smooth
from ramiefenics.discovery.curves.both_ways import Predicting
from ramiefenics.discovery.curves.factors import factors
from ramiefenics.discovery.curves.linearised import Linearised, Model
from ramiefenics.discovery.curves.observed import Observed
from ramiefenics.discovery.curves.signatures import needs_simulation
from ramiefenics.discovery.search.fitted import STEADY, STEADY_ERRORS, Fitted
from ramiefenics.discovery.statistics.broken import find_broken
from ramiefenics.discovery.statistics.causes import Causes, find_causes
from ramiefenics.discovery.statistics.evidence import MODEL_ERROR, Evidence, Suspect
from ramiefenics.discovery.statistics.fit import Fit
from ramiefenics.discovery.statistics.fit_scatter import fit_scatter
from ramiefenics.effects import Effect
from ramiefenics.measured import Dataset
from ramiefenics.specification import SpecificationError

log = logging.getLogger(__name__)

ROUNDS = 5
"""Maximum number of linearisations of a fit."""

FARTHEST = 0.5
"""Largest change of a log factor in a round, beyond which derivatives tell little. The largest
change of an amplitude is the typical amplitude, at which suspects are tried."""

REFITS, CLOSE_FIT = 8, 0.01
"""Maximum number of fits without simulations in between, and the change of log factors below which
no further fit is needed."""

SHORTEST = 0.1
"""Smallest share of a move that is tried where simulations do not reach the end."""


class Fitter:
    """Fits models to a data set.

    Parameters
    ----------
    dataset, observed
        The measured curves.
    predictor
        Predicts the curves.
    """

    def __init__(self, dataset: Dataset, observed: Observed, predictor: Predicting) -> None:
        self._dataset, self._observed, self._predictor = dataset, observed, predictor
        self._smooth = True  # until some stalk is found to jump

    def baseline(self) -> Fitted:
        """Fit the factors of every specimen."""
        used = factors(self._dataset.baseline, self._dataset.layout.fit)
        here = np.zeros((self._observed.blocks.number, len(used)))
        curves = self._linearised(Model(used, here), {})
        for number in range(ROUNDS):
            fitted = Fitted(curves, self.fit(curves, {}))
            if fitted.steady or number == ROUNDS - 1:
                break
            try:
                curves = self._move(curves.model, fitted.fit, {}, {})
            except SpecificationError as error:
                log.info("the baseline cannot be fitted any better: %s", error)
                break
        return fitted

    def fit(
        self,
        curves: Linearised,
        effects: Mapping[str, Effect],
        chosen: tuple[str, ...] = (),
        broken: frozenset[int] | None = None,
    ) -> Fit:
        """Fit a set of effects, see `Linearised.at`.

        Each fit begins where the one before ended, or halfway there, because whole steps may
        oscillate.

        Parameters
        ----------
        curves
            Curves linearised near where the set fits.
        effects
            The suspects.
        chosen
            Names of those that are present.
        broken
            Indices of specimens taken for broken; by default these are found.
        """
        specimen = self._observed.blocks.specimen
        there, scatter = curves, None
        for number in range(REFITS):
            evidence = self.evidence(there, effects)
            if broken is None:
                evidence = find_broken(evidence, chosen)
            else:
                evidence = dataclasses.replace(evidence, broken=broken)
            scatter = fit_scatter(evidence, chosen, scatter)
            fit = Fit(evidence, chosen, scatter)
            here = there.model.log_factors
            step = fit.log_factors - here
            if np.abs(step)[evidence.whole].max() < CLOSE_FIT:
                break
            moved = np.clip(
                here + step / min(number + 1, 2) - curves.model.log_factors, -FARTHEST, FARTHEST
            )
            there = curves.at(curves.model.log_factors + moved, specimen)
        return fit

    def screen(self, baseline: Fitted, effects: Mapping[str, Effect]) -> Linearised:
        """Find the signature of every effect, at its typical amplitude, at the baseline."""
        return self._linearised(baseline.curves.model, effects)

    def _linearised(self, model: Model, effects: Mapping[str, Effect]) -> Linearised:
        """Linearise where no other model would do, by differences if some stalk jumps."""
        if self._smooth:
            try:
                return self._predictor.linearise(model, effects, smooth=True)
            except SpecificationError as error:
                log.info("some stalk jumps: %s", error)
                self._smooth = False
        return self._predictor.linearise(model, effects)

    def without_simulations(self, effects: Mapping[str, Effect]) -> list[str]:
        """Return the effects that need no simulations, such as errors of the machine."""
        tests = [record.test for record in self._dataset.records]
        return [name for name, effect in effects.items() if not needs_simulation(effect, tests)]

    def compare(
        self,
        curves: Linearised,
        effects: Mapping[str, Effect],
        start: tuple[str, ...] = (),
        impossible: Collection[tuple[str, ...]] = (),
    ) -> tuple[Evidence, Causes]:
        """Compare all sets of effects, without specimens that are broken if the best set is right.

        Parameters
        ----------
        curves, effects
            Linearised curves, and the suspects whose signatures they include.
        start
            A probable set, with which broken specimens are sought first.
        impossible
            Sets that are not compared.
        """
        evidence = find_broken(self.evidence(curves, effects), start)
        causes = find_causes(evidence, impossible)
        again = find_broken(evidence, causes.best)
        if again.broken == evidence.broken:
            return evidence, causes
        return again, find_causes(again, impossible)

    def move(
        self, fitted: Fitted, effects: Mapping[str, Effect], within: float = 1.0
    ) -> Linearised:
        """Simulate near where a set of effects fits, and find the signatures there.

        Errors of what few simulations predict are those found where all curves were simulated last.

        Parameters
        ----------
        fitted, effects
            The fit, and its effects.
        within
            Distance, see `Fitted`, within which specimens and amplitudes stay where they are.

        Raises
        ------
        SpecificationError
            If that is not possible, even for smaller amplitudes.
        """
        added = {n: (effect, fitted.fit.amplitudes[n]) for n, effect in effects.items()}
        moved = self._move(fitted.curves.model, fitted.fit, added, effects, within)
        known = fitted.curves.correction
        return dataclasses.replace(moved, force=moved.force + known, correction=known)

    def without(self, fitted: Fitted, broken: frozenset[int]) -> Fitted:
        """Return a fit repeated without effects, with certain specimens taken for broken."""
        return dataclasses.replace(fitted, fit=self.fit(fitted.curves, {}, (), broken))

    def confirm(self, curves: Linearised, tolerance: float) -> Linearised:
        """Return the same curves with all forces simulated, and what that shows for the next move.

        See `Predictor.confirm`.
        """
        exact = self._predictor.confirm(curves, tolerance)
        # again, as more curves have been simulated since the first time
        few = self._predictor.linearise(curves.model, {}, self._smooth, roughly=True)
        return dataclasses.replace(exact, correction=exact.force - few.force)

    def confirmed(self, fitted: Fitted, effects: Mapping[str, Effect]) -> Fitted:
        """Fit again at the same parameters, with every curve simulated."""
        curves, fit = self._predictor.confirm(fitted.curves), fitted.fit
        return Fitted(curves, self.fit(curves, effects, fit.chosen, fit.evidence.broken))

    def evidence(self, curves: Linearised, effects: Mapping[str, Effect]) -> Evidence:
        """Return the evidence of a linearised model."""
        return linear_evidence(curves, self._observed, effects, self._dataset.layout.fit_sd)

    def _move(
        self,
        model: Model,
        fit: Fit,
        added: Mapping[str, tuple[Effect, float]],
        suspects: Mapping[str, Effect],
        within: float = 1.0,
    ) -> Linearised:
        """Move to fitted parameters, or as far as simulations reach the end without a new jump.

        A specimen whose factors are to turn back goes half as far as before, as whole steps may
        oscillate; otherwise twice as far, up to all the way. Amplitudes go as far as specimens do
        on average; one that is to turn back goes to where, by interpolation, it would stay.

        Specimens and amplitudes that are near enough stay where they have been simulated, so that
        one specimen that moves does not make all others be simulated again.
        """
        here = model.log_factors
        step = np.clip(fit.log_factors - here, -FARTHEST, FARTHEST)
        near = np.abs(step).max(axis=1) < within * STEADY
        if near[fit.evidence.whole].all():
            near[:] = True
        step[near] = 0.0
        share: Array = np.ones(len(here))
        if model.step is not None and model.effects.keys() == added.keys():
            back = (step * model.step).sum(axis=1) < 0.0
            share = np.where(back, model.share / 2.0, np.minimum(2.0 * model.share, 1.0))
        before, changes = {}, {}
        for name, (effect, amplitude) in added.items():
            start, most = model.amplitude(name), abs(effect.typical)
            before[name] = start, amplitude - start
            change = _amplitude_step(model, name, amplitude)
            close = within * STEADY_ERRORS
            if name in model.effects and abs(amplitude - start) <= close * fit.sd(name):
                change = 0.0
            changes[name] = float(np.clip(change, -most, most))
        while True:
            mean = float(share.mean())
            effects = {
                name: (effect, before[name][0] + mean * changes[name])
                for name, (effect, _) in added.items()
            }
            moved = share[:, None] * step
            wanted = Model(model.factors, here + moved, effects, moved, share, before)
            amounts = {name: amplitude for name, (_, amplitude) in effects.items()}
            log.info("moving %.3g of the way, to the effects %s", mean, amounts)
            try:
                return self._predictor.linearise(wanted, suspects, self._smooth, roughly=True)
            except SpecificationError:
                share /= 2.0
                if mean < 2.0 * SHORTEST:
                    raise


def _amplitude_step(model: Model, name: str, fitted: float) -> float:
    """Return the change of an amplitude towards the fitted one, without oscillating around it."""
    here = model.amplitude(name)
    last, wanted = model.before.get(name, (here, 0.0))
    change = fitted - here
    if change * (here - last) < 0.0 and change * wanted < 0.0:
        return change * (here - last) / (wanted - change)
    return change


def linear_evidence(
    curves: Linearised, observed: Observed, effects: Mapping[str, Effect], factor_sd: float
) -> Evidence:
    """Return the evidence of a linearised model.

    Its residuals are extrapolated by the derivatives to the model without factors and effects, so
    that priors stay the same wherever the model is linearised.
    """
    model, blocks, peak = curves.model, observed.blocks, observed.peak_N[:, None]
    by_own, by_common = curves.by_own / peak[..., None], curves.by_common / peak[..., None]
    own = (model.log_factors - model.median)[blocks.specimen]
    residual = (observed.force_N - curves.force) / peak
    residual += np.einsum("rk,rkm->rm", own, by_own)
    residual += np.einsum("k,rkm->rm", model.median, by_common)
    signatures = {name: change / peak for name, change in curves.by_effects.items()}
    for name, (_, amplitude) in model.effects.items():
        residual += amplitude * signatures[name]
    errors = MODEL_ERROR * smooth(*residual.shape)
    nuisance = np.concatenate([curves.by_mesh / peak[..., None], errors], axis=1)
    suspects = {n: Suspect(effects[n], signatures[n]) for n in effects if n in signatures}
    return Evidence(residual, by_common, by_own, nuisance, factor_sd, blocks, suspects)

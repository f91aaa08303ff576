"""Fitting of factors and of effects with them, by repeated linearisation."""

from __future__ import annotations

import dataclasses
import logging
from collections.abc import Collection, Mapping
from dataclasses import dataclass

import numpy as np

from ramiefenics.discovery.broken import find_broken
from ramiefenics.discovery.causes import NEGLIGIBLE, Causes, find_causes
from ramiefenics.discovery.evidence import MODEL_ERROR, Evidence, Suspect
from ramiefenics.discovery.factors import factors
from ramiefenics.discovery.fit import Fit
from ramiefenics.discovery.fit_scatter import fit_scatter
from ramiefenics.discovery.linearised import Linearised, Model
from ramiefenics.discovery.observed import Observed
from ramiefenics.discovery.prediction import Predictor, smooth
from ramiefenics.effects import Effect
from ramiefenics.measured import Dataset
from ramiefenics.runs.curve import Mapper
from ramiefenics.specification import SpecificationError

log = logging.getLogger(__name__)

ROUNDS = 5
"""Most linearisations of a fit."""

MOST_SETS = 3
"""Most sets of effects that are fitted one after the other."""

STEADY, STEADY_ERRORS = 0.1, 0.5
"""Changes of log factors, and of an amplitude over its standard deviation, that need no further
linearisation."""

FARTHEST = 0.5
"""Largest change of a log factor in a round: beyond it derivatives tell little."""

SHORTEST = 0.1
"""Share of a move that is tried last where simulations do not reach the end."""

CONTENDERS = 6
"""Most effects whose signatures are found anew where the most probable set is fitted."""


@dataclass(frozen=True)
class Fitted:
    """A model fitted to all curves.

    Attributes
    ----------
    curves
        Its predictions, linearised near where it was fitted.
    fit
        Of the linearised model.
    """

    curves: Linearised
    fit: Fit

    @property
    def steady(self) -> bool:
        """Whether the curves are linearised near enough to what was fitted."""
        model, fit = self.curves.model, self.fit
        whole = fit.evidence.whole
        moves = np.abs(fit.log_factors - model.log_factors)[whole].max()
        near = all(  # at a bound there is no deviation
            abs(amplitude - model.amplitude(name)) <= STEADY_ERRORS * fit.sd(name)
            for name, amplitude in fit.amplitudes.items()
        )
        same = set(fit.chosen) == set(model.effects)
        return bool(same and near and moves < STEADY)


@dataclass(frozen=True)
class Compared:
    """All sets of effects, compared at one linearisation."""

    curves: Linearised
    evidence: Evidence
    causes: Causes

    def fit(self, names: tuple[str, ...]) -> Fit:
        """Return the fit of a set."""
        best = names == self.causes.best
        scatter = self.causes.scatter if best else fit_scatter(self.evidence, names)
        return Fit(self.evidence, names, scatter)


class Fitter:
    """Fits models to a data set.

    Parameters
    ----------
    dataset, observed
        The measured curves.
    predictor
        Predicts them.
    """

    def __init__(self, dataset: Dataset, observed: Observed, predictor: Predictor) -> None:
        self._dataset, self._observed, self._predictor = dataset, observed, predictor
        self._smooth = True  # no stalk jumps

    def baseline(self) -> Fitted:
        """Fit the factors of every specimen."""
        used = factors(self._dataset.baseline, self._dataset.layout.fit)
        here = np.zeros((self._observed.blocks.number, len(used)))
        try:
            curves = self._predictor.linearise(Model(used, here), {}, smooth=True)
        except SpecificationError:
            self._smooth = False
            curves = self._predictor.linearise(Model(used, here), {})
        for number in range(ROUNDS):
            fitted = Fitted(curves, self._fit(curves))
            if fitted.steady or number == ROUNDS - 1:
                break
            try:
                curves = self._move(curves.model, fitted.fit, {}, {})
            except SpecificationError as error:
                log.info("the baseline cannot be fitted any better: %s", error)
                break
        return fitted

    def _fit(self, curves: Linearised) -> Fit:
        evidence = find_broken(self.evidence(curves, {}), ())
        return Fit(evidence, (), fit_scatter(evidence))

    def screen(self, baseline: Fitted, effects: Mapping[str, Effect]) -> Linearised:
        """Find what every effect changes at its typical amplitude."""
        return self._predictor.linearise(baseline.curves.model, effects, self._smooth)

    def compare(
        self,
        curves: Linearised,
        effects: Mapping[str, Effect],
        start: tuple[str, ...] = (),
        impossible: Collection[tuple[str, ...]] = (),
    ) -> tuple[Evidence, Causes]:
        """Compare all sets of effects, without specimens that are broken if the best is right.

        Parameters
        ----------
        curves, effects
            With signatures of these.
        start
            A set that is probable.
        impossible
            Sets that are not compared.
        """
        evidence = find_broken(self.evidence(curves, effects), start)
        causes = find_causes(evidence, impossible)
        again = find_broken(evidence, causes.best)
        if again.broken == evidence.broken:
            return evidence, causes
        return again, find_causes(again, impossible)

    def joint(
        self,
        screened: Linearised,
        causes: Causes,
        evidence: Evidence,
        effects: Mapping[str, Effect],
    ) -> tuple[Fitted, Causes, dict[tuple[str, ...], str]]:
        """Fit the most probable set in the finite-element model, and compare all sets there.

        Where another set is more probable there, that is fitted next, until one is the most
        probable where it fits itself. If none is, that which explains the curves best where it
        fits itself is returned. Sets that cannot be simulated near where they fit are told with
        the reason, and are not compared any more.
        """
        here = Compared(screened, evidence, causes)
        refused: dict[tuple[str, ...], str] = {}
        fitted: dict[tuple[str, ...], Compared] = {}
        while (names := here.causes.best) not in fitted and len(fitted) < MOST_SETS:
            try:
                here = self._fit_set(names, here, screened, effects, refused)
            except SpecificationError as error:
                refused[names] = str(error)
                here = dataclasses.replace(here, causes=find_causes(here.evidence, refused))
                continue
            fitted[names] = here
        if fitted.get(names) is not here:
            names = max(fitted, key=lambda tried: fitted[tried].causes.score(tried))
            here = fitted[names]
            here = dataclasses.replace(here, causes=find_causes(here.evidence, refused))
        return Fitted(here.curves, here.fit(names)), here.causes, refused

    def _fit_set(
        self,
        names: tuple[str, ...],
        here: Compared,
        screened: Linearised,
        effects: Mapping[str, Effect],
        refused: Collection[tuple[str, ...]],
    ) -> Compared:
        """Fit a set of effects, and compare all sets there.

        The signatures of the contenders are found anew; those of others stay.
        """
        for _ in range(ROUNDS):
            fit = here.fit(names)
            if Fitted(here.curves, fit).steady:
                break
            near = {name: effects[name] for name in _contenders(names, here.causes)}
            added = {name: (effects[name], fit.amplitudes[name]) for name in names}
            curves = self._move(here.curves.model, fit, added, near)
            by_effects = {**screened.by_effects, **curves.by_effects}
            curves = dataclasses.replace(curves, by_effects=by_effects)
            here = Compared(curves, *self.compare(curves, effects, names, refused))
        return here

    def without(self, fitted: Fitted, broken: frozenset[int]) -> Fitted:
        """Return a fit in which certain specimens are taken for broken."""
        evidence = dataclasses.replace(fitted.fit.evidence, broken=broken)
        scatter = fit_scatter(evidence, fitted.fit.chosen)
        return dataclasses.replace(fitted, fit=Fit(evidence, fitted.fit.chosen, scatter))

    def confirmed(self, fitted: Fitted, effects: Mapping[str, Effect], runs: Mapper) -> Fitted:
        """Fit again near the same parameters, with every curve simulated."""
        curves = self._predictor.confirm(fitted.curves, runs)
        evidence = dataclasses.replace(
            self.evidence(curves, effects), broken=fitted.fit.evidence.broken
        )
        chosen = fitted.fit.chosen
        return Fitted(curves, Fit(evidence, chosen, fit_scatter(evidence, chosen)))

    def evidence(self, curves: Linearised, effects: Mapping[str, Effect]) -> Evidence:
        """Return the evidence of a linearised model."""
        return linear_evidence(curves, self._observed, effects, self._dataset.layout.fit_sd)

    def _move(
        self,
        model: Model,
        fit: Fit,
        added: Mapping[str, tuple[Effect, float]],
        suspects: Mapping[str, Effect],
    ) -> Linearised:
        """Go to fitted parameters, or as far as simulations reach the end without a new jump."""
        here = model.log_factors
        step = np.clip(fit.log_factors - here, -FARTHEST, FARTHEST)
        share = 1.0
        while True:
            effects = {}
            for name, (effect, amplitude) in added.items():
                start = model.amplitude(name)
                effects[name] = (effect, start + share * (amplitude - start))
            wanted = dataclasses.replace(model, log_factors=here + share * step, effects=effects)
            amounts = {name: amplitude for name, (_, amplitude) in effects.items()}
            log.info("moving by %.3g of the way, to effects %s", share, amounts)
            try:
                return self._predictor.linearise(wanted, suspects, self._smooth)
            except SpecificationError:
                share /= 2.0
                if share < SHORTEST:
                    raise


def linear_evidence(
    curves: Linearised, observed: Observed, effects: Mapping[str, Effect], factor_sd: float
) -> Evidence:
    """Return the evidence of a linearised model.

    Its residuals are those of the model with no factors and no effect, by the derivatives: so
    priors stay where they were, wherever the model is linearised.
    """
    model, blocks, peak = curves.model, observed.blocks, observed.peak_N[:, None]
    by_factors = curves.by_factors / peak[..., None]
    residual = (observed.force_N - curves.force) / peak
    residual += np.einsum("rk,rkm->rm", model.log_factors[blocks.specimen], by_factors)
    signatures = {name: change / peak for name, change in curves.by_effects.items()}
    for name, (_, amplitude) in model.effects.items():
        residual += amplitude * signatures[name]
    own = MODEL_ERROR * smooth(*residual.shape)
    nuisance = np.concatenate([curves.by_mesh / peak[..., None], own], axis=1)
    suspects = {n: Suspect(effects[n], signatures[n]) for n in effects if n in signatures}
    return Evidence(residual, by_factors, nuisance, factor_sd, blocks, suspects)


def _contenders(names: tuple[str, ...], causes: Causes) -> list[str]:
    """Return effects that are fitted, and the most probable others."""
    inclusion = causes.inclusion()
    others = [n for n in inclusion if n not in names and inclusion[n] > NEGLIGIBLE]
    others.sort(key=lambda name: -inclusion[name])
    return [*names, *others[: CONTENDERS - len(names)]]

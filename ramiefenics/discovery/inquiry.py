"""From measured curves to what the simulation gets wrong, its causes, and the gain by these."""

from __future__ import annotations

import dataclasses
import logging
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import numpy as np

from ramiefenics.discovery.anatomy import Anatomist, Anatomy
from ramiefenics.discovery.curves.both_ways import predictor_of
from ramiefenics.discovery.curves.linearised import Linearised
from ramiefenics.discovery.curves.meshes import on_mesh
from ramiefenics.discovery.curves.observed import observe
from ramiefenics.discovery.planning.plan import Plan, planned
from ramiefenics.discovery.planning.power import Design
from ramiefenics.discovery.report.outcome import Discovery
from ramiefenics.discovery.search.fitted import Fitted
from ramiefenics.discovery.search.fitting import Fitter
from ramiefenics.discovery.search.search import Search
from ramiefenics.discovery.statistics.bootstrap import p_value_of_effect, p_value_of_misfit
from ramiefenics.discovery.statistics.causes import Causes
from ramiefenics.discovery.statistics.fit import Fit
from ramiefenics.discovery.statistics.gain import condition_gain, gains
from ramiefenics.discovery.statistics.hidden import Limit, cosines, limits
from ramiefenics.discovery.statistics.verdict import (
    IMPROBABLE,
    INDIFFERENT,
    SIGNIFICANCE,
    UNFITTED,
    decide,
    resting_on_one,
    without_fit,
)
from ramiefenics.effects import EFFECTS, SUSPECTS, Effect
from ramiefenics.measured import Dataset, read_dataset
from ramiefenics.measured.unloading import unloads, with_unloading
from ramiefenics.runs import lasting
from ramiefenics.runs.curve import Mapper
from ramiefenics.specification import MeshRecipe, SpecificationError, mesh_recipe
from ramiefenics.surrogate import LearnedCurves

log = logging.getLogger(__name__)

INVISIBLE = 2.0
"""Change of the curves, in standard deviations, that a suspect must make at its largest amplitude;
if it makes less, it cannot be tested with these data."""

MOST_OPEN = 4
"""Number of suspects between which the next experiment is to decide if the fitted factors conflict
with what was stated of them; these are the suspects that may be largest."""


def discover(
    dataset: Dataset | str | Path,
    effects: Mapping[str, Effect] | None = None,
    mesh: str | None = None,
    runs: Mapper | None = None,
    seed: int = 0,
    on_stage: Callable[[str, int], None] | None = None,
) -> Discovery:
    """Find out what the baseline lacks.

    Parameters
    ----------
    dataset
        Measured data, or the folder that contains them, see `read_dataset`.
    effects
        Suspects; by default the effects that the curves may show: all shipped effects where there
        is unloading, otherwise `SUSPECTS`.
    mesh
        Mesh recipe of all simulations; by default that of the data set.
    runs
        Runs the simulations; by default on all cores, with results kept in the user's cache.
    seed
        Seed of the random draws behind probabilities and intervals.
    on_stage
        Called before each stage with its name and the approximate number of simulations expected.

    Raises
    ------
    SpecificationError
        If the folder has a defect, or the baseline cannot be simulated.
    """
    if not isinstance(dataset, Dataset):
        dataset = read_dataset(dataset)
    effects = suspects_of(dataset) if effects is None else effects
    effects = {**effects, **_in_single_groups(effects, dataset)}
    recipe = dataset.layout.mesh if mesh is None else mesh_recipe(mesh)
    dataset = _on_mesh(with_unloading(dataset), recipe)
    with lasting(runs) as runs:
        return _Inquiry(dataset, effects, runs, seed, on_stage).conclude()


def suspects_of(dataset: Dataset) -> Mapping[str, Effect]:
    """Return the shipped effects that the curves of a data set may show."""
    return EFFECTS if unloads(dataset) else SUSPECTS


def _in_single_groups(effects: Mapping[str, Effect], dataset: Dataset) -> dict[str, Effect]:
    """Return the effects that may be present in one group of tests only, in each group."""
    groups = sorted({record.test.group for record in dataset.records})
    if len(groups) == 1:
        return {}
    single = [effect for effect in effects.values() if effect.by_group]
    each = [effect.within(group) for effect in single for group in groups if group]
    return {effect.name: effect for effect in each}


class _Inquiry:
    """The steps of `discover`, and the data that they share."""

    def __init__(
        self,
        dataset: Dataset,
        effects: Mapping[str, Effect],
        runs: Mapper,
        seed: int,
        on_stage: Callable[[str, int], None] | None,
    ) -> None:
        tests = [record.test for record in dataset.records]
        self._dataset = dataset
        self._stage = on_stage or (lambda stage, expected: None)
        self._effects = {n: effect.centred(tests).as_found(tests) for n, effect in effects.items()}
        self._runs = LearnedCurves(runs)
        self._observed = observe(dataset)
        self._predictor = predictor_of(tests, self._observed, self._runs)
        self._fitter = Fitter(dataset, self._observed, self._predictor)
        self._rng = np.random.default_rng(seed)
        self._reasons: dict[str, str] = {}

    def conclude(self) -> Discovery:
        """Carry out all steps."""
        number = len(self._dataset.records)
        self._stage("fitting the baseline", 3 * number)
        baseline = self._fitter.baseline()
        self._stage("trying every suspect", number * len(self._effects))
        curves, seen = self._signatures(baseline)
        evidence, causes = self._fitter.compare(curves, seen)
        nothing = Fit(evidence, (), causes.nothing)
        before = p_value_of_misfit(nothing, self._rng)
        self._stage("fitting the most probable sets of suspects", 3 * number)
        search = Search(self._fitter, curves, seen)
        best, causes = search.best(evidence, causes)
        alone, none = search.sets.gains(len(seen)), search.sets.none
        p_value = p_value_of_effect(evidence, nothing.scatter, self._rng, alone)
        shown = p_value < SIGNIFICANCE or none < IMPROBABLE
        extended = best if shown and best.fit.chosen else None
        for names, reason in search.refused.items():
            self._reasons |= dict.fromkeys(names, f"{' with '.join(names)}: {reason}")
        if extended is not None:
            extended = self._simulated(extended, seen)
            baseline = self._simulated(search.sets[()].fitted, {})
            baseline = self._fitter.without(baseline, extended.fit.evidence.broken)
        rivals = [search.sets[n].fitted.fit for n in causes.probable() if n in search.sets]
        fits = [nothing if extended is None else extended.fit, *rivals]
        return self._discovery(baseline, fits, extended, causes, (p_value, none), before)

    def _simulated(self, fitted: Fitted, effects: Mapping[str, Effect]) -> Fitted:
        """Return a fit repeated with every curve simulated; as it is, if one ends too early."""
        try:
            return self._fitter.confirmed(fitted, effects)
        except SpecificationError as error:
            log.info("some learned curves cannot be replaced by simulations: %s", error)
            return fitted

    def _signatures(self, baseline: Fitted) -> tuple[Linearised, dict[str, Effect]]:
        """Return the signatures of all suspects, and the suspects that these curves can show."""
        curves = self._fitter.screen(baseline, self._effects)
        self._reasons |= curves.refused
        evidence = self._fitter.evidence(curves, self._effects)
        gram = evidence.whiten(baseline.fit.scatter).reduce().gram
        seen = {}
        for name, square, bounds in zip(
            evidence.names, np.diag(gram), evidence.bounds, strict=True
        ):
            if square**0.5 * np.abs(bounds).max() < INVISIBLE:
                self._reasons[name] = INDIFFERENT
            else:
                seen[name] = self._effects[name]
        return curves, seen

    def _accepted(self, fit: Fit, causes: Causes) -> tuple[tuple[tuple[str, ...], ...], bool]:
        """Return the groups that may be named, and whether one only rests on a single specimen."""
        unfitted, alone = without_fit(fit, causes), resting_on_one(fit, causes)
        for name, (specimen, gain) in alone.items():
            who = self._dataset.specimens[specimen]
            without = f"without it the log-evidence gain is {gain:.1f}"
            self._reasons[name] = f"rests on {who} alone: {without}"
        self._reasons |= dict.fromkeys(sorted(unfitted), UNFITTED)
        refused = unfitted.union(alone)
        return tuple(g for g in causes.groups() if refused.isdisjoint(g)), bool(alone)

    def _plan(
        self, verdict: str, groups: Sequence[Sequence[str]], fit: Fit, told: Mapping[str, Limit]
    ) -> Plan | None:
        """Return how well second tests would separate the effects left open, if any are."""
        if verdict == "ambiguous":
            names = [name for group in groups if len(group) > 1 for name in group]
        elif verdict == "conflict":
            names = sorted(told, key=lambda name: -told[name].share)[:MOST_OPEN]
        else:
            return None
        everywhere = dict.fromkeys(self._effects[name].base_name for name in names)
        effects = {name: self._effects[name] for name in everywhere}
        if len(effects) == 1:  # the same effect in different groups
            return None
        layout, (_, travel) = self._dataset.layout, self._dataset.range_mm
        scatter = fit.scatter
        design = Design(
            max(len(fit.evidence.whole), 2),
            layout.fit_sd,
            float(np.mean(scatter.own)),
            scatter.noise,
            scatter.drift,
            scatter.length,
        )
        test = on_mesh(self._dataset.baseline, self._dataset.records[0].test.numerics.mesh)
        protocol = dataclasses.replace(test.protocol, travel_mm=travel, save_every_mm=travel)
        self._stage("planning the next experiment", 3 * (1 + len(effects)))
        try:
            test = dataclasses.replace(test, protocol=protocol)
            known = self._predictor.mesh_changes
            return planned(test, None, design, effects, self._runs, known)
        except SpecificationError as error:
            log.info("the next experiment cannot be planned: %s", error)
            return None

    def _anatomy(self, baseline: Fitted) -> Anatomy:
        """Learn inside the model what no suspect explains, with every curve simulated."""
        records = self._dataset.records
        self._stage("learning what is missing", 3 * len(records))
        tests = [record.test for record in records]
        simulating = self._predictor.rephrased(tests, self._runs.runs)
        anatomist = Anatomist(self._dataset, self._observed, simulating)
        learned, log_gains = anatomist.learn(baseline)
        gain, shape = gains(self._observed, baseline.fit, learned.fit, self._rng)
        return Anatomy(
            log_evidence_gains=log_gains,
            learned=learned,
            test=baseline.curves.model.test(self._dataset.baseline, learned.fit.mean_log_factors),
            misfit_p_value=p_value_of_misfit(learned.fit, self._rng),
            gain=gain,
            shape_gain=shape,
        )

    def _discovery(
        self,
        baseline: Fitted,
        fits: Sequence[Fit],
        extended: Fitted | None,
        causes: Causes,
        no_effect: tuple[float, float],
        before: float,
    ) -> Discovery:
        last = fits[0]
        left = before if extended is None else p_value_of_misfit(last, self._rng)
        groups, alone = ((), False) if extended is None else self._accepted(last, causes)
        conflict = last.conflict()
        gain = shape = elsewhere = None
        if extended is not None:
            gain, shape = gains(self._observed, baseline.fit, last, self._rng)
            elsewhere = condition_gain(
                self._observed, self._dataset.conditions, baseline.fit, last, self._rng
            )
        told = limits(fits, causes, [factor.name for factor in baseline.curves.model.factors])
        p_value, fitted_none = no_effect
        shown = p_value < SIGNIFICANCE or extended is not None
        verdict = decide(shown, left, conflict, groups, alone)
        return Discovery(
            dataset=self._dataset,
            observed=self._observed,
            effects=self._effects,
            verdict=verdict,
            groups=groups,
            p_value=p_value,
            fitted_none=fitted_none,
            baseline_misfit_p_value=before,
            misfit_p_value=left,
            conflict_p_value=conflict,
            posterior=causes,
            reasons=self._reasons,
            baseline=baseline,
            extended=extended,
            limits=told,
            plan=self._plan(verdict, groups, last, told),
            alike=cosines(last),
            gain=gain,
            shape_gain=shape,
            condition_gain=elsewhere,
            anatomy=self._anatomy(baseline) if verdict == "unknown" else None,
            effort=self._runs.effort,
        )


def _on_mesh(dataset: Dataset, mesh: MeshRecipe) -> Dataset:
    """Return the data set with all tests on the given mesh recipe."""
    records = tuple(dataclasses.replace(r, test=on_mesh(r.test, mesh)) for r in dataset.records)
    return dataclasses.replace(dataset, records=records)

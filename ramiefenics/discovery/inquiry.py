"""Measured curves in; out what the simulation gets wrong, its cause, and what naming it gains."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import numpy as np

from ramiefenics.discovery.comparison import Simulator, observe
from ramiefenics.discovery.evidence import Array
from ramiefenics.discovery.fitting import Fitted, Fitter
from ramiefenics.discovery.meshes import on_mesh
from ramiefenics.discovery.outcome import Discovery, Effort
from ramiefenics.discovery.verdict import (
    MISFIT,
    MODEL_ERROR,
    RIVAL,
    SIGNIFICANCE,
    Score,
    bootstrap_p_value,
    gains_without_each,
    measure_gain,
    misfit_chance,
    rivals,
)
from ramiefenics.effects import SUSPECTS, Effect
from ramiefenics.measured import Dataset, read_dataset
from ramiefenics.runs import Runs, workers
from ramiefenics.runs.curve import Mapper
from ramiefenics.specification import MeshRecipe, SpecificationError, mesh_recipe
from ramiefenics.surrogate import LearnedCurves

CONTENDERS, CONTENDER_GAIN, CONTENDER_RANGE = 3, 1.0, 5.0
"""Most suspects that are fitted in full, what they must gain before, and how far behind the best
one they may be, log-likelihood."""

INVISIBLE = 2.0
"""A suspect whose largest amplitude makes less of a difference, in standard deviations, cannot be
tested with these data."""

ALIKE = 0.9
"""Cosine of two signatures that are easily mistaken for one another."""


def discover(
    dataset: Dataset | str | Path,
    effects: Mapping[str, Effect] = SUSPECTS,
    mesh: str | None = None,
    runs: Mapper | None = None,
    seed: int = 0,
    on_stage: Callable[[str, int], None] = lambda stage, expected: None,
) -> Discovery:
    """Find out what the baseline lacks.

    Parameters
    ----------
    dataset
        Measured data, or their folder, see `read_dataset`.
    effects
        Suspects.
    mesh
        Recipe of all simulations; by default that of the data set.
    runs
        Does the simulations; on all cores, kept in the user's cache by default.
    seed
        Of the random draws behind probabilities and intervals.
    on_stage
        Told what is being done, and about how many simulations are left.

    Raises
    ------
    SpecificationError
        If the folder has a defect, or the baseline cannot be simulated.
    """
    if not isinstance(dataset, Dataset):
        dataset = read_dataset(dataset)
    recipe = dataset.layout.mesh if mesh is None else mesh_recipe(mesh)
    dataset = _on_mesh(dataset, recipe)
    if runs is not None:
        return _Inquiry(dataset, effects, runs, seed, on_stage).conclude()
    with workers() as pool:
        return _Inquiry(dataset, effects, Runs(executor=pool), seed, on_stage).conclude()


class _Inquiry:
    """The steps of `discover`, and what they share."""

    def __init__(
        self,
        dataset: Dataset,
        effects: Mapping[str, Effect],
        runs: Mapper,
        seed: int,
        on_stage: Callable[[str, int], None],
    ) -> None:
        tests = [specimen.test for specimen in dataset.specimens]
        self._dataset, self._stage = dataset, on_stage
        self._effects = {name: effect.centred(tests) for name, effect in effects.items()}
        self._runs = LearnedCurves(runs)
        self._observed = observe(dataset)
        self._simulator = Simulator(dataset, self._observed.at_mm, self._runs)
        self._fitter = Fitter(dataset, self._observed, self._simulator)
        self._rng = np.random.default_rng(seed)
        self._chances = 1.0, 1.0

    def conclude(self) -> Discovery:
        """Do all steps."""
        number, suspects = len(self._dataset.specimens), len(self._effects)
        self._stage("fitting the baseline", number * (3 + suspects))
        baseline = self._fitter.baseline()
        self._stage("trying every suspect", number * suspects)
        signatures, scores = self._suspects(baseline)
        fits = self._contenders(baseline, signatures, scores)
        self._chances = self._chance(baseline, signatures, scores), self._misfit(baseline)
        if self._chances[0] < SIGNIFICANCE:
            fits = self._steady(baseline, fits, scores)
            if fits:
                return self._name(baseline, signatures, fits, scores)
        verdict = "none" if self._chances[1] >= SIGNIFICANCE else "unknown"
        return self._discovery(verdict, scores, baseline)

    def _suspects(self, baseline: Fitted) -> tuple[dict[str, Array], dict[str, Score]]:
        signatures: dict[str, Array] = {}
        scores: dict[str, Score] = {}
        scatter = baseline.fit.scatter
        for name, effect in self._effects.items():
            try:
                changed = self._simulator.signature(baseline.curves, effect)
            except SpecificationError as error:
                scores[name] = Score(None, reason=str(error))
                continue
            signature = changed / self._observed.peak_N[:, None]
            size = baseline.evidence.products(scatter, signature[None])[0, 0] ** 0.5
            if size * max(map(abs, effect.bounds)) < INVISIBLE:
                scores[name] = Score(None, reason="makes no difference to these curves")
                continue
            fit = baseline.evidence.fit(signature, effect.bounds)
            gain = fit.log_likelihood - baseline.fit.log_likelihood
            signatures[name] = signature
            scores[name] = Score(gain, fit.amplitude, fit.error)
        return signatures, scores

    def _contenders(
        self,
        baseline: Fitted,
        signatures: dict[str, Array],
        scores: dict[str, Score],
    ) -> dict[str, Fitted]:
        """Fit the best suspects in full: far from the baseline its derivatives tell little."""
        gains = {name: scores[name].log_likelihood_ratio or 0.0 for name in signatures}
        order = sorted(gains, key=lambda name: -gains[name])
        fits = {}
        for name in order[:CONTENDERS]:
            if gains[name] < max(CONTENDER_GAIN, gains[order[0]] - CONTENDER_RANGE):
                break
            self._stage(f"fitting {name}", 4 * len(self._dataset.specimens))
            try:
                fitted = self._fitter.extended(
                    baseline, self._effects[name], scores[name].amplitude
                )
            except SpecificationError as error:
                del signatures[name]
                scores[name] = Score(None, reason=str(error))
                continue
            gain = 0.0
            if fitted.amplitude != 0.0:
                fits[name] = fitted
                gain = fitted.fit.log_likelihood - baseline.fit.log_likelihood
            scores[name] = Score(gain, fitted.amplitude, fitted.fit.error)
        return fits

    def _chance(
        self, baseline: Fitted, signatures: Mapping[str, Array], scores: Mapping[str, Score]
    ) -> float:
        """Return the probability of the best suspect's gain without any effect."""
        if not signatures:
            return 1.0
        return bootstrap_p_value(
            baseline.evidence,
            baseline.fit,
            np.array(list(signatures.values())),
            [self._effects[name].bounds for name in signatures],
            max(scores[name].log_likelihood_ratio or 0.0 for name in signatures),
            self._rng,
        )

    def _steady(
        self, baseline: Fitted, fits: Mapping[str, Fitted], scores: dict[str, Score]
    ) -> dict[str, Fitted]:
        """Return the contenders that gain enough whichever specimen is left out."""
        steady = {}
        for name, fitted in fits.items():
            assert fitted.signature is not None  # it has an effect
            gains = gains_without_each(
                baseline.evidence, fitted.evidence, fitted.signature, self._effects[name].bounds
            )
            if gains.min() >= RIVAL:
                steady[name] = fitted
            elif (scores[name].log_likelihood_ratio or 0.0) >= RIVAL:
                who = self._dataset.specimens[int(gains.argmin())].name
                reason = f"rests on {who}: without it the gain is {gains.min():.1f}"
                scores[name] = dataclasses.replace(scores[name], reason=reason)
        return steady

    def _name(
        self,
        baseline: Fitted,
        signatures: Mapping[str, Array],
        fits: Mapping[str, Fitted],
        scores: dict[str, Score],
    ) -> Discovery:
        """Decide between the contenders."""
        gains = {name: scores[name].log_likelihood_ratio or 0.0 for name in fits}
        best = max(gains, key=lambda name: gains[name])
        found, others = fits[best], rivals(gains, best)
        if self._runs.error > 0.0:
            self._stage(f"confirming {best}", 2 * len(self._dataset.specimens))
            baseline = self._fitter.confirmed(baseline, None, self._runs.runs)
            found = self._fitter.confirmed(found, self._effects[best], self._runs.runs)
        left = self._misfit(found)
        if left < SIGNIFICANCE:
            return self._discovery("unknown", scores, baseline, found, left)
        verdict = "ambiguous" if others else "cause"
        confusable = others or self._alike(baseline, signatures, best)
        causes = (best, *others)
        return self._discovery(verdict, scores, baseline, found, left, causes, confusable)

    def _misfit(self, fitted: Fitted) -> float:
        """Return the probability of what the fitted model leaves."""
        both = [self._fitter.evidence(fitted.curves, MODEL_ERROR * k) for k in (1.0, MISFIT)]
        effect = fitted.curves.model.effect
        if effect is not None and fitted.signature is not None:
            # the amplitude is free: a prior as wide as its bounds
            column = np.ptp(effect.bounds) * fitted.signature[:, None]
            both = [evidence.with_nuisance(column) for evidence in both]
        narrow, wide = both
        return misfit_chance(narrow, wide, narrow.fit(), self._rng)

    def _alike(self, baseline: Fitted, signatures: Mapping[str, Array], best: str) -> list[str]:
        """Return the suspects whose signature is nearly parallel to the best one's."""
        names = list(signatures)
        stacked = np.array(list(signatures.values()))
        products = baseline.evidence.products(baseline.fit.scatter, stacked)
        sizes = np.sqrt(np.diag(products))
        cosines = (products / sizes / sizes[:, None])[names.index(best)]
        pairs = zip(names, cosines, strict=True)
        return [n for n, cosine in pairs if n != best and abs(cosine) > ALIKE]

    def _discovery(
        self,
        verdict: str,
        scores: Mapping[str, Score],
        baseline: Fitted,
        extended: Fitted | None = None,
        left: float | None = None,
        causes: tuple[str, ...] = (),
        confusable: Sequence[str] = (),
    ) -> Discovery:
        p_value, misfit = self._chances
        gain, shape, share = None, None, None
        if extended is not None:
            peaks = self._observed.peak_N[:, None]
            gain = measure_gain(peaks * baseline.left_out(), peaks * extended.left_out(), self._rng)
            shape = measure_gain(
                peaks * baseline.left_out_shape(), peaks * extended.left_out_shape(), self._rng
            )
            share = 1.0 - shape.ratio**2
        return Discovery(
            self._dataset,
            self._observed,
            self._effects,
            verdict,
            causes,
            p_value,
            misfit,
            misfit if left is None else left,
            scores,
            baseline,
            extended,
            gain,
            shape,
            share,
            tuple(confusable),
            Effort(self._runs.asked, self._runs.simulated, self._runs.error),
        )


def _on_mesh(dataset: Dataset, mesh: MeshRecipe) -> Dataset:
    """Return the data set with all specimens on a mesh recipe."""
    specimens = tuple(dataclasses.replace(s, test=on_mesh(s.test, mesh)) for s in dataset.specimens)
    return dataclasses.replace(dataset, specimens=specimens)

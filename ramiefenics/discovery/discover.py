"""Measured curves in; out what the simulation gets wrong, its cause, and what naming it gains."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ramiefenics.discovery.comparison import (
    Linearised,
    Model,
    Observed,
    Simulator,
    observe,
    reference_specimen,
)
from ramiefenics.discovery.evidence import Array, Evidence, Fit
from ramiefenics.discovery.factors import factors
from ramiefenics.discovery.runs import Runs
from ramiefenics.discovery.verdict import (
    MISFIT,
    MODEL_ERROR,
    SIGNIFICANCE,
    Gain,
    Score,
    chance,
    measure_gain,
    misfit_chance,
    rivals,
    smooth,
)
from ramiefenics.effects import EFFECTS, Effect
from ramiefenics.measured import Dataset, read_dataset
from ramiefenics.specification import BendingTest, SpecificationError, override

OTHER_MESHES = ("standard", "ladder_q1_2")
"""A finer mesh and one of the other element order: what changes with them is no physics."""

BASELINE_ROUNDS, EFFECT_ROUNDS = 3, 3
"""Most linearisations of a fit."""

SETTLED = 0.1
"""Correction of a log factor that needs no further linearisation."""

CONTENDERS, CONTENDER_RANGE = 3, 8.0
"""Most suspects that are fitted in full, and how far behind the best one may be, log-likelihood."""

INVISIBLE = 2.0
"""A suspect whose largest amplitude makes less of a difference, in standard deviations, cannot be
tested with these data."""

ALIKE = 0.9
"""Cosine of two signatures that are easily mistaken for one another."""


@dataclass(frozen=True)
class Fitted:
    """A model fitted to all specimens.

    Attributes
    ----------
    curves
        Its predictions, linearised where it was fitted.
    evidence
        For residuals around them.
    fit
        The rest of the correction.
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
        return self.curves.model.amplitude + self.fit.amplitude

    @property
    def log_factors(self) -> Array:
        """Common log factors, shape (k,)."""
        correction = self.evidence.common_correction(self.fit, self.signature)
        return np.array(self.curves.model.log_factors) + correction

    def remaining(self) -> Array:
        """Return what the model with its common parameters leaves, over the peaks, (n, m)."""
        residual = self.evidence.residual[..., 0]
        return residual - self.evidence.explained(self.fit, self.signature)

    def left_out(self) -> Array:
        """Return the same for each specimen by a fit to all others."""
        residual = self.evidence.residual[..., 0]
        return residual - self.evidence.left_out(self.fit, self.signature)


@dataclass(frozen=True)
class Discovery:
    """What was found.

    Attributes
    ----------
    dataset, observed
        The measured curves.
    effects
        The suspects.
    verdict
        ``none``, ``cause``, ``ambiguous`` or ``unknown``.
    causes
        Effects named: one, or for ``ambiguous`` all that are not told apart.
    p_value
        Probability of a gain like the best suspect's without any effect.
    misfit_p_value
        Probability of a common misfit like the one that is left, if the model is right.
    scores
        Of all suspects.
    baseline, extended
        The fits without and with the best suspect; the latter is None where nothing was suspected.
    gain, explained
        With the best suspect: of left-out predictions; share of the baseline's squared residuals
        that it takes away. None where nothing was suspected.
    confusable_with
        Suspects that are not told apart, or would hardly be with weaker data.
    simulations
        How many it took, those done before included.
    """

    dataset: Dataset
    observed: Observed
    effects: Mapping[str, Effect]
    verdict: str
    causes: tuple[str, ...]
    p_value: float
    misfit_p_value: float
    scores: Mapping[str, Score]
    baseline: Fitted
    extended: Fitted | None
    gain: Gain | None
    explained: float | None
    confusable_with: tuple[str, ...]
    simulations: int

    def baseline_test(self) -> BendingTest:
        """Return the baseline with its fitted factors."""
        return self._test(self.baseline)

    def extended_test(self) -> BendingTest:
        """Return the baseline with factors and effect as fitted together.

        Raises
        ------
        ValueError
            If nothing was suspected.
        """
        if self.extended is None:
            raise ValueError("nothing was suspected: there is no extended model")
        return self._test(self.extended)

    def _test(self, fitted: Fitted) -> BendingTest:
        model = dataclasses.replace(
            fitted.curves.model,
            log_factors=tuple(float(value) for value in fitted.log_factors),
            amplitude=fitted.amplitude,
        )
        return model.test(self.dataset.baseline)


def discover(
    folder: str | Path,
    effects: Mapping[str, Effect] = EFFECTS,
    mesh: str = "screening",
    runs: Runs | None = None,
    seed: int = 0,
    on_stage: Callable[[str, int], None] = lambda stage, expected: None,
) -> Discovery:
    """Find out what the baseline lacks.

    Parameters
    ----------
    folder
        A data set, see `read_dataset`.
    effects
        Suspects.
    mesh
        Recipe of all simulations.
    runs
        Does the simulations; on all cores, kept in the user's cache by default.
    seed
        Of the random draws behind probabilities and intervals.
    on_stage
        Told what is being done, and about how many simulations are left.

    Raises
    ------
    SpecificationError
        If the data set has a defect, or the baseline cannot be simulated.
    """
    dataset = _on_mesh(read_dataset(folder), mesh)
    return _Inquiry(dataset, effects, runs or Runs(), seed, on_stage).conclude()


class _Inquiry:
    """The steps of `discover`, and what they share."""

    def __init__(
        self,
        dataset: Dataset,
        effects: Mapping[str, Effect],
        runs: Runs,
        seed: int,
        on_stage: Callable[[str, int], None],
    ) -> None:
        self._dataset, self._effects, self._stage = dataset, effects, on_stage
        self._runs = runs
        self._observed = observe(dataset)
        self._simulator = Simulator(dataset, self._observed.at_mm, runs)
        self._rng = np.random.default_rng(seed)

    def conclude(self) -> Discovery:
        """Do all steps."""
        number, suspects = len(self._dataset.specimens), len(self._effects)
        self._stage("fitting the baseline", number * (2 + suspects) + len(OTHER_MESHES))
        baseline = self._baseline()
        self._stage("trying every suspect", number * suspects)
        signatures, scores = self._suspects(baseline)
        names = list(signatures)
        p_value = 1.0
        if names:
            best_gain = max(scores[name].gain or 0.0 for name in names)
            p_value = chance(
                baseline.evidence,
                baseline.fit,
                np.array(list(signatures.values())),
                [self._effects[name].bounds for name in names],
                best_gain,
                self._rng,
            )
        if p_value >= SIGNIFICANCE:
            left = self._misfit(baseline)
            verdict = "none" if left >= SIGNIFICANCE else "unknown"
            return self._discovery(verdict, (), p_value, left, scores, baseline, None, ())
        return self._name(baseline, signatures, scores, p_value)

    def _baseline(self) -> Fitted:
        used = factors(self._dataset.baseline, self._dataset.layout.fit)
        model = Model(used, (0.0,) * len(used))
        curves = self._simulator.linearise(model)
        self._mesh_error = self._other_meshes(curves)
        for _ in range(BASELINE_ROUNDS - 1):
            evidence = self._evidence(curves)
            fit = evidence.fit()
            correction = evidence.common_correction(fit)
            curves = self._simulator.follow(curves, curves.model.moved(correction))
            if np.abs(correction).max() < SETTLED:
                break
        evidence = self._evidence(curves)
        return Fitted(curves, evidence, evidence.fit())

    def _other_meshes(self, curves: Linearised) -> Array:
        """Return the relative change of force by other meshes, on the median specimen."""
        index = reference_specimen(self._dataset.specimens)
        test = curves.model.test(self._dataset.specimens[index].test)
        tests = [override(test, [f"numerics.mesh={name}"]) for name in OTHER_MESHES]
        return self._simulator.on_meshes(curves, index, tests)

    def _evidence(self, curves: Linearised, model_error: float = MODEL_ERROR) -> Evidence:
        peak = self._observed.peak_N[:, None]
        residual = (self._observed.force_N - curves.force) / peak
        shares = curves.force / peak
        meshes = self._mesh_error[None] * shares[:, None]
        wrong = model_error * smooth(*residual.shape)
        nuisance = np.concatenate([meshes, wrong], axis=1)
        return Evidence(residual, curves.by_factors / peak[..., None], nuisance)

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

    def _name(
        self,
        baseline: Fitted,
        signatures: Mapping[str, Array],
        scores: dict[str, Score],
        p_value: float,
    ) -> Discovery:
        """Fit the best suspects in full, and decide between them."""
        gains = {name: scores[name].gain or 0.0 for name in signatures}
        order = sorted(gains, key=lambda name: -gains[name])
        fits = {}
        for name in order[:CONTENDERS]:
            if gains[order[0]] - gains[name] < CONTENDER_RANGE:
                self._stage(f"fitting {name}", 4 * len(self._dataset.specimens))
                fits[name] = self._extended(baseline, self._effects[name], scores[name].amplitude)
        for name, fitted in fits.items():
            gains[name] = fitted.fit.log_likelihood - baseline.fit.log_likelihood
            scores[name] = Score(gains[name], fitted.amplitude, fitted.fit.error)
        best = max(fits, key=lambda name: gains[name])
        extended = fits[best]
        others = rivals(gains, best)
        left = self._misfit(extended)
        if left < SIGNIFICANCE:
            return self._discovery("unknown", (), p_value, left, scores, baseline, extended, ())
        if others:
            causes = (best, *others)
            return self._discovery(
                "ambiguous", causes, p_value, left, scores, baseline, extended, tuple(others)
            )
        alike = self._alike(baseline, signatures, best)
        return self._discovery("cause", (best,), p_value, left, scores, baseline, extended, alike)

    def _extended(self, baseline: Fitted, effect: Effect, amplitude: float) -> Fitted:
        """Fit factors and amplitude together, linearising anew where they are."""
        model = dataclasses.replace(baseline.curves.model, effect=effect, amplitude=amplitude)
        curves = baseline.curves
        for _ in range(EFFECT_ROUNDS):
            curves = self._simulator.follow(curves, model)
            assert curves.by_effect is not None  # the model has an effect
            signature = curves.by_effect / self._observed.peak_N[:, None]
            evidence = self._evidence(curves)
            low, high = effect.bounds
            fit = evidence.fit(signature, (low - model.amplitude, high - model.amplitude))
            fitted = Fitted(curves, evidence, fit, signature)
            if abs(fit.amplitude) < 0.5 * fit.error:
                break
            correction = evidence.common_correction(fit, signature)
            model = model.moved(correction, model.amplitude + fit.amplitude)
        return fitted

    def _misfit(self, fitted: Fitted) -> float:
        """Return the probability of what the fitted model leaves."""
        curves = fitted.curves
        evidence, wide = (self._evidence(curves, MODEL_ERROR * times) for times in (1.0, MISFIT))
        if fitted.signature is not None:  # the amplitude is free: a prior as wide as its bounds
            size = np.ptp(curves.model.effect.bounds)  # type: ignore[union-attr]
            column = size * fitted.signature[:, None]
            evidence, wide = evidence.with_nuisance(column), wide.with_nuisance(column)
        return misfit_chance(evidence, wide, evidence.fit(), self._rng)

    def _alike(
        self, baseline: Fitted, signatures: Mapping[str, Array], best: str
    ) -> tuple[str, ...]:
        """Return the suspects whose signature is nearly parallel to the best one's."""
        names = list(signatures)
        stacked = np.array(list(signatures.values()))
        products = baseline.evidence.products(baseline.fit.scatter, stacked)
        sizes = np.sqrt(np.diag(products))
        cosines = (products / sizes / sizes[:, None])[names.index(best)]
        pairs = zip(names, cosines, strict=True)
        return tuple(n for n, cosine in pairs if n != best and abs(cosine) > ALIKE)

    def _discovery(
        self,
        verdict: str,
        causes: tuple[str, ...],
        p_value: float,
        left: float,
        scores: Mapping[str, Score],
        baseline: Fitted,
        extended: Fitted | None,
        confusable: tuple[str, ...],
    ) -> Discovery:
        gain, share = None, None
        if extended is not None:
            peaks = self._observed.peak_N[:, None]
            before, after = (peaks * fitted.left_out() for fitted in (baseline, extended))
            gain = measure_gain(before, after, self._rng)
            sums = [((peaks * f.remaining()) ** 2).sum() for f in (baseline, extended)]
            share = float(1.0 - sums[1] / sums[0])
        return Discovery(
            self._dataset,
            self._observed,
            self._effects,
            verdict,
            causes,
            p_value,
            left,
            scores,
            baseline,
            extended,
            gain,
            share,
            confusable,
            self._runs.asked,
        )


def _on_mesh(dataset: Dataset, mesh: str) -> Dataset:
    """Return the data set with all specimens on a mesh recipe."""

    def changed(test: BendingTest) -> BendingTest:
        return override(test, [f"numerics.mesh={mesh}"])

    specimens = tuple(dataclasses.replace(s, test=changed(s.test)) for s in dataset.specimens)
    return dataclasses.replace(dataset, specimens=specimens)

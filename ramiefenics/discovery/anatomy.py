"""Anatomy of the unknown: a free function inside the model that explains what no suspect does.

In each of a few places (`places`), a function is free except that it is smooth. Its coefficients
are integrated out, for each of a few prior sizes and with the standard deviations that are most
probable with it, so that places can be compared by their evidence. The best one is fitted in the
finite-element model by linearising again at the expected coefficients.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from scipy.stats import t as student

from ramiefenics.discovery.curves.blocks import Array
from ramiefenics.discovery.curves.both_ways import Predicting
from ramiefenics.discovery.curves.directions import directions_of
from ramiefenics.discovery.curves.linearised import Linearised, Model
from ramiefenics.discovery.curves.observed import Observed
from ramiefenics.discovery.places import Place, places
from ramiefenics.discovery.search.fitted import STEADY, STEADY_ERRORS, Fitted
from ramiefenics.discovery.search.fitting import FARTHEST, SHORTEST, linear_evidence
from ramiefenics.discovery.statistics.evidence import Evidence
from ramiefenics.discovery.statistics.fit import LEVEL, Fit
from ramiefenics.discovery.statistics.fit_scatter import fit_scatter, log_evidence
from ramiefenics.discovery.statistics.freedom import degrees_of_freedom
from ramiefenics.discovery.statistics.gain import Gain
from ramiefenics.discovery.statistics.verdict import ENOUGH
from ramiefenics.effects import Effect
from ramiefenics.measured import Dataset
from ramiefenics.specification import BendingTest, SpecificationError

SIZES = (0.3, 1.0, 3.0)
"""Prior sizes of a function relative to that of its place, all equally probable."""

ROUNDS = 2
"""Maximum number of linearisations at the expected coefficients."""


@dataclass(frozen=True)
class Learned:
    """A function learned in one place of the model.

    Attributes
    ----------
    place
        The place.
    size
        The most probable of `SIZES`.
    log_evidence
        Logarithm of the evidence of the curves, averaged over `SIZES`.
    fit
        Fit at that size, with the function's coefficients as the last columns of its nuisance.
    """

    place: Place
    size: float
    log_evidence: float
    fit: Fit

    @cached_property
    def coefficients(self) -> tuple[Array, Array]:
        """Mean, shape (c,), and covariance, shape (c, c), of the coefficients."""
        return self._coefficients_of(self.fit)

    def _coefficients_of(self, fit: Fit) -> tuple[Array, Array]:
        root = self.size * self.place.root
        number = root.shape[1]
        whitened = fit.evidence.whiten(fit.scatter)
        mean, covariance = (part[-number:] for part in whitened.deviations(()))
        return root @ mean, root @ covariance[:, -number:] @ root.T

    def function(self, test: BendingTest) -> tuple[Array, Array, Array]:
        """Return a test's whole function at `Place.at`: mean, and the ends of its 95 % band, (g,).

        The band is that of Student's distribution, see `degrees_of_freedom`.
        """
        basis = self.place.basis(test)

        def variances(fit: Fit) -> Array:
            covariance = self._coefficients_of(fit)[1]
            return np.asarray(np.einsum("gi,ij,gj->g", basis, covariance, basis))

        middle = self.place.function(test, self.place.at) + basis @ self.coefficients[0]
        quantile = student.ppf((1.0 + LEVEL) / 2.0, degrees_of_freedom(self.fit, variances))
        half = np.asarray(quantile * np.sqrt(variances(self.fit)))
        return middle, middle - half, middle + half


@dataclass(frozen=True)
class Anatomy:
    """What is missing, learned inside the model.

    Attributes
    ----------
    log_evidence_gains
        Log-evidence of each place minus that of the baseline, by name.
    learned
        The function in the best place.
    test
        The data set's baseline with the mean of the specimens' fitted factors.
    misfit_p_value
        Probability of a common misfit like the one that is left.
    gain, shape_gain
        Gains of predictions with the function, as in `Discovery`.
    """

    log_evidence_gains: Mapping[str, float]
    learned: Learned
    test: BendingTest
    misfit_p_value: float
    gain: Gain
    shape_gain: Gain

    @property
    def place(self) -> Place:
        """The place with the largest evidence."""
        return self.learned.place

    @property
    def supported(self) -> bool:
        """Whether a function in the best place explains more than chance would."""
        return self.log_evidence_gains[self.place.name] > ENOUGH

    @property
    def probability(self) -> dict[str, float]:
        """Probability of each place, if one of these is right; all have the same prior."""
        gains = np.array(list(self.log_evidence_gains.values()))
        shares = np.exp(gains - gains.max())
        values = map(float, shares / shares.sum())
        return dict(zip(self.log_evidence_gains, values, strict=True))

    @cached_property
    def baseline(self) -> Array:
        """The baseline's own function at `Place.at`, shape (g,)."""
        return self.place.function(self.test, self.place.at)

    @cached_property
    def function(self) -> tuple[Array, Array, Array]:
        """The whole function and the ends of its band, see `Learned.function`."""
        return self.learned.function(self.test)

    def extended_test(self) -> BendingTest:
        """Return the baseline with the learned function."""
        return self.place.apply(self.test, self.learned.coefficients[0])

    def numbers(self) -> dict[str, Any]:
        """Return the values for a summary."""
        mean, low, high = self.function
        names = [effect.name for effect in self.place.effects]
        coefficients = [float(value) for value in self.learned.coefficients[0]]
        return {
            "place": self.place.name,
            "probabilities": self.probability,
            "log_evidence_gains": dict(self.log_evidence_gains),
            "supported": self.supported,
            "coefficients": dict(zip(names, coefficients, strict=True)),
            "x": self.place.x_label,
            "y": self.place.y_label,
            "at": self.place.at.tolist(),
            "baseline": self.baseline.tolist(),
            "value": mean.tolist(),
            "low": low.tolist(),
            "high": high.tolist(),
            "misfit_p_value": self.misfit_p_value,
            "gain": self.gain.numbers(),
            "shape_gain": self.shape_gain.numbers(),
        }


class Anatomist:
    """Learns what is missing.

    Parameters
    ----------
    dataset, observed
        The measured curves.
    predictor
        Predicts the curves, and simulates every one of them.
    """

    def __init__(self, dataset: Dataset, observed: Observed, predictor: Predicting) -> None:
        self._dataset, self._observed, self._predictor = dataset, observed, predictor
        self._tests = [record.test for record in dataset.records]

    def learn(self, baseline: Fitted) -> tuple[Learned, dict[str, float]]:
        """Return the function in the best place, and the gain of each place in log-evidence.

        A function that explains no more than chance would is not refined, which takes most of the
        simulations.

        Parameters
        ----------
        baseline
            The fit without a function.
        """
        observed = self._observed
        found = places(self._tests, float(observed.force_N.max()), float(observed.at_mm.max()))
        tests = self._tests
        for place in found.values():
            tests = [place.prepared(test) for test in tests]
        effects = {effect.name: effect for place in found.values() for effect in place.effects}
        broken = baseline.fit.evidence.broken
        curves = self._linearised(tests, baseline.curves.model, effects)
        evidence = self._evidence(curves, effects, broken)
        nothing = dataclasses.replace(evidence, suspects={})
        without = log_evidence(nothing, (), fit_scatter(nothing))
        learned = [_learned(place, evidence) for place in found.values()]
        best = max(learned, key=lambda one: one.log_evidence)
        gains = {one.place.name: one.log_evidence - without for one in learned}
        if gains[best.place.name] > ENOUGH:
            best = self._refined(best, curves)
        return best, gains

    def _refined(self, learned: Learned, curves: Linearised) -> Learned:
        """Linearise again at the expected coefficients until these settle."""
        here: Array = np.zeros(len(learned.place.effects))
        for _ in range(ROUNDS):
            mean, covariance = learned.coefficients
            moves = np.abs(learned.fit.log_factors - curves.model.log_factors)
            near = moves[learned.fit.evidence.whole].max() < STEADY
            if near and np.all(np.abs(mean - here) < STEADY_ERRORS * np.sqrt(np.diag(covariance))):
                break
            curves, here = self._move(learned, curves, here)
            effects = {effect.name: effect for effect in learned.place.effects}
            evidence = self._evidence(curves, effects, learned.fit.evidence.broken)
            added = np.einsum("c,crm->rm", here, _signatures(learned.place, evidence))
            moved = dataclasses.replace(evidence, residual=evidence.residual + added)
            learned = _learned(learned.place, moved)
        return learned

    def _move(self, learned: Learned, curves: Linearised, here: Array) -> tuple[Linearised, Array]:
        """Move to the expected coefficients, or as far as simulations reach the end."""
        model, place = curves.model, learned.place
        step = np.clip(learned.fit.log_factors - model.log_factors, -FARTHEST, FARTHEST)
        effects, share = {effect.name: effect for effect in place.effects}, 1.0
        while True:
            there = here + share * (learned.coefficients[0] - here)
            wanted = dataclasses.replace(model, log_factors=model.log_factors + share * step)
            try:
                tests = [place.apply(test, there) for test in self._tests]
                return self._linearised(tests, wanted, effects, smooth=True), there
            except SpecificationError:
                share /= 2.0
                if share < SHORTEST:
                    return curves, here

    def _linearised(
        self,
        tests: Sequence[BendingTest],
        model: Model,
        effects: Mapping[str, Effect],
        smooth: bool = False,
    ) -> Linearised:
        along = directions_of(effects, tests[0])
        return self._predictor.rephrased(tests).linearise(model, effects, smooth, along=along)

    def _evidence(
        self, curves: Linearised, effects: Mapping[str, Effect], broken: frozenset[int]
    ) -> Evidence:
        fit_sd = self._dataset.layout.fit_sd
        evidence = linear_evidence(curves, self._observed, effects, fit_sd)
        return dataclasses.replace(evidence, broken=broken)


def _signatures(place: Place, evidence: Evidence) -> Array:
    """Return the change of the curves per unit of each coefficient, shape (c, r, m)."""
    return np.array([evidence.suspects[effect.name].signature for effect in place.effects])


def _learned(place: Place, evidence: Evidence) -> Learned:
    columns = np.einsum("crm,cd->rdm", _signatures(place, evidence), place.root)
    plain = dataclasses.replace(evidence, suspects={})
    fits, values = [], []
    for size in SIZES:
        wide = dataclasses.replace(plain.with_nuisance(size * columns), learned=columns.shape[1])
        fits.append(Fit(wide, (), fit_scatter(wide)))
        values.append(log_evidence(wide, (), fits[-1].scatter))
    best = int(np.argmax(values))
    return Learned(place, SIZES[best], _log_mean(values), fits[best])


def _log_mean(logarithms: Sequence[float]) -> float:
    return float(np.logaddexp.reduce(logarithms) - np.log(len(logarithms)))

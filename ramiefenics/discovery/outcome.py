"""What a discovery comes to."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from scipy.stats import t as student

from ramiefenics.discovery.comparison import Observed
from ramiefenics.discovery.fitting import Fitted
from ramiefenics.discovery.verdict import Gain, Score
from ramiefenics.effects import Effect
from ramiefenics.measured import Dataset
from ramiefenics.specification import BendingTest


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
    baseline_misfit_p_value, misfit_p_value
        Probability of a common misfit like the baseline's, and like the one that is left in the
        end, if the model is right.
    scores
        Of all suspects.
    baseline, extended
        The fits without and with the best suspect; the latter is None where nothing was suspected.
    gain, shape_gain
        Of predictions of specimens left out, with the best suspect: of their curves, by what is
        known of them without bending them; and of the curves' shapes, where their own factors are
        fitted to them. None where nothing was suspected.
    explained
        Share of the baseline's squared errors of shape that the best suspect takes away.
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
    baseline_misfit_p_value: float
    misfit_p_value: float
    scores: Mapping[str, Score]
    baseline: Fitted
    extended: Fitted | None
    gain: Gain | None
    shape_gain: Gain | None
    explained: float | None
    confusable_with: tuple[str, ...]
    simulations: int

    @property
    def fitted(self) -> Fitted:
        """The last fit: with the best suspect if there is one, else the baseline."""
        return self.baseline if self.extended is None else self.extended

    @property
    def factor_moves(self) -> dict[str, float]:
        """Logarithms of the fitted factors over their prior standard deviation, by name."""
        moves = self.fitted.log_factors / self.dataset.layout.fit_sd
        names = (factor.name for factor in self.fitted.curves.model.factors)
        return dict(zip(names, map(float, moves), strict=True))

    def interval(self, name: str) -> tuple[float, float]:
        """Return the 95 % interval of a suspect's amplitude, within its bounds."""
        score = self.scores[name]
        low, high = self.effects[name].bounds
        # the specimen is the unit
        half = float(student.ppf(0.975, len(self.dataset.specimens) - 1)) * score.error
        return max(score.amplitude - half, low), min(score.amplitude + half, high)

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
        model = fitted.curves.model.at(fitted.log_factors, fitted.amplitude)
        return model.test(self.dataset.baseline)

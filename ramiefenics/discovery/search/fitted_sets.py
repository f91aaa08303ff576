"""Sets of effects that have been fitted, each judged where it fits."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass

import numpy as np

from ramiefenics.discovery.search.fitted import Fitted
from ramiefenics.discovery.statistics.causes import log_priors, own_score
from ramiefenics.discovery.statistics.fit import Fit
from ramiefenics.discovery.statistics.fit_scatter import fit_scatter

Names = tuple[str, ...]

LEAD = 2.0
"""Log-probability by which a set must lead one that it contains, and that has every curve
simulated, for its own curves to be simulated as well. Below, what it adds is not certain whatever
comes of that, and simulations of effects that need the whole stalk take minutes."""


@dataclass(frozen=True)
class Reached:
    """A set of effects, linearised near where it fits.

    Attributes
    ----------
    fitted
        The fitted set.
    score
        Log-evidence plus log-prior of the set, up to a constant.
    finished
        Whether every curve was simulated near where the set fits.
    closest
        Whether it was linearised as close to its fit as it can be.
    """

    fitted: Fitted
    score: float
    finished: bool = False
    closest: bool = False

    def __str__(self) -> str:
        """Return the set, its amplitudes and its score."""
        amplitudes = self.fitted.fit.amplitudes
        return f"the set {self.names} with amplitudes {amplitudes}: score {self.score:.2f}"

    @property
    def names(self) -> Names:
        """Names of the effects."""
        return self.fitted.fit.chosen


class FittedSets(dict[Names, Reached]):
    """All sets that have been fitted, by the names of their effects."""

    @property
    def best(self) -> Reached:
        """The most probable set, or a finished part of it that is nearly as probable."""
        best = max(self.values(), key=lambda one: one.score)
        if best.finished:
            return best
        parts = [one for one in self.values() if one.finished and set(one.names) < set(best.names)]
        part = max(parts, key=lambda one: one.score, default=best)
        return part if best.score < part.score + LEAD else best

    @property
    def none(self) -> float:
        """Probability that there is no effect, if only the sets that were reached are possible."""
        scores = np.array([reached.score for reached in self.values()])
        shares = np.exp(scores - self.best.score)
        return float(np.exp(self[()].score - self.best.score) / shares.sum())

    def gains(self, suspects: int) -> dict[str, float]:
        """Return gains in log-evidence over the baseline of effects that were fitted alone.

        The gain of the best set counts as well, under the name of its first effect, less the price
        of its lower prior probability than that of a single effect.

        Parameters
        ----------
        suspects
            Number of suspects.
        """
        if len(self) == 1:
            return {}
        nothing, single = log_priors([(), (0,)], suspects)
        scores = {names[0]: one.score for names, one in self.items() if len(names) == 1}
        if self.best.names:
            name = self.best.names[0]
            scores[name] = max(self.best.score, scores.get(name, -math.inf))
        return {n: score - self[()].score - single + nothing for n, score in scores.items()}

    def part(self, names: Names) -> Reached:
        """Return the best subset of a set among those that were reached."""
        parts = [one for part, one in self.items() if set(part) <= set(names)]
        return max(parts, key=lambda one: one.score)

    def bounded(self, reached: Reached) -> Reached:
        """Return a set with no larger a score than its subsets and the derivatives allow.

        It gains no more over a subset than the derivatives show where either of them fits. Errors
        of linearised and of learned curves add up over specimens; with hundreds of these, scores
        from different linearisations differ by ten and more where nothing is gained, whereas
        at one linearisation such errors cancel.
        """
        score, names = reached.score, set(reached.names)
        for part in self.values():
            if part.finished and set(part.names) < names:
                gains = [
                    score_there(one.fitted.fit, reached.names)
                    - score_there(one.fitted.fit, part.names)
                    for one in (part, reached)
                ]
                score = min(score, part.score + max(gains))
        return dataclasses.replace(reached, score=score)


def score_there(fit: Fit, names: Names) -> float:
    """Return the score of a set, by the derivatives where another one fits."""
    scatter = fit_scatter(fit.evidence, names, fit.scatter)
    return own_score(fit.evidence, names, scatter)

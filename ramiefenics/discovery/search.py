"""Search for the set of effects that explains the curves best, each set judged where it fits.

Derivatives say little about a set that fits far from where they were computed: effects that are not
in the data may then seem to explain them better than those that are. A set therefore counts by its
evidence where it has been fitted in the finite-element model. Derivatives only suggest which sets
to fit: at the baseline, sets of one and of two effects, and a few single effects whatever the
derivatives say; at every set that has been fitted, the sets with one effect more. Where derivatives
have promised too much of an effect before, the excess is deducted. Pairs of effects that need no
simulations, such as errors of the machine, are fitted more readily.

Small sets are fitted first, and hopeless ones are given up as soon as they have been simulated. The
best set so far, the sets that are close to it in the end, and the baseline are fitted further until
they no longer change, with every curve simulated at the fitted parameters or so near them that
learned curves are as good. This is necessary because errors of a few thousandths of the peak force,
in learned curves or in linearisations, amount to odds of a thousand.
"""

from __future__ import annotations

import dataclasses
import logging
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ramiefenics.discovery.broken import find_broken
from ramiefenics.discovery.causes import Causes, find_causes, log_priors, own_score
from ramiefenics.discovery.evidence import Evidence
from ramiefenics.discovery.fit import Fit
from ramiefenics.discovery.fit_scatter import fit_scatter
from ramiefenics.discovery.fitting import Fitted, Fitter
from ramiefenics.discovery.linearised import Linearised
from ramiefenics.effects import Effect
from ramiefenics.specification import SpecificationError
from ramiefenics.surrogate import CLOSE_TOLERANCE

log = logging.getLogger(__name__)

ROUNDS, LAST_ROUNDS = 4, 8
"""Maximum number of linearisations of a set until it is compared with others, and from then on
until its fit is final."""

MOST_SETS = 12
"""Maximum number of sets that are fitted."""

PROMISING = -1.0
"""Least gain in log-probability over all smaller sets that derivatives must promise of a set."""

SINGLES = 3
"""Number of single effects that are always fitted, namely those of which derivatives promise most,
because derivatives at the baseline may be wrong by as much as an effect gains."""

PAIR = 2
"""Number of effects in the largest sets that the derivatives at the baseline may suggest."""

FREE_RIVAL = 16.0
"""Log-probability by which a pair of effects that need no simulations may be worse than the best
set, and still be fitted. A gap moves the whole curve, and the derivatives of other effects do not
account for that."""

RIVAL, LARGER = 5.0, 2.0
"""Log-probability by which a set may be worse, by the derivatives, than another set of its size or
than the best set that was fitted. The second value applies to sets that contain the best set and
more, because derivatives seldom promise too little near where a set fits.
"""

CLOSE, CLOSE_TO_NOTHING = 8.0, 2.0
"""Log-probability by which a set may be worse than the best one where it is first simulated and
still be fitted further, and in the end have every curve simulated. The second value applies in the
end if the best set is the one without effects, because no other set is then told from it."""

Names = tuple[str, ...]


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
    """

    fitted: Fitted
    score: float
    finished: bool = False

    @property
    def names(self) -> Names:
        """Names of the effects."""
        return self.fitted.fit.chosen


class Search:
    """Search for the best set of effects.

    Parameters
    ----------
    fitter
        Fits models to the data.
    screened
        The baseline, with the signatures of all effects.
    effects
        The suspects.

    Attributes
    ----------
    refused
        Sets that cannot be simulated near where they fit, with the reasons.
    """

    def __init__(self, fitter: Fitter, screened: Linearised, effects: Mapping[str, Effect]) -> None:
        self._fitter, self._screened, self._effects = fitter, screened, effects
        self._reached: dict[Names, Reached] = {}
        self._promised: dict[Names, float] = {}
        self._overrated: dict[str, list[float]] = {}  # by added effect: promise minus score
        self._free = frozenset(fitter.without_simulations(effects))
        self._insisted: set[Names] = set()  # fitted however good other sets are
        self._broken: frozenset[int] = frozenset()
        self.refused: dict[Names, str] = {}

    def best(self, evidence: Evidence, causes: Causes) -> tuple[Fitted, Causes]:
        """Return the best set that was reached, and the posterior over all sets.

        Sets that were reached enter with their own evidence. A set that adds to one close to the
        best enters with the evidence by the derivatives where the smaller one fits, less the excess
        that derivatives have promised of the same effect before. Other sets do not count.

        Parameters
        ----------
        evidence, causes
            Evidence and posterior at the baseline.
        """
        self._broken = evidence.broken  # the same for all sets, so that evidences compare
        self._reached[()] = self._judged((), self._screened)
        self._propose(self._best)
        if certain := causes.certain():
            self._promised[certain] = math.inf  # whatever its size
        if self._promised:
            self._fit_set(())  # linearised as close to its fit as they will be to theirs
            self._confirm_best()
        for _ in range(MOST_SETS):
            names = self._most_promising()
            if names is None:
                break
            self._fit_set(names)
            self._confirm_best()
            if names in self._reached:
                self._propose(self._reached[names])
        if self._promised:
            self._finish()
        fit = self._best.fitted.fit
        self._broken = find_broken(fit.evidence, fit.chosen).broken
        for names, one in sorted(self._reached.items(), key=lambda item: len(item[0])):
            judged = self._judged(names, one.fitted.curves)
            self._reached[names] = self._bounded(dataclasses.replace(judged, finished=one.finished))
        return self._best.fitted, self._with_own(self._compared(self._best))

    @property
    def nothing(self) -> Fitted:
        """The baseline, linearised near where it fits."""
        return self._reached[()].fitted

    @property
    def none(self) -> float:
        """Probability that there is no effect, if only the sets that were reached are possible."""
        scores = np.array([reached.score for reached in self._reached.values()])
        shares = np.exp(scores - self._best.score)
        return float(np.exp(self._reached[()].score - self._best.score) / shares.sum())

    @property
    def gains(self) -> dict[str, float]:
        """Gains in log-evidence over the baseline of effects that were fitted alone.

        The gain of the best set counts as well, under the name of its first effect, less the price
        of its lower prior probability than that of a single effect.
        """
        if len(self._reached) == 1:
            return {}
        nothing, single = log_priors([(), (0,)], len(self._effects))
        scores = {names[0]: one.score for names, one in self._reached.items() if len(names) == 1}
        if self._best.names:
            name = self._best.names[0]
            scores[name] = max(self._best.score, scores.get(name, -math.inf))
        return {
            n: score - self._reached[()].score - single + nothing for n, score in scores.items()
        }

    @property
    def _best(self) -> Reached:
        return max(self._reached.values(), key=lambda one: one.score)

    def _propose(self, start: Reached) -> None:
        """Note what the derivatives where a set fits promise of larger sets."""
        found, here = self._compared(start), set(start.names)
        each = [(tuple(found.names[i] for i in chosen), score) for chosen, score in found.scored()]
        larger = [(names, score) for names, score in each if here < set(names)]
        least = found.score(start.names)
        for size in range(len(here) + 1, max(len(here) + 1, PAIR) + 1):
            alike = [(names, score) for names, score in larger if len(names) == size]
            top = max((score for _, score in alike), default=-math.inf)
            for names, score in alike:
                if score > max(top - RIVAL, least + PROMISING):
                    self._promise(names, start, score - found.score(start.names))
            least = max(least, top)
        for names, score in self._whatever_promised(start.names, larger):
            self._promise(names, start, score - found.score(start.names))
            self._insisted.add(names)

    def _whatever_promised(
        self, here: Names, larger: Sequence[tuple[Names, float]]
    ) -> list[tuple[Names, float]]:
        """Return a few single effects, or the best pair without simulations, to be fitted."""
        next_size = [one for one in larger if len(one[0]) == len(here) + 1 <= PAIR]
        if here:
            next_size = [one for one in next_size if self._free.issuperset(one[0])]
        return sorted(next_size, key=lambda one: -one[1])[: 1 if here else SINGLES]

    def _promise(self, names: Names, start: Reached, gain: float) -> None:
        promise = start.score + gain
        self._promised[names] = max(promise, self._promised.get(names, promise))

    def _expected(self, names: Names) -> float:
        """Return the score promised of a set, less the excess promised of its effects before."""
        return self._promised[names] - self._excess({*names} - {*self._part(names).names})

    def _excess(self, added: Iterable[str]) -> float:
        """Return the mean excess that derivatives have promised, the largest of added effects."""
        before = [self._overrated.get(name, [0.0]) for name in added]
        return max([0.0, *(sum(some) / len(some) for some in before)])

    def _part(self, names: Names) -> Reached:
        """Return the best subset of a set among those that were reached."""
        parts = [one for part, one in self._reached.items() if set(part) <= set(names)]
        return max(parts, key=lambda one: one.score)

    def _most_promising(self) -> Names | None:
        """Return the set to be fitted next; None if no further set is worth it."""
        known = {*self._reached, *self.refused}
        left = {n: self._expected(n) for n in self._promised if n not in known}
        worth = [n for n, score in left.items() if score > self._least(n) or self._insists_on(n)]
        return min(worth, key=lambda names: (len(names), -left[names]), default=None)

    def _insists_on(self, names: Names) -> bool:
        """Return whether a set is fitted although another one promises more.

        A pair that contains the best set is not, because promises are right where that set fits.
        """
        if names not in self._insisted:
            return False
        promising = self._promised[names] > self._best.score - FREE_RIVAL
        return len(names) == 1 or (promising and not set(names) > set(self._best.names))

    def _least(self, names: Names) -> float:
        """Return the score that must be promised of a set for it to be fitted."""
        more = set(names) > set(self._best.names)
        return self._best.score - (LARGER if more else RIVAL)

    def _fit_set(self, names: Names) -> None:
        """Fit a set, starting from its best subset that was reached."""
        part = self._part(names)
        start = part.fitted
        reached = self._judged(names, start.curves)
        shrunk = 0  # linearisations in which the effects became smaller
        for number in range(ROUNDS):
            if reached.fitted.steady or (number and self._behind(reached, shrunk)):
                break
            try:
                reached = self._moved(names, reached.fitted)
            except SpecificationError as error:
                if names not in self._reached:  # the baseline is there from the screening on
                    self.refused[names] = str(error)
                return
            shrunk += self._shrinks(reached, part)
        self._reached[names] = reached = self._bounded(reached)
        if math.isfinite(promise := self._promised.get(names, math.inf)):
            for name in set(names) - set(part.names):
                self._overrated.setdefault(name, []).append(promise - reached.score)
        log.info(
            "the set %s with amplitudes %s: score %.2f",
            names,
            reached.fitted.fit.amplitudes,
            reached.score,
        )

    def _behind(self, reached: Reached, shrunk: int) -> bool:
        """Return whether a simulated set is so far behind the best one that it is given up.

        A set that contains the best one cannot be far worse where it fits. It is given up only if
        what it adds has become smaller twice, because it fits best with next to nothing of it.
        """
        names, best = reached.names, self._best
        pair = len(names) == PAIR and names in self._insisted
        allowed = FREE_RIVAL if pair else CLOSE
        larger = set(names) > set(best.names)
        return reached.score < best.score - allowed and (not larger or shrunk > 1)

    @staticmethod
    def _shrinks(reached: Reached, part: Reached) -> bool:
        """Return whether all that a set adds to another is to be smaller than where simulated."""
        fitted, model = reached.fitted.fit.amplitudes, reached.fitted.curves.model
        added = set(reached.names) - set(part.names)
        return all(abs(fitted[name]) < abs(model.amplitude(name)) for name in added)

    def _confirm_best(self) -> None:
        """Fit the best set further, with every curve simulated, as others are compared with it."""
        while not self._best.finished:
            self._reached[self._best.names] = self._finished(self._best)

    def _finish(self) -> None:
        """Fit the best sets further, with every curve simulated, until they are steady.

        Sets that contain the best one and more are left out: what they add explains too little.
        """
        while True:
            best = self._best
            close = CLOSE if best.names else CLOSE_TO_NOTHING
            left = [
                one
                for one in self._reached.values()
                if not one.finished
                and (not one.names or one.score > best.score - close)
                and not set(one.names) > set(best.names)
            ]
            if not left:
                return
            one = max(left, key=lambda reached: reached.score)
            self._reached[one.names] = self._finished(one)

    def _finished(self, reached: Reached) -> Reached:
        names = reached.names
        others = [one.score for other, one in self._reached.items() if other != names]
        for number in range(LAST_ROUNDS):
            if number > 1 and reached.score < max(others, default=-math.inf) - CLOSE:
                break  # learned curves had made it seem better than it is
            try:
                if not reached.fitted.steady:
                    reached = self._moved(names, reached.fitted)
                curves = self._fitter.confirm(reached.fitted.curves, CLOSE_TOLERANCE)
            except SpecificationError as error:
                log.info("the set %s cannot be fitted any better: %s", names, error)
                break
            reached = self._judged(names, curves)
            if reached.fitted.steady:
                break
        log.info(
            "the set %s with amplitudes %s: score %.2f",
            names,
            reached.fitted.fit.amplitudes,
            reached.score,
        )
        return self._bounded(dataclasses.replace(reached, finished=True))

    def _moved(self, names: Names, fitted: Fitted) -> Reached:
        """Simulate a set near where it fits."""
        moved = self._fitter.move(fitted, {name: self._effects[name] for name in names})
        by_effects = {**self._screened.by_effects, **moved.by_effects}
        moved = dataclasses.replace(moved, by_effects=by_effects)
        return self._judged(names, moved)

    def _judged(self, names: Names, curves: Linearised) -> Reached:
        fit = self._fitter.fit(curves, self._effects, names, self._broken)
        return Reached(Fitted(curves, fit), own_score(fit.evidence, names, fit.scatter))

    def _bounded(self, reached: Reached) -> Reached:
        """Return a set with no larger a score than its subsets and the derivatives allow.

        It gains no more over a subset than the derivatives show where either of them fits. Errors
        of linearised and of learned curves add up over specimens; with hundreds of these, scores
        from different linearisations differ by ten and more where nothing is gained, whereas
        at one linearisation such errors cancel.
        """
        score, names = reached.score, set(reached.names)
        for part in self._reached.values():
            if part.finished and set(part.names) < names:
                gains = [
                    score_there(one.fitted.fit, reached.names)
                    - score_there(one.fitted.fit, part.names)
                    for one in (part, reached)
                ]
                score = min(score, part.score + max(gains))
        return dataclasses.replace(reached, score=score)

    def _compared(self, reached: Reached) -> Causes:
        """Compare all sets by the linearisation near where one of them fits."""
        return find_causes(reached.fitted.fit.evidence, self.refused)

    def _with_own(self, found: Causes) -> Causes:
        """Return the posterior with the own evidence of the sets reached, see `best`."""
        log_evidence = np.full(len(found.sets), -np.inf)
        for names, reached in self._reached.items():
            if reached.score > self._best.score - CLOSE:
                there = found if reached is self._best else self._compared(reached)
                part = {found.names.index(name) for name in names}
                larger = np.array([part <= set(chosen) for chosen in found.sets])
                own = there.log_evidence + reached.score - there.score(names)
                own[larger] -= [
                    self._excess(found.names[i] for i in set(chosen) - part)
                    for chosen in np.array(found.sets, dtype=object)[larger]
                ]
                log_evidence[larger] = np.maximum(log_evidence, own)[larger]
        for names, reached in self._reached.items():
            row = found.row(names)
            log_evidence[row] = found.log_evidence[row] + reached.score - found.score(names)
        return dataclasses.replace(found, log_evidence=log_evidence)


def score_there(fit: Fit, names: Names) -> float:
    """Return the score of a set, by the derivatives where another one fits."""
    scatter = fit_scatter(fit.evidence, names, fit.scatter)
    return own_score(fit.evidence, names, scatter)

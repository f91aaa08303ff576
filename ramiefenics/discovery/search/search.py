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
in learned curves or in linearisations, amount to odds of a thousand. What is left of these errors
is taken into account in the probabilities.
"""

from __future__ import annotations

import dataclasses
import logging
from collections.abc import Mapping

import numpy as np

from ramiefenics.discovery.curves.linearised import Linearised
from ramiefenics.discovery.search.fitted import Fitted
from ramiefenics.discovery.search.fitted_sets import FittedSets, Names, Reached
from ramiefenics.discovery.search.fitting import Fitter
from ramiefenics.discovery.search.promises import FREE_RIVAL, Promises
from ramiefenics.discovery.search.refining import CLOSE, Refiner
from ramiefenics.discovery.statistics.broken import find_broken
from ramiefenics.discovery.statistics.causes import Causes, find_causes
from ramiefenics.discovery.statistics.evidence import Evidence
from ramiefenics.effects import Effect
from ramiefenics.specification import SpecificationError

log = logging.getLogger(__name__)

ROUNDS = 4
"""Maximum number of linearisations of a set until it is compared with others."""

MOST_SETS = 12
"""Maximum number of sets that are fitted."""

PROBABLE = 0.05
"""Probability above which a set is fitted before it enters the result."""

WITHIN, WITHIN_OF_NOTHING = 5.0, 2.0
"""Log-probability by which a set may be worse than the best one in the end and still be fitted
further, and what replaces it if the best one is the set without effects, because no other set is
then told from it. In 28 such fits the score rose by 2.4 at most (standard deviation 1.6)."""

RIVALS = 4.0
"""Log-probability by which a set may be worse than the best one in the end and still be linearised
as close to its fit as possible."""

SCORE_ERROR = 1.0
"""Standard deviation of the error of a fitted set's log-evidence. In repeated linearisations near
its fit, with every curve simulated, that of five sets varied by 0.5 to 1.4."""


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
    sets
        Sets that have been fitted, the baseline among them.
    refused
        Sets that cannot be simulated near where they fit, with the reasons.
    """

    def __init__(self, fitter: Fitter, screened: Linearised, effects: Mapping[str, Effect]) -> None:
        self._screened = screened
        self.sets = FittedSets()
        self._refiner = Refiner(fitter, screened, effects, self.sets)
        self._promises = Promises(self.sets, fitter.without_simulations(effects))
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
        self._refiner.broken = evidence.broken  # the same for all sets, so that evidences compare
        self.sets[()] = self._refiner.judged((), self._screened)
        self._propose(self.sets.best)
        if certain := causes.certain():
            self._promises.demand(certain)
        if self._promises:
            self._fit_promising()
        fit = self.sets.best.fitted.fit
        self._refiner.broken = find_broken(fit.evidence, fit.chosen).broken
        for names, one in sorted(self.sets.items(), key=lambda item: len(item[0])):
            judged = self._refiner.judged(names, one.fitted.curves)
            judged = dataclasses.replace(judged, finished=one.finished)
            self.sets[names] = self.sets.bounded(judged)
        return self.sets.best.fitted, self._with_own(self._compared(self.sets.best))

    def _fit_promising(self) -> None:
        """Fit the sets of which enough is promised, and those that are probable in the end."""
        self._fit_set(())  # linearised as close to its fit as they will be to theirs
        self._confirm_best()
        for _ in range(MOST_SETS):
            names = self._promises.best(self.refused)
            if names is None:
                self._finish()
                names = self._probable()
            if names is None:
                return
            self._fit_set(names)
            self._confirm_best()
            if names in self.sets:
                self._propose(self.sets[names])
        self._finish()

    def _probable(self) -> Names | None:
        """Return the most probable set that was not fitted; None if none is probable."""
        probable = self._with_own(self._compared(self.sets.best)).probable()
        known = {*self.sets, *self.refused}
        left = {n: p for n, p in probable.items() if n not in known and p > PROBABLE}
        return max(left, key=left.__getitem__, default=None)

    def _propose(self, start: Reached) -> None:
        self._promises.propose(start, self._compared(start))

    def _fit_set(self, names: Names) -> None:
        """Fit a set, starting from its best subset that was reached."""
        part = self.sets.part(names)
        start = part.fitted
        reached = self._refiner.judged(names, start.curves)
        shrunk = 0  # linearisations in which the effects became smaller
        for number in range(ROUNDS):
            if reached.fitted.steady or (number and self._behind(reached, shrunk)):
                break
            try:
                reached = self._refiner.moved(names, reached.fitted)
            except SpecificationError as error:
                if names not in self.sets:  # the baseline is there from the screening on
                    self.refused[names] = str(error)
                return
            shrunk += self._shrinks(reached, part)
        self.sets[names] = reached = self.sets.bounded(reached)
        self._promises.learn(part, reached)
        log.info("%s", reached)

    def _behind(self, reached: Reached, shrunk: int) -> bool:
        """Return whether a simulated set is so far behind the best one that it is given up.

        A set that contains the best one cannot be far worse where it fits. It is given up only if
        what it adds has become smaller twice, because it fits best with next to nothing of it.
        """
        names, best = reached.names, self.sets.best
        allowed = FREE_RIVAL if self._promises.is_rival_pair(names) else CLOSE
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
        while not self.sets.best.finished:
            self.sets[self.sets.best.names] = self._refiner.finished(self.sets.best)

    def _finish(self) -> None:
        """Fit the best sets further, with every curve simulated, until they are steady.

        Sets that contain the best one and more are left out: what they add explains too little.
        Where the best one is the set without effects, only those that are much worse are left out.
        """
        while True:
            best = self.sets.best
            within = WITHIN if best.names else WITHIN_OF_NOTHING
            left = [
                one
                for one in self.sets.values()
                if not one.finished
                and (not one.names or one.score > best.score - within)
                and not (best.names and set(one.names) > set(best.names))
            ]
            if left:
                one = max(left, key=lambda reached: reached.score)
                self.sets[one.names] = self._refiner.finished(one)
                continue
            rivals = [
                one
                for one in self.sets.values()
                if one.finished
                and not one.closest
                and (not one.names or one.score > best.score - RIVALS)
            ]
            if not (best.names and rivals):
                return
            one = max(rivals, key=lambda reached: reached.score)
            self.sets[one.names] = self._refiner.closest(one)

    def _compared(self, reached: Reached) -> Causes:
        """Compare all sets by the linearisation near where one of them fits."""
        return find_causes(reached.fitted.fit.evidence, self.refused)

    def _with_own(self, found: Causes) -> Causes:
        """Return the posterior with the own evidence of the sets reached, see `best`.

        Probabilities are averages over the errors of these evidences.
        """
        own = np.full((len(self.sets), len(found.sets)), -np.inf)
        for k, (names, reached) in enumerate(self.sets.items()):
            if reached.score > self.sets.best.score - CLOSE:
                there = found if reached is self.sets.best else self._compared(reached)
                part = {found.names.index(name) for name in names}
                larger = np.array([part <= set(chosen) for chosen in found.sets])
                own[k, larger] = (there.log_evidence + reached.score - there.score(names))[larger]
                own[k, larger] -= [
                    self._promises.excess((found.names[i] for i in set(chosen) - part), len(names))
                    for chosen in np.array(found.sets, dtype=object)[larger]
                ]
        for k, (names, reached) in enumerate(self.sets.items()):
            row = found.row(names)
            own[:, row] = -np.inf
            own[k, row] = found.log_evidence[row] + reached.score - found.score(names)
        return found.averaged(own, SCORE_ERROR)

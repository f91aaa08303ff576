"""Refinement of the fit of one set of effects, by further simulations."""

from __future__ import annotations

import dataclasses
import logging
import math
from collections.abc import Mapping

from ramiefenics.discovery.curves.linearised import Linearised
from ramiefenics.discovery.search.fitted import Fitted
from ramiefenics.discovery.search.fitted_sets import FittedSets, Names, Reached
from ramiefenics.discovery.search.fitting import Fitter
from ramiefenics.discovery.statistics.causes import own_score
from ramiefenics.effects import Effect
from ramiefenics.specification import SpecificationError
from ramiefenics.surrogate import CLOSE_TOLERANCE

log = logging.getLogger(__name__)

ROUNDS, LAST_ROUNDS = 4, 8
"""Maximum number of linearisations with few simulations until a set is steady, and of those with
every curve simulated."""

CLOSE = 8.0
"""Log-probability by which a set may be worse than the best one where it is simulated and still be
fitted further."""

CLOSEST, CLOSEST_ROUNDS = 0.4, 2
"""Distance (see `Fitted`) of a fit from where it is linearised at which no further linearisation is
needed to compare it with its rivals, and maximum number of these."""

UNSTEADY = 2.0
"""Distance above which derivatives are taken to be useless, such as those of stalks that jump."""

FEW = 24
"""Number of curves up to which all are simulated for this."""


class Refiner:
    """Refines the fits of sets of effects.

    Parameters
    ----------
    fitter, screened, effects
        As for `Search`.
    sets
        Sets that have been fitted so far.

    Attributes
    ----------
    broken
        Indices of the specimens that are taken for broken, the same for all sets, so that their
        evidences compare.
    """

    def __init__(
        self,
        fitter: Fitter,
        screened: Linearised,
        effects: Mapping[str, Effect],
        sets: FittedSets,
    ) -> None:
        self._fitter, self._screened, self._effects, self._sets = fitter, screened, effects, sets
        self.broken: frozenset[int] = frozenset()

    def finished(self, reached: Reached) -> Reached:
        """Fit a set with every curve simulated, until it is steady."""
        names = reached.names
        others = [one.score for other, one in self._sets.items() if other != names]
        for number in range(LAST_ROUNDS):
            if number > 1 and reached.score < max(others, default=-math.inf) - CLOSE:
                break  # learned curves had made it seem better than it is
            try:
                reached = self.settled(names, reached)
                curves = self._fitter.confirm(reached.fitted.curves, CLOSE_TOLERANCE)
            except SpecificationError as error:
                log.info("the set %s cannot be fitted any better: %s", names, error)
                break
            reached = self.judged(names, curves)
            if reached.fitted.steady:
                break
        log.info("%s", reached)
        return self._sets.bounded(dataclasses.replace(reached, finished=True))

    def closest(self, reached: Reached) -> Reached:
        """Linearise a finished set as close to its fit as possible.

        Where a set counts as steady, forces may still be wrong by a thousandth of the peak at its
        fit. Over all curves this amounts to 2 in log-evidence and more.
        """
        tolerance = 0.0 if len(reached.fitted.curves.force) <= FEW else CLOSE_TOLERANCE
        tried = []
        for _ in range(CLOSEST_ROUNDS):
            try:
                moved = self.moved(reached.names, reached.fitted, within=0.0)
                curves = self._fitter.confirm(moved.fitted.curves, tolerance)
            except SpecificationError as error:
                log.info("the set %s stays where it is: %s", reached.names, error)
                break
            moved = self.judged(reached.names, curves)
            if moved.fitted.distance > UNSTEADY:
                break
            reached = moved
            tried.append(reached)
            if reached.fitted.distance < CLOSEST:
                break
        reached = min(tried, key=lambda one: one.fitted.distance, default=reached)
        log.info("%s", reached)
        reached = dataclasses.replace(reached, finished=True, closest=True)
        return self._sets.bounded(reached)

    def settled(self, names: Names, reached: Reached) -> Reached:
        """Move a set until it is steady, as each move needs only a few simulations.

        Moves that make it fit worse are left out, but for the first: what few simulations predict
        may be wrong where they lead.
        """
        for number in range(ROUNDS):
            if reached.fitted.steady:
                break
            try:
                moved = self.moved(names, reached.fitted)
            except SpecificationError:
                if not number:
                    raise
                break
            if number and moved.score < reached.score:
                break
            reached = moved
        return reached

    def moved(self, names: Names, fitted: Fitted, within: float = 1.0) -> Reached:
        """Simulate a set near where it fits, see `Fitter.move`."""
        moved = self._fitter.move(fitted, {name: self._effects[name] for name in names}, within)
        by_effects = {**self._screened.by_effects, **moved.by_effects}
        moved = dataclasses.replace(moved, by_effects=by_effects)
        return self.judged(names, moved)

    def judged(self, names: Names, curves: Linearised) -> Reached:
        """Fit a set to curves linearised near where it fits."""
        fit = self._fitter.fit(curves, self._effects, names, self.broken)
        return Reached(Fitted(curves, fit), own_score(fit.evidence, names, fit.scatter))

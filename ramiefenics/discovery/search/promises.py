"""What derivatives promise of sets of effects that have not been fitted.

Where derivatives have promised too much of an effect before, the excess is deducted.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Sequence

from ramiefenics.discovery.search.fitted_sets import FittedSets, Names, Reached
from ramiefenics.discovery.statistics.causes import Causes

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


class Promises:
    """What derivatives promise of sets of effects, and which of them are worth fitting.

    Parameters
    ----------
    fitted
        All sets that have been fitted.
    free
        Effects that need no simulations.
    """

    def __init__(self, fitted: FittedSets, free: Collection[str]) -> None:
        self._fitted, self._free = fitted, frozenset(free)
        # scores, by the size of the set where they were promised
        self._promised: dict[Names, dict[int, float]] = {}
        # promise minus score, by added effect and the size of the set where it was promised
        self._overrated: dict[tuple[str, int], list[float]] = {}
        self._insisted: set[Names] = set()  # fitted however good other sets are

    def __len__(self) -> int:
        """Return the number of sets of which something was promised."""
        return len(self._promised)

    def demand(self, names: Names) -> None:
        """Have a set fitted, whatever its size."""
        self._promised[names] = {0: math.inf}

    def propose(self, start: Reached, found: Causes) -> None:
        """Note what derivatives promise of larger sets.

        Parameters
        ----------
        start
            Set that fits where the derivatives were computed.
        found
            Comparison of all sets by these derivatives.
        """
        here = set(start.names)
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
        here, promise = self._promised.setdefault(names, {}), start.score + gain
        here[len(start.names)] = max(promise, here.get(len(start.names), promise))

    def _expected(self, names: Names) -> float:
        """Return the score promised of a set, less the excess promised of its effects before.

        Each promise is only compared with those made at sets of the same size, because derivatives
        where one effect fits may be right though those at the baseline were not.
        """
        added = {*names} - {*self._fitted.part(names).names}
        return max(
            promise - self.excess(added, size) for size, promise in self._promised[names].items()
        )

    def excess(self, added: Iterable[str], size: int) -> float:
        """Return the mean excess that derivatives have promised, the largest of added effects.

        Parameters
        ----------
        added
            The effects.
        size
            Number of effects of the sets where it was promised.
        """
        before = [self._overrated.get((name, size), ()) for name in added]
        return max([0.0, *(sum(some) / len(some) for some in before if some)])

    def best(self, refused: Collection[Names]) -> Names | None:
        """Return the set to be fitted next; None if no further set is worth it."""
        known = {*self._fitted, *refused}
        left = {n: self._expected(n) for n in self._promised if n not in known}
        worth = [n for n, score in left.items() if score > self._least(n) or self._insists_on(n)]
        return min(worth, key=lambda names: (len(names), -left[names]), default=None)

    def _insists_on(self, names: Names) -> bool:
        """Return whether a set is fitted although another one promises more.

        A pair that contains the best set is not, because promises are right where that set fits.
        """
        if names not in self._insisted:
            return False
        promised = max(self._promised[names].values())
        promising = promised > self._fitted.best.score - FREE_RIVAL
        return len(names) == 1 or (promising and not set(names) > set(self._fitted.best.names))

    def _least(self, names: Names) -> float:
        """Return the score that must be promised of a set for it to be fitted."""
        more = set(names) > set(self._fitted.best.names)
        return self._fitted.best.score - (LARGER if more else RIVAL)

    def learn(self, part: Reached, reached: Reached) -> None:
        """Note what was promised of a set in excess of its score.

        Parameters
        ----------
        part
            The set from which it was fitted.
        reached
            The set.
        """
        names = reached.names
        for size, promise in self._promised.get(names, {}).items():
            if math.isfinite(promise):
                for name in set(names) - set(part.names):
                    excess = promise - reached.score
                    self._overrated.setdefault((name, size), []).append(excess)

    def is_rival_pair(self, names: Names) -> bool:
        """Return whether a set is a pair of effects without simulations that is to be fitted."""
        return len(names) == PAIR and names in self._insisted

"""Change of all curves by a step of an effect's amplitude, from simulations of a few stalks."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from ramiefenics.discovery.changed_curves import Carried, following
from ramiefenics.discovery.standing import Place, change_of
from ramiefenics.specification import BendingTest


@dataclass(frozen=True)
class Stepping:
    """A step in two parts: in the numbers by which specimens differ, and in all the rest.

    The first part, see `following`, changes curves as it changes those without any effect, which
    are learned.

    Attributes
    ----------
    without, without_after
        Specifications without effects, before and after the first part.
    before, between, after
        Specifications before, between and after the two parts.
    carried
        Simulations for the second part, and how they are carried over.
    known
        Whether the curve of each stalk before the step is one without effects, and so is learned.
    """

    without: Sequence[BendingTest]
    without_after: Sequence[BendingTest]
    before: Sequence[BendingTest]
    between: Sequence[BendingTest]
    after: Sequence[BendingTest]
    carried: Carried
    known: Sequence[bool]

    @classmethod
    def of(
        cls,
        without: Sequence[BendingTest],
        before: Sequence[BendingTest],
        after: Sequence[BendingTest],
    ) -> Stepping:
        """Choose what is simulated.

        Parameters
        ----------
        without, before, after
            Specifications without any effect, before the step, and after it.
        """
        between = following(before, after)
        without, without_after = (following(without, some) for some in (before, between))
        known = [
            Place.of(one).is_at(Place.of(other)) for one, other in zip(without, before, strict=True)
        ]
        return cls(
            without, without_after, before, between, after, Carried.of(between, after), known
        )

    @property
    def simulated(self) -> list[BendingTest]:
        """Specifications whose curves are needed."""
        pairs = zip(self.without, self.without_after, strict=True)
        chosen = self.carried.chosen
        return [
            *(one for i, pair in enumerate(pairs) if self._follows(i) for one in pair),
            *(self.after[i] for i in chosen),
            *(self.between[i] for i in chosen if not self.known[i]),
        ]

    def stepped(
        self, curves: Sequence[pd.DataFrame], of: Callable[[BendingTest], pd.DataFrame]
    ) -> list[pd.DataFrame]:
        """Return curves after the step.

        Parameters
        ----------
        curves
            Curves before the step.
        of
            Returns the curve of a specification in `simulated`.
        """
        followed = list(curves)
        for i, curve in enumerate(curves):
            if self._follows(i):
                at, share = change_of(of(self.without[i]), of(self.without_after[i]))
                factor = 1.0 + np.interp(curve["displacement_mm"], at, share)
                followed[i] = curve.assign(force_N=curve["force_N"] * factor)
        pairs = {
            i: (followed[i] if self.known[i] else of(self.between[i]), of(self.after[i]))
            for i in self.carried.chosen
        }
        return self.carried.changed(followed, pairs)

    def _follows(self, i: int) -> bool:
        return self.between[i] is not self.before[i]

"""Change of all curves by a step of an effect's amplitude, from simulations of a few stalks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from ramiefenics.discovery.curves.changed_curves import Carried, following
from ramiefenics.discovery.curves.standing import change_of
from ramiefenics.specification import BendingTest
from ramiefenics.surrogate.coordinates import Direction


@dataclass(frozen=True)
class Stepping:
    """A step in two parts: in the numbers by which specimens differ, and in all the rest.

    The first part, see `following`, changes curves as it changes those without any effect, which
    are learned.

    Attributes
    ----------
    without, without_after
        Specifications without effects, before and after the first part.
    between, after
        Specifications before and after the second part.
    follows
        Whether the first part changes each specification.
    carried
        Simulations for the second part, and how they are carried over.
    """

    without: Sequence[BendingTest]
    without_after: Sequence[BendingTest]
    between: Sequence[BendingTest]
    after: Sequence[BendingTest]
    follows: Sequence[bool]
    carried: Carried

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
        follows = [one is not other for one, other in zip(between, before, strict=True)]
        return cls(without, without_after, between, after, follows, Carried.of(between, after))

    @property
    def simulated(self) -> list[tuple[BendingTest, tuple[Direction, ...]]]:
        """Specifications whose curves are needed, and directions of their derivatives."""
        pairs = zip(self.without, self.without_after, self.follows, strict=True)
        plain = [(one, ()) for *pair, follows in pairs if follows for one in pair]
        return plain + [
            one
            for i, near in self.carried.represented.items()
            for one in (
                (self.between[i], near.before.directions),
                (self.after[i], near.after.directions),
            )
        ]

    def stepped(
        self, curves: Sequence[pd.DataFrame], simulated: Sequence[pd.DataFrame]
    ) -> list[pd.DataFrame]:
        """Return curves after the step.

        Parameters
        ----------
        curves
            Curves before the step.
        simulated
            Curves of the specifications in `simulated`.
        """
        followed, of = list(curves), iter(simulated)
        for i, curve in enumerate(curves):
            if self.follows[i]:
                at, share = change_of(next(of), next(of))
                factor = 1.0 + np.interp(curve["displacement_mm"], at, share)
                followed[i] = curve.assign(force_N=curve["force_N"] * factor)
        pairs = {i: (next(of), next(of)) for i in self.carried.represented}
        return self.carried.changed(followed, pairs)

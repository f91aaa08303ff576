"""Directions in which effects change specifications in proportion to their amplitudes."""

from __future__ import annotations

from collections.abc import Mapping

from ramiefenics.effects import Effect
from ramiefenics.runs.curve import normalised
from ramiefenics.specification import BendingTest
from ramiefenics.surrogate.coordinates import Direction, numbers

ROUNDING = 1e-9
"""Relative difference up to which numbers of two specifications are the same."""


def directions_of(effects: Mapping[str, Effect], test: BendingTest) -> dict[str, Direction]:
    """Return the directions of those effects that change more than the machine and all moduli.

    An error of the machine and a factor on all moduli need no simulation.

    Parameters
    ----------
    effects
        Effects that change numbers of the specification, in proportion to their amplitudes.
    test
        Specification of one curve; the directions are the same for all.
    """
    before, found = numbers(normalised(test)[0]), {}
    for name, effect in effects.items():
        after = numbers(normalised(effect.apply(test, effect.typical))[0])
        rates = {
            path: (after[path] - value) / effect.typical
            for path, value in before.items()
            if abs(after[path] - value) > ROUNDING * (1.0 + abs(value))
        }
        if rates:
            found[name] = Direction(name, tuple(rates), tuple(rates.values()))
    return found

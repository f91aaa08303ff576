"""Several effects in one specification, and which of them cannot be combined."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Mapping

from ramiefenics.effects.base import Effect
from ramiefenics.specification import BendingTest, SpecificationError
from ramiefenics.specification.checks import checked_number


def with_effects(test: BendingTest, effects: Iterable[tuple[Effect, float]]) -> BendingTest:
    """Return the specification with effects of given amplitudes, applied one after the other.

    Raises
    ------
    SpecificationError
        If an amplitude is outside the bounds, or an effect has no meaning for the specification.
    """
    for effect, amplitude in effects:
        low, high = effect.bounds
        unit = "" if effect.unit == "1" else effect.unit
        checked_number(f"effect {effect.name}", amplitude, at_least=low, at_most=high, unit=unit)
        try:
            test = effect.apply(test, amplitude)
        except SpecificationError as error:
            field = f"with {effect.name} = {amplitude:g}: {error.field}"
            raise SpecificationError(field, error.value, error.allowed) from error
    return test


def exclusions(test: BendingTest, effects: Mapping[str, Effect]) -> dict[tuple[str, str], str]:
    """Return the ordered pairs of effects that the specification refuses, with the reason.

    Each effect has its typical amplitude. If only one of the two orders is refused, the effects can
    be combined in the other.

    Parameters
    ----------
    test
        A specification to which each effect can be applied alone.
    effects
        Effects by name.
    """
    refused = {}
    for first, second in itertools.permutations(effects.values(), 2):
        try:
            with_effects(test, [(effect, effect.typical) for effect in (first, second)])
        except SpecificationError as error:
            refused[first.name, second.name] = str(error)
    return refused

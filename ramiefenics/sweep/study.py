"""Simulation of a specification with all combinations of given values."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd

from ramiefenics.effects.base import Effect
from ramiefenics.effects.combining import with_effects
from ramiefenics.model.laws import check_law
from ramiefenics.runs import Done, KeptRun, Runs, Simulation
from ramiefenics.specification import BendingTest, SpecificationError, override
from ramiefenics.specification.files import parse_value, to_dict
from ramiefenics.specification.short_keys import full_key
from ramiefenics.specification.sources import Source, as_test
from ramiefenics.sweep.outcome import NUMBERS, Sweep

MOST = 10_000
"""Largest number of runs in a sweep."""

Value = float | int | str | bool


def sweep(
    test: Source,
    values: Mapping[str, Sequence[Value]] | None = None,
    effects: Sequence[tuple[Effect, Sequence[float]]] = (),
    runs: Runs | None = None,
    **changes: Any,
) -> Sweep:
    """Simulate a test with all combinations of given values.

    Parameters
    ----------
    test
        The specification to start from, its file, or the name of a published one.
    values
        Values to try, by key, as for `override`: ``{"indenter_radius_mm": [5, 10]}``.
    effects
        Effects and their amplitudes to try. Effects are added after all values are set, in the
        order given.
    runs
        Runs the simulations; by default on all cores, with results kept in the user's cache.
    changes
        Changes to the specification to start from, see `as_test`.

    Raises
    ------
    SpecificationError
        If a key, value or amplitude is refused, or there are no runs or too many. Nothing has been
        simulated then.
    KeyboardInterrupt
        If the user interrupts the sweep; finished simulations are kept.
    """
    test = as_test(test, **changes)
    values = {} if values is None else values
    tried = [*values.values(), *(amplitudes for _, amplitudes in effects)]
    number = math.prod(map(len, tried))
    if not tried or not 0 < number <= MOST:
        raise SpecificationError("sweep", 0 if not tried else number, f"must be 1 to {MOST} runs")
    _check_distinct(test, values, [effect.name for effect, _ in effects])
    chosen = list(itertools.product(*tried))
    tests = [_changed(test, list(values), [effect for effect, _ in effects], row) for row in chosen]
    for changed in tests:
        check_law(changed)
    done = (Runs() if runs is None else runs).map([Simulation(changed) for changed in tests])
    table = pd.DataFrame(chosen, columns=[*values, *(effect.name for effect, _ in effects)])
    numbers = pd.DataFrame([_row(one) for one in done])
    return Sweep(
        test,
        pd.concat([table, numbers], axis=1),
        tuple(one.value for one in done),
        {effect.name: effect.unit for effect, _ in effects},
    )


def _changed(
    test: BendingTest, keys: Sequence[str], effects: Sequence[Effect], row: Sequence[Any]
) -> BendingTest:
    """Return a test with the values of a row: those of the keys, then the effects' amplitudes."""
    changed = override(test, dict(zip(keys, row, strict=False)))
    return with_effects(changed, zip(effects, row[len(keys) :], strict=True))


def _check_distinct(
    test: BendingTest, values: Mapping[str, Sequence[Value]], effects: Sequence[str]
) -> None:
    """Check that no key is given both in short and as a whole, and no effect twice."""
    for number, name in enumerate(effects):
        if name in values or name in effects[:number]:
            raise SpecificationError(f"effect {name}", name, "must not be given twice")
    data, names = to_dict(test), dict[str, str]()
    for name, some in values.items():
        key = full_key(data, name, some[0])
        if key in names:
            allowed = f"must not be given twice: {names[key]} is the same key"
            raise SpecificationError(name, list(some), allowed)
        names[key] = name


def values_by_key(
    assignments: Iterable[str], option: str = "--set"
) -> dict[str, tuple[Value, ...]]:
    """Return the values of several assignments of an option by key, see `values_of`.

    Raises
    ------
    SpecificationError
        If an assignment is malformed, or a key is given twice.
    """
    values: dict[str, tuple[Value, ...]] = {}
    for assignment in assignments:
        key, some = values_of(assignment, option)
        if key in values:
            allowed = f"must not be given twice; list all values at once, as in {key}=1,2"
            raise SpecificationError(option, assignment, allowed)
        values[key] = some
    return values


def values_of(assignment: str, option: str = "--set") -> tuple[str, tuple[Value, ...]]:
    """Return the key and the values of ``key=low:high:number`` or ``key=value,value``.

    Raises
    ------
    SpecificationError
        If the assignment has neither form.
    """
    key, equals, text = (part.strip() for part in assignment.partition("="))
    if not key or not equals or not text:
        allowed = "must be of the form key=low:high:number or key=value,value"
        raise SpecificationError(option, assignment, allowed)
    parts = text.split(":")
    if len(parts) == 1:
        return key, tuple(_parsed(one.strip()) for one in text.split(","))
    try:
        low, high, number = float(parts[0]), float(parts[1]), int(parts[2])
        if len(parts) != 3 or not np.isfinite([low, high]).all() or not 2 <= number <= MOST:
            raise ValueError
    except (ValueError, IndexError) as error:
        allowed = f"must be low:high:number, with a number of values from 2 to {MOST}"
        raise SpecificationError(key, text, allowed) from error
    return key, tuple(float(f"{one:.12g}") for one in np.linspace(low, high, number))


def _parsed(text: str) -> Value:
    value = parse_value(text)
    return value if isinstance(value, (float, int, bool)) else text


def _row(done: Done[KeptRun]) -> dict[str, Any]:
    if done.value is None:
        failed = {"still_rising": None, "ending": f"failed: {done.error}"}
        return dict.fromkeys(NUMBERS, math.nan) | failed
    result = done.value.result
    known = result.completed or result.has_force_maximum  # otherwise the force still rose
    return {
        "max_force_N": result.max_force_N if known else math.nan,
        "displacement_at_max_mm": result.displacement_at_max_mm if known else math.nan,
        "slope_N_per_mm": result.slope_N_per_mm if known else math.nan,
        "still_rising": not result.has_force_maximum,
        "ending": "completed" if result.completed else result.ending.reason,
    }

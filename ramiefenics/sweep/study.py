"""Simulation of a specification with all combinations of given values."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import Executor
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

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
    values: Mapping[str, Sequence[Value]],
    executor: Executor | None = None,
    folder: Path | None = None,
    on_done: Callable[[int], None] | None = None,
    **changes: Any,
) -> Sweep:
    """Simulate a test with all combinations of given values.

    Parameters
    ----------
    test
        The specification to start from, its file, or the name of a published one.
    values
        Values to try, by key, as for `override`: ``{"indenter_radius_mm": [5, 10]}``.
    executor, folder, on_done
        Executor of the simulations, folder in which they are kept, and callback on progress: see
        `Runs`.
    changes
        Changes to the specification to start from, see `as_test`.

    Raises
    ------
    SpecificationError
        If a key or value is refused, or there are no runs or too many. Nothing has been simulated
        then.
    KeyboardInterrupt
        If the user interrupts the sweep; finished simulations are kept.
    """
    test = as_test(test, **changes)
    number = math.prod(map(len, values.values()))
    if not values or not 0 < number <= MOST:
        raise SpecificationError("sweep", number, f"must be 1 to {MOST} runs")
    _check_distinct(test, values)
    chosen = list(itertools.product(*values.values()))
    tests = [override(test, dict(zip(values, row, strict=True))) for row in chosen]
    for changed in tests:
        check_law(changed)
    done = Runs(folder, executor, on_done).map([Simulation(changed) for changed in tests])
    table = pd.DataFrame(chosen, columns=list(values))
    numbers = pd.DataFrame([_row(one) for one in done])
    return Sweep(test, pd.concat([table, numbers], axis=1), tuple(one.value for one in done))


def _check_distinct(test: BendingTest, values: Mapping[str, Sequence[Value]]) -> None:
    """Check that no key is given both in short and as a whole."""
    data, names = to_dict(test), dict[str, str]()
    for name, some in values.items():
        key = full_key(data, name, some[0])
        if key in names:
            allowed = f"must not be given twice: {names[key]} is the same key"
            raise SpecificationError(name, list(some), allowed)
        names[key] = name


def values_by_key(assignments: Iterable[str]) -> dict[str, tuple[Value, ...]]:
    """Return the values of several assignments by key, see `values_of`.

    Raises
    ------
    SpecificationError
        If an assignment is malformed, or a key is given twice.
    """
    values: dict[str, tuple[Value, ...]] = {}
    for assignment in assignments:
        key, some = values_of(assignment)
        if key in values:
            allowed = f"must not be given twice; list all values at once, as in {key}=1,2"
            raise SpecificationError("--set", assignment, allowed)
        values[key] = some
    return values


def values_of(assignment: str) -> tuple[str, tuple[Value, ...]]:
    """Return the key and the values of ``key=low:high:number`` or ``key=value,value``.

    Raises
    ------
    SpecificationError
        If the assignment has neither form.
    """
    key, equals, text = (part.strip() for part in assignment.partition("="))
    if not key or not equals or not text:
        allowed = "must be of the form key=low:high:number or key=value,value"
        raise SpecificationError("--set", assignment, allowed)
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

"""Simulation of a specification with all combinations of given values."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from ramiefenics.model.laws import check_law
from ramiefenics.runs import Done, KeptRun, Runs, Simulation
from ramiefenics.specification import SpecificationError, override
from ramiefenics.specification.files import parse_value
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
) -> Sweep:
    """Simulate a test with all combinations of given values.

    Parameters
    ----------
    test
        The specification to start from, its file, or the name of a published one.
    values
        Values to try, by dotted key, as for `override`.
    executor, folder, on_done
        Executor of the simulations, folder in which they are kept, and callback on progress: see
        `Runs`.

    Raises
    ------
    SpecificationError
        If a key or value is refused, or there are no runs or too many. Nothing has been simulated
        then.
    KeyboardInterrupt
        If the user interrupts the sweep; finished simulations are kept.
    """
    test = as_test(test)
    number = math.prod(map(len, values.values()))
    if not values or not 0 < number <= MOST:
        raise SpecificationError("sweep", number, f"must be 1 to {MOST} runs")
    chosen = list(itertools.product(*values.values()))
    tests = [override(test, dict(zip(values, row, strict=True))) for row in chosen]
    for changed in tests:
        check_law(changed)
    done = Runs(folder, executor, on_done).map([Simulation(changed) for changed in tests])
    table = pd.DataFrame(chosen, columns=list(values))
    numbers = pd.DataFrame([_row(one) for one in done])
    return Sweep(test, pd.concat([table, numbers], axis=1), tuple(one.value for one in done))


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
        return dict.fromkeys(NUMBERS, math.nan) | {"ending": f"failed: {done.error}"}
    result = done.value.result
    known = result.completed or result.has_force_maximum  # otherwise the force still rose
    return {
        "max_force_N": result.max_force_N if known else math.nan,
        "displacement_at_max_mm": result.displacement_at_max_mm if known else math.nan,
        "slope_N_per_mm": result.slope_N_per_mm if known else math.nan,
        "ending": "completed" if result.completed else result.ending.reason,
    }

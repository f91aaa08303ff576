"""Whether learning curves takes less time than simulating them all."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ramiefenics.runs.curve import normalised
from ramiefenics.specification import BendingTest
from ramiefenics.surrogate.coordinates import coordinates, numbers
from ramiefenics.surrogate.directions import spanning
from ramiefenics.surrogate.learned import Kind
from ramiefenics.surrogate.pool import TIME

PER_DIRECTION = 9
"""Approximate number of simulations that curves are learned from, for each direction in which the
specifications differ: seven stalks with ten factors, over ranges of two to four times, took 121."""


def simulations_to_learn(tests: Sequence[BendingTest]) -> int | None:
    """Return about how many simulations it takes to learn the curves of some tests.

    It is None where simulating all tests takes less time, and for tests that continue after the
    first loading, because only this is learned.
    """
    if any(test.protocol.then for test in tests):
        return None
    kinds: dict[Kind, set[BendingTest]] = {}
    for test in tests:
        kinds.setdefault(Kind.of(test), set()).add(test)
    expected = sum(PER_DIRECTION * _directions(kind, [*some]) for kind, some in kinds.items())
    distinct = sum(map(len, kinds.values()))
    return expected if TIME * expected < distinct else None


def _directions(kind: Kind, tests: Sequence[BendingTest]) -> int:
    """Return the number of directions in which tests of one kind differ."""
    at = np.array([coordinates(numbers(normalised(test)[0]), kind.paths) for test in tests])
    return len(spanning(kind.paths, at - np.median(at, axis=0), np.abs(at).max(axis=0)))

"""Dimensions in which a simulation differs from the tests that it is compared with."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

from ramiefenics.specification import BendingTest


def _span_mm(test: BendingTest) -> float:
    beam = test.fixture.beam_mm
    return 0.0 if beam is None else beam.supports_mm


DIMENSIONS: dict[str, Callable[[BendingTest], float]] = {
    "span": _span_mm,
    "outer diameter": lambda test: test.stalk.outer_diameter_mm,
    "void diameter": lambda test: test.stalk.void_diameter_mm,
    "indenter radius": lambda test: test.fixture.indenter.radius_mm,
    "support radius": lambda test: test.fixture.support.radius_mm,
}
"""Dimensions, mm, that a simulation should have in common with the measured tests."""

SAME = 1e-3
"""Relative difference up to which two values of a dimension count as the same."""


def differences(simulated: BendingTest, measured: Sequence[BendingTest]) -> list[str]:
    """Return each dimension that is not the same in all measured tests as in the simulated one."""
    told = []
    for name, dimension in DIMENSIONS.items():
        own, others = dimension(simulated), [dimension(test) for test in measured]
        if not all(math.isclose(own, other, rel_tol=SAME) for other in others):
            low, high = (f"{pick(others):.4g}" for pick in (min, max))
            told.append(f"{name} {own:.4g} mm, not {low if low == high else f'{low} to {high}'} mm")
    return told

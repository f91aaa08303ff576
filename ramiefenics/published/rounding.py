"""Printed numbers, which stand for all that round to them."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from dataclasses import dataclass

SLACK = 1e-6
"""Share of the half unit by which a tie, such as 0.1875 for 0.188, may miss."""


@dataclass(frozen=True)
class Printed:
    """A number as printed.

    Parameters
    ----------
    value
        The number.
    half
        Half a unit of its last printed digit; 0 for what is exact.
    """

    value: float
    half: float = 0.0

    @classmethod
    def read(cls, text: str) -> Printed:
        """Return what a text such as ``84.50`` stands for; its last digit counts.

        Raises
        ------
        ValueError
            If it is no finite number.
        """
        value = float(text)
        if not math.isfinite(value):
            raise ValueError(text)
        mantissa, _, exponent = text.strip().lower().partition("e")
        decimals = len(mantissa.partition(".")[2]) - int(exponent or 0)
        return cls(value, 0.5 * 10.0**-decimals)

    def round(self, value: float) -> Printed:
        """Return another value, printed to the same digit."""
        unit = 2.0 * self.half
        return Printed(round(value / unit) * unit if unit else value, self.half)

    def agrees(self, low: float, high: float | None = None) -> bool:
        """Tell whether a value, or one between two bounds, rounds to this; NaN does not."""
        reach = self.half * (1.0 + SLACK) + 1e-12
        high = low if high is None else high
        return low <= self.value + reach and high >= self.value - reach

    def __str__(self) -> str:
        if not self.half:
            return f"{self.value:g}"
        return f"{self.value:.{max(0, round(-math.log10(2.0 * self.half)))}f}"


def recompute(formula: Callable[..., float], *inputs: Printed) -> tuple[float, float, float]:
    """Return a formula's value for printed numbers, and its range over all that round to them.

    Parameters
    ----------
    formula
        Monotonic in each of its arguments within their rounding, so that corners bound it.
    inputs
        Its arguments.

    Returns
    -------
    value, low, high
        In the formula's unit.
    """
    corners = itertools.product(*({p.value - p.half, p.value + p.half} for p in inputs))
    values = [formula(*corner) for corner in corners]
    return formula(*(p.value for p in inputs)), min(values), max(values)

"""Printed numbers, which represent all values that round to them."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from dataclasses import dataclass

SLACK = 1e-6
"""Tolerance, as a share of the half unit, for ties such as 0.1875 for 0.188."""


@dataclass(frozen=True)
class Printed:
    """A number as printed.

    Parameters
    ----------
    value
        Value of the number.
    half
        Half a unit of its last printed digit; 0 for an exact number.
    """

    value: float
    half: float = 0.0

    @classmethod
    def read(cls, text: str) -> Printed:
        """Return the number that a text such as ``84.50`` prints; its last digit counts.

        Raises
        ------
        ValueError
            If the text is not a finite number.
        """
        value = float(text)
        if not math.isfinite(value):
            raise ValueError(text)
        mantissa, _, exponent = text.strip().lower().partition("e")
        decimals = len(mantissa.partition(".")[2]) - int(exponent or 0)
        return cls(value, 0.5 * 10.0**-decimals)

    def round(self, value: float) -> Printed:
        """Return another value as if printed to the same digit."""
        unit = 2.0 * self.half
        return Printed(round(value / unit) * unit if unit else value, self.half)

    def agrees(self, low: float, high: float | None = None) -> bool:
        """Return whether a value, or any between two bounds, rounds to this one; false for NaN."""
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
        Function that is monotonic in each argument within its rounding, so that its extremes are at
        the ends of the rounding intervals.
    inputs
        Arguments of the formula.

    Returns
    -------
    value, low, high
        Value and ends of the range, in the formula's unit.
    """
    corners = itertools.product(*({p.value - p.half, p.value + p.half} for p in inputs))
    values = [formula(*corner) for corner in corners]
    return formula(*(p.value for p in inputs)), min(values), max(values)

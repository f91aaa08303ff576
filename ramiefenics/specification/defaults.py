"""Defaults that follow what is stated, for numbers that must be in ascending order."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from typing import Any

from ramiefenics.specification.checks import check_number
from ramiefenics.specification.errors import SpecificationError


class Default(float):
    """A number that was not stated, and moves if one that was stated contradicts it."""


def put_in_order(obj: Any, names: Sequence[str], unit: str = "") -> None:
    """Check that fields are positive numbers, and move defaults so that all are in order.

    Parameters
    ----------
    obj
        A dataclass instance under construction (frozen or not).
    names
        Names of the fields, in the order in which their values must ascend.
    unit
        Their unit, for messages.

    Raises
    ------
    SpecificationError
        If a value is not a positive number, or two stated values are not in order.
    """
    given = {name: getattr(obj, name) for name in names}
    stated = [name for name in names if not isinstance(given[name], Default)]
    for name in names:
        check_number(obj, name, above=0.0, unit=unit)
    values = {name: getattr(obj, name) for name in names}
    for lower, upper in itertools.pairwise(stated):
        if values[lower] > values[upper]:
            limit = f"{values[upper]:g}{f' {unit}' if unit else ''}"
            raise SpecificationError(lower, given[lower], f"must be at most {upper}, {limit}")
    for place, name in enumerate(names):
        if name not in stated:
            least = max((values[n] for n in names[:place] if n in stated), default=0.0)
            most = min((values[n] for n in names[place:] if n in stated), default=math.inf)
            object.__setattr__(obj, name, Default(min(max(values[name], least), most)))

"""Checks shared by the dataclasses of the specification."""

from __future__ import annotations

import dataclasses
import itertools
from typing import Any

from ramiefenics.specification.errors import SpecificationError

LARGEST, SMALLEST = 1e30, 1e-30
"""Largest magnitude of a number, and least distance from an open lower bound such as zero.

Beyond them, squares and inverses overflow.
"""

MOST = 10**9
"""Largest value of any count."""


def check_number(
    obj: Any,
    name: str,
    *,
    above: float | None = None,
    at_least: float | None = None,
    below: float | None = None,
    at_most: float | None = None,
    unit: str = "",
) -> None:
    """Check that a field is a finite number within bounds, and store it as a float.

    Parameters
    ----------
    obj
        A dataclass instance under construction (frozen or not).
    name
        Name of the field.
    above, at_least, below, at_most, unit
        As for `checked_number`.

    Raises
    ------
    SpecificationError
        If the value is not a finite number or is out of bounds.
    """
    value = checked_number(
        name,
        getattr(obj, name),
        above=above,
        at_least=at_least,
        below=below,
        at_most=at_most,
        unit=unit,
    )
    object.__setattr__(obj, name, value)


def checked_number(
    name: str,
    value: Any,
    *,
    above: float | None = None,
    at_least: float | None = None,
    below: float | None = None,
    at_most: float | None = None,
    unit: str = "",
) -> float:
    """Check that a value is a finite number within bounds, and return it as a float.

    Parameters
    ----------
    name
        Name of the value in the message.
    value
        Value to check.
    above, below
        Open bounds.
    at_least, at_most
        Closed bounds.
    unit
        Unit to name in the message.

    Raises
    ------
    SpecificationError
        If the value is not a finite number or is out of bounds.
    """
    if (
        isinstance(value, bool)
        or not isinstance(value, (int, float))
        or not abs(value) <= LARGEST
        or (above is not None and value - above < SMALLEST)
        or (at_least is not None and value < at_least)
        or (below is not None and value >= below)
        or (at_most is not None and value > at_most)
    ):
        bounds = [
            f"{word} {bound:g}{' ' + unit if unit else ''}"
            for word, bound in (
                ("above", above),
                ("at least", at_least),
                ("below", below),
                ("at most", at_most),
            )
            if bound is not None
        ]
        allowed = f"a number {' and '.join(bounds)}" if bounds else "a finite number"
        if isinstance(value, (int, float)) and LARGEST < abs(value) < float("inf"):
            allowed += f", at most {LARGEST:g} in magnitude"
        raise SpecificationError(name, value, f"must be {allowed}")
    return float(value)


def check_table(obj: Any, at: str, values: str, above: float | None = None) -> None:
    """Check that two fields form a table: ascending positions, and a value at each.

    Parameters
    ----------
    obj
        A dataclass instance under construction (frozen or not); both fields are stored as tuples.
    at, values
        Names of the fields.
    above
        Open lower bound of the values.

    Raises
    ------
    SpecificationError
        If the fields differ in length, positions do not ascend, or a number is out of bounds.
    """
    for name in (at, values):
        given = getattr(obj, name)
        if not isinstance(given, (list, tuple)):
            raise SpecificationError(name, given, "must be a list of numbers")
        bound = above if name == values else None
        numbers = tuple(checked_number(name, value, above=bound) for value in given)
        object.__setattr__(obj, name, numbers)
    places, number = getattr(obj, at), len(getattr(obj, values))
    if len(places) != number:
        allowed = f"must have as many entries as {values}, {number}"
        raise SpecificationError(at, list(places), allowed)
    if any(b <= a for a, b in itertools.pairwise(places)):
        raise SpecificationError(at, list(places), "must be in ascending order")


def check_integer(obj: Any, name: str, at_least: int) -> None:
    """Check that a field is an integer from `at_least` to `MOST`.

    Raises
    ------
    SpecificationError
        If it is not.
    """
    value = getattr(obj, name)
    if isinstance(value, bool) or not isinstance(value, int) or not at_least <= value <= MOST:
        allowed = f"must be a whole number from {at_least} to {MOST:,}"
        raise SpecificationError(name, value, allowed)


def check_text(obj: Any, name: str, empty: bool = True) -> None:
    """Check that a field is text, which may be empty by default.

    Raises
    ------
    SpecificationError
        If it is not.
    """
    value = getattr(obj, name)
    if not isinstance(value, str) or not (empty or value.strip()):
        allowed = "must be text" if empty else "must be text that is not empty"
        raise SpecificationError(name, value, allowed)


def check_choice(obj: Any, name: str, choices: tuple[Any, ...]) -> None:
    """Check that a field is one of `choices`.

    Raises
    ------
    SpecificationError
        If it is not.
    """
    value = getattr(obj, name)
    if not any(type(value) is type(choice) and value == choice for choice in choices):
        listed = ", ".join(repr(c) for c in choices)
        raise SpecificationError(name, value, f"must be one of {listed}")


def check_instance(obj: Any, name: str, cls: type) -> None:
    """Check that a field holds an instance of `cls`.

    Raises
    ------
    SpecificationError
        If it does not.
    """
    value = getattr(obj, name)
    if not isinstance(value, cls):
        fields = ", ".join(f.name for f in dataclasses.fields(cls))
        raise SpecificationError(name, value, f"must be a table ({cls.__name__}: {fields})")

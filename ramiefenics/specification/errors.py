"""The exception that all unusable input raises, and the warning about doubtful input."""

from __future__ import annotations

import sys
import warnings
from typing import Any

LONGEST, LONGEST_SENTENCE = 200, 1500
"""Most characters of a name or value that a message quotes, and of what is allowed."""

INSIDE = (__name__.partition(".")[0], "dataclasses")
"""Packages whose lines a warning does not name: this one, and what it makes its classes with."""


class SpecificationError(ValueError):
    """Input that cannot be used, explained in one sentence.

    Parameters
    ----------
    field
        Dotted name of the offending field, for instance ``fixture.span_mm``; empty for the input as
        a whole.
    value
        Value that was given; None if there was none.
    allowed
        What would be accepted, as the end of the sentence "... must ...".
    """

    def __init__(self, field: str, value: Any, allowed: str) -> None:
        self.field = field
        self.value = value
        self.allowed = allowed
        named = _cut(field, LONGEST)
        given = named if value is None else f"{named} = {_short(value)}"
        super().__init__(f"{given} {_cut(allowed, LONGEST_SENTENCE)}.")

    def __reduce__(self) -> tuple[type, tuple[str, Any, str]]:
        """Return what pickle needs to recreate the error in another process."""
        return type(self), (self.field, self.value, self.allowed)

    def inside(self, parent: str) -> SpecificationError:
        """Return the same error with `parent` in front of the field's name."""
        field = f"{parent}.{self.field}" if self.field else parent
        return SpecificationError(field, self.value, self.allowed)


def _short(value: Any) -> str:
    """Return the `repr` of a value, with its middle left out if it is long."""
    try:
        text = repr(value)
    except (RecursionError, ValueError):  # nested too deeply, or a number of too many digits
        text = f"<{type(value).__name__}>"
    return _cut(text, LONGEST)


def _cut(text: str, most: int) -> str:
    """Return a text with its middle left out if it is long."""
    return text if len(text) <= most else f"{text[: most - 40]} ... {text[-35:]}"


class SpecificationWarning(UserWarning):
    """Input that can be used but deserves a second look."""


def warn(message: str, category: type[Warning] = SpecificationWarning) -> None:
    """Issue a warning that names the line outside the package that led to it."""
    frame, level = sys._getframe().f_back, 2
    while frame is not None and frame.f_globals.get("__name__", "").split(".")[0] in INSIDE:
        frame, level = frame.f_back, level + 1
    warnings.warn(message, category, stacklevel=level)

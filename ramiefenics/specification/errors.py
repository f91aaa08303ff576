"""The one exception of bad input."""

from __future__ import annotations

from typing import Any

LONGEST = 200
"""Characters of a value that a message repeats."""


class SpecificationError(ValueError):
    """Input that cannot be used, told in one sentence.

    Parameters
    ----------
    field
        Dotted name of the offending field, for instance ``fixture.span_mm``; empty for the whole
        of what was given.
    value
        What was given; None if nothing was.
    allowed
        What would be accepted, as the end of the sentence "... must ...".
    """

    def __init__(self, field: str, value: Any, allowed: str) -> None:
        self.field = field
        self.value = value
        self.allowed = allowed
        super().__init__(f"{field if value is None else f'{field} = {_short(value)}'} {allowed}.")

    def __reduce__(self) -> tuple[type, tuple[str, Any, str]]:
        """Return how to make it again in another process."""
        return type(self), (self.field, self.value, self.allowed)

    def inside(self, parent: str) -> SpecificationError:
        """Return the same error with `parent` put before the field's name."""
        field = f"{parent}.{self.field}" if self.field else parent
        return SpecificationError(field, self.value, self.allowed)


def _short(value: Any) -> str:
    """Return a value as Python writes it, the middle left out if it is long."""
    try:
        text = repr(value)
    except (RecursionError, ValueError):  # nested too deeply, or a number of too many digits
        text = f"<{type(value).__name__}>"
    return text if len(text) <= LONGEST else f"{text[: LONGEST - 40]} ... {text[-35:]}"


class SpecificationWarning(UserWarning):
    """Input that can be used but deserves a second look."""

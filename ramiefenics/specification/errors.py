"""The one exception of bad input."""

from __future__ import annotations

from typing import Any


class SpecificationError(ValueError):
    """Input that cannot be used, told in one sentence.

    Parameters
    ----------
    field
        Dotted name of the offending field, for instance ``fixture.span_mm``.
    value
        What was given.
    allowed
        What would be accepted, as the end of the sentence "... must ...".
    """

    def __init__(self, field: str, value: Any, allowed: str) -> None:
        self.field = field
        self.value = value
        self.allowed = allowed
        super().__init__(f"{field} = {value!r}: {allowed}.")

    def inside(self, parent: str) -> SpecificationError:
        """Return the same error with `parent` put before the field's name."""
        return SpecificationError(f"{parent}.{self.field}", self.value, self.allowed)


class SpecificationWarning(UserWarning):
    """Input that can be used but deserves a second look."""

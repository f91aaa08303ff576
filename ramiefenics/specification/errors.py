"""The one exception of bad input."""

from __future__ import annotations

from typing import Any


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
        super().__init__(f"{field if value is None else f'{field} = {value!r}'} {allowed}.")

    def __reduce__(self) -> tuple[type, tuple[str, Any, str]]:
        """Return how to make it again in another process."""
        return type(self), (self.field, self.value, self.allowed)

    def inside(self, parent: str) -> SpecificationError:
        """Return the same error with `parent` put before the field's name."""
        field = f"{parent}.{self.field}" if self.field else parent
        return SpecificationError(field, self.value, self.allowed)


class SpecificationWarning(UserWarning):
    """Input that can be used but deserves a second look."""

"""Names and units in sentences."""

from __future__ import annotations

from collections.abc import Sequence


def words(name: str) -> str:
    """Return a name with spaces in place of underscores."""
    return name.replace("_", " ")


def listed(names: Sequence[str]) -> str:
    """Return names as a list in words, such as 'friction, taper and pith core'."""
    *first, last = map(words, names)
    return f"{', '.join(first)} and {last}" if first else last


def with_space(unit: str) -> str:
    """Return a unit with the space before it; nothing for a pure number."""
    return "" if unit == "1" else f" {unit}"

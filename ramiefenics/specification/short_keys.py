"""Keys of a specification by their last part, such as ``span_mm`` for ``fixture.span_mm``."""

from __future__ import annotations

import difflib
import functools
from collections.abc import Iterator, Mapping
from typing import Any

from ramiefenics.specification.errors import SpecificationError
from ramiefenics.specification.explained import keys
from ramiefenics.specification.files import labels, to_dict


def full_key(data: Mapping[str, Any], name: str, value: Any) -> str:
    """Return the whole dotted key that a name, with or without dots, is the last part of.

    Parameters
    ----------
    data
        Specification as nested mappings, whose lists tell the labels that keys contain.
    name
        Last part of a key, or all of it, which is not checked.
    value
        Value that is to be set, for messages.

    Raises
    ------
    SpecificationError
        If no key ends like this, or if several do.
    """
    if name.partition(".")[0] in data:
        return name
    every = set(_keys(data))
    fitting = sorted(key for key in every if key.endswith(f".{name}"))
    if len(fitting) == 1:
        return fitting[0]
    shown = to_dict(value) if isinstance(value, (str, int, float, bool)) else str(value)
    if not fitting:
        alike = every if "." in name else {key.rpartition(".")[2] for key in every}
        near = difflib.get_close_matches(name, sorted(alike), 1)
        hint = f"; the nearest is {near[0]!r}" if near else ""
        raise SpecificationError(name, shown, f"is not the name of any key{hint}")
    allowed = f"is ambiguous; state the whole key, which is one of {', '.join(fitting)}"
    raise SpecificationError(name, shown, allowed)


def _keys(data: Mapping[str, Any]) -> Iterator[str]:
    """Yield the dotted keys of all values and tables, with entries of lists by their labels."""
    for known in _paths():
        path, _, rest = known.partition(".NAME")
        if not rest:
            yield path
            continue
        entries: Any = data
        for part in path.split("."):
            entries = entries.get(part, {})
        for label in labels(entries) if isinstance(entries, list) else ():
            yield f"{path}.{label}{rest}"


@functools.cache
def _paths() -> tuple[str, ...]:
    """Return the paths of all keys, see `Key`."""
    return tuple(key.path for key in keys())

"""Specifications from names or files, with changes by short keys."""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from ramiefenics.specification.bending import BendingTest
from ramiefenics.specification.errors import SpecificationError
from ramiefenics.specification.explained import keys
from ramiefenics.specification.files import labels, override, read_test, to_dict

Source = BendingTest | str | Path
"""A specification, its TOML file, or its name."""

UNITS = (
    *("mm_per_MPa", "N_per_mm", "mm_per_N", "mm_per_s", "g_per_cm3", "per_m"),
    *("mm", "MPa", "N", "s", "deg"),
)
"""Units as they end the names of keys."""


def as_test(source: Source, **changes: Any) -> BendingTest:
    """Return a specification, with changes.

    Parameters
    ----------
    source
        A specification, a TOML file, or a name such as ``"table3"``.
    changes
        Values by the last part of their key, if that is unique (``indenter_radius_mm=10``), or
        nested, as in TOML (``fixture={"friction": {"static": 0.3}}``). A Pint quantity is converted
        to the unit of the key.

    Raises
    ------
    SpecificationError
        If there is no such specification or key, or a value is refused.

    Examples
    --------
    >>> as_test("table3", mesh="screening", indenter_radius_mm=10).fixture.indenter_radius_mm
    10.0
    """
    test = source if isinstance(source, BendingTest) else _found(source)
    values: dict[str, Any] = {}
    for name, value in changes.items():
        for key, one in _flat(_whole(test, name, value), value):
            values[key] = _in_unit(key, one)
    return override(test, values) if values else test


def _found(source: str | Path) -> BendingTest:
    text = str(source)
    if isinstance(source, str) and "/" not in text and not text.endswith(".toml"):
        found: BendingTest = sys.modules["ramiefenics"].published_test(text)  # it imports this file
        return found
    return read_test(source)


def _whole(test: BendingTest, name: str, value: Any) -> str:
    """Return the full dotted key that a name is the last part of."""
    fitting = sorted({key for key in _keys(test) if f".{key}".endswith(f".{name}")})
    first = [key for key in fitting if key == name] or fitting
    if len(first) == 1:
        return first[0]
    shown = to_dict(value) if isinstance(value, (str, int, float, bool)) else str(value)
    if not fitting:
        raise SpecificationError(name, shown, "is not the name of any key")
    allowed = f"is ambiguous; nest it, as in TOML, to name one of {', '.join(fitting)}"
    raise SpecificationError(name, shown, allowed)


def _keys(test: BendingTest) -> Iterator[str]:
    """Yield the dotted keys of all values and tables, with entries of lists by name."""
    data = to_dict(test)
    for key in keys():
        path, _, rest = key.path.partition(".NAME")
        if not rest:
            yield path
            continue
        entries = data
        for part in path.split("."):
            entries = entries.get(part, {})
        for label in labels(entries) if isinstance(entries, list) else ():
            yield f"{path}.{label}{rest}"


def _flat(key: str, value: Any) -> Iterator[tuple[str, Any]]:
    """Yield the dotted keys and the values of nested mappings."""
    if not isinstance(value, Mapping):
        yield key, value
        return
    for name, one in value.items():
        yield from _flat(f"{key}.{name}", one)


def _in_unit(key: str, value: Any) -> Any:
    """Return a Pint quantity as a number in the unit of the key; anything else unchanged."""
    if not (hasattr(value, "magnitude") and hasattr(value, "to")):
        return value
    unit = next((unit for unit in UNITS if key.endswith(f"_{unit}")), "")
    asked = re.sub(r"^per_", "1/", unit).replace("_per_", "/").replace("cm3", "cm^3")
    try:
        return float(value.to(asked or "dimensionless").magnitude)
    except Exception as error:  # those of Pint, which need not be installed
        allowed = f"must be a quantity in {asked}" if asked else "must be a pure number"
        raise SpecificationError(key, str(value), allowed) from error

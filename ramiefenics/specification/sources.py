"""Specifications from names or files, with changes by short keys."""

from __future__ import annotations

import dataclasses
import os
import sys
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from ramiefenics.specification.bending import BendingTest
from ramiefenics.specification.errors import SpecificationError
from ramiefenics.specification.explained import unit_of
from ramiefenics.specification.files import dump_test, is_file, override, read_test, to_dict
from ramiefenics.specification.short_keys import full_key

Source = BendingTest | str | Path
"""A specification, its TOML file, or its name."""


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
    if not changes:
        return test
    data, values = to_dict(test), {}
    for name, value in changes.items():
        for key, one in _flat(full_key(data, name, value), value):
            values[key] = _in_unit(key, one)
    return override(test, values)


def write_test(test: Source, path: str | Path, **changes: Any) -> None:
    """Write a specification so that `read_test` returns an equal one.

    If the path of the law's file is relative, it is made relative to the folder of `path`.

    Parameters
    ----------
    test
        The specification, its TOML file, or the name of a published one.
    path
        File to write.
    changes
        Changes to the specification, see `as_test`.

    Raises
    ------
    SpecificationError
        If there is no such specification, or a change is refused.
    """
    test, path = as_test(test, **changes), Path(path)
    if is_file(test.law) and not Path(test.law).is_absolute():
        test = dataclasses.replace(test, law=os.path.relpath(test.law, path.parent))
    path.write_text(dump_test(test), encoding="utf-8")


def _found(source: str | Path) -> BendingTest:
    text = str(source)
    if isinstance(source, str) and "/" not in text and not text.endswith(".toml"):
        found: BendingTest = sys.modules["ramiefenics"].published_test(text)  # it imports this file
        return found
    return read_test(source)


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
    asked = unit_of(key).replace("cm3", "cm^3")
    try:
        return float(value.to(asked or "dimensionless").magnitude)
    except Exception as error:  # those of Pint, which need not be installed
        allowed = f"must be a quantity in {asked}" if asked else "must be a pure number"
        raise SpecificationError(key, str(value), allowed) from error

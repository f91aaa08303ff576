"""Specifications as TOML: reading, writing, and overriding single values."""

from __future__ import annotations

import dataclasses
import difflib
import functools
import math
import shutil
import types
import typing
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, TypeVar

import tomli_w

from ramiefenics.specification.bending import BendingTest
from ramiefenics.specification.errors import SpecificationError, warn
from ramiefenics.specification.mesh_recipe import MeshRecipe, mesh_recipe
from ramiefenics.specification.reading import parse_toml, read_toml

T = TypeVar("T")

INFINITE = "inf"
"""Word that stands for an infinite number, such as the radius of a plate."""


def read_test(path: str | Path) -> BendingTest:
    """Read a test from a TOML file.

    Keys are the fields of the dataclasses, and tables nest as the dataclasses do. ``numerics.mesh``
    may be the name of a recipe, and ``law`` the path of a Python file relative to the folder of
    this file. Keys that are left out take their defaults. If friction is left out, a warning is
    issued, as the default is that of ramie.

    Raises
    ------
    SpecificationError
        If the file cannot be read, is not valid TOML, or does not describe a valid test.
    """
    data = read_toml(path)
    if is_file(data.get("law")):
        data["law"] = str(Path(path).parent / data["law"])
    test = test_from_dict(data)
    friction = data.get("fixture", {}).get("friction", {})
    if left_out := [name for name in ("static", "dynamic") if name not in friction]:
        values = ", ".join(f"{n} = {getattr(test.fixture.friction, n):g}" for n in left_out)
        warn(
            f"{Path(path).name} does not state fixture.friction: that of ramie on steel is used, "
            f"{values}"
        )
    return test


def archive_test(test: BendingTest, path: Path) -> None:
    """Write a test, and copy the file of its law, if it has one, to the same folder."""
    if is_file(test.law):
        shutil.copy(test.law, path.parent)
        test = dataclasses.replace(test, law=Path(test.law).name)
    path.write_text(dump_test(test), encoding="utf-8")


def is_file(law: Any) -> bool:
    """Return whether a law is that of the user's own Python file."""
    return isinstance(law, str) and law.endswith(".py")


def dump_test(test: BendingTest) -> str:
    """Return a test as TOML."""
    return tomli_w.dumps(to_dict(test))


def test_from_dict(data: Mapping[str, Any]) -> BendingTest:
    """Build a test from nested mappings, as parsed from TOML."""
    return from_dict(BendingTest, data)


test_from_dict.__test__ = False  # type: ignore[attr-defined]  # pytest takes the name for a test


def from_dict(cls: type[T], data: Any) -> T:
    """Build a dataclass from nested mappings, some of which may be dataclasses already.

    Raises
    ------
    SpecificationError
        If keys are unknown or missing, or if the dataclass refuses a value; the error has the full
        dotted name of the field.
    """
    if isinstance(data, cls):
        return data
    if cls is MeshRecipe and isinstance(data, str):
        return typing.cast(T, mesh_recipe(data, field=""))
    if not isinstance(data, Mapping):
        raise SpecificationError("", data, "must be a table")
    table = typing.cast(Any, cls)
    names, required, hints = _names(table), required_fields(table), _hints(table)
    for key in data:
        if key not in names:
            raise _unknown(key, data[key], names)
    values = {}
    for name in names:
        if name in data:
            values[name] = _convert(hints[name], name, data[name])
        elif name in required:
            raise SpecificationError(name, None, "is required but missing")
    made = cls(**values)  # first, as its own checks have more precise messages
    for name, value in values.items():
        if hints[name] in (str, str | None) and not isinstance(value, (str, types.NoneType)):
            raise SpecificationError(name, value, "must be text")
    return made


@functools.cache
def _names(cls: Any) -> tuple[str, ...]:
    """Return the names of a dataclass's fields, or none for any other class."""
    return tuple(f.name for f in dataclasses.fields(cls)) if dataclasses.is_dataclass(cls) else ()


@functools.cache
def _hints(cls: Any) -> dict[str, Any]:
    return typing.get_type_hints(cls)


def _unknown(key: str, value: Any, known: Iterable[str]) -> SpecificationError:
    known = list(known)
    near = difflib.get_close_matches(key, known, n=1, cutoff=0.5)
    hint = f"the nearest known one is {near[0]!r}" if near else f"known: {', '.join(known)}"
    return SpecificationError(key, value, f"is an unknown key; {hint}")


def _alternative(hint: Any, value: Any) -> Any:
    """Return the type of a union to which a value belongs.

    A union is "float | None" or a choice of tables. Of tables, the last one is taken whose required
    keys are all present, or else the first.
    """
    if not isinstance(hint, types.UnionType):
        return hint
    options = [option for option in typing.get_args(hint) if option is not type(None)]
    if type(value) in options:
        return type(value)
    for option in reversed(options[1:]):
        if isinstance(value, Mapping) and required_fields(option) <= set(value):
            return option
    return options[0]


@functools.cache
def required_fields(cls: Any) -> set[str]:
    """Return the names of a dataclass's fields that have no default."""
    missing = dataclasses.MISSING
    fields = dataclasses.fields(cls)
    return {f.name for f in fields if f.default is missing and f.default_factory is missing}


def _convert(hint: Any, name: str, value: Any) -> Any:
    hint = _alternative(hint, value)
    if hint is float and value == INFINITE:
        return math.inf
    if typing.get_origin(hint) is tuple:
        return _convert_list(typing.get_args(hint)[0], name, value)
    if dataclasses.is_dataclass(hint):
        try:
            return from_dict(typing.cast(type, hint), value)
        except SpecificationError as error:
            raise error.inside(name) from error
    _check_kind(hint, name, value)
    return value


def _check_kind(hint: Any, name: str, value: Any) -> None:
    """Check that a value is a table or a list of text where that is required."""
    if value is None:
        return
    if typing.get_origin(hint) is dict and not isinstance(value, Mapping):
        raise SpecificationError(name, value, "must be a table")
    if hint == list[str]:
        if not isinstance(value, list) or not all(isinstance(item, str) for item in value):
            raise SpecificationError(name, value, "must be a list of names")
        if twice := [item for item in value if value.count(item) > 1]:
            raise SpecificationError(name, twice[0], "must not be named twice")


def _convert_list(item: Any, name: str, value: Any) -> tuple[Any, ...]:
    if not isinstance(value, (list, tuple)):
        table = dataclasses.is_dataclass(item) or _is_table(item)
        what = f"a list of tables, [[{name}]] in TOML" if table else f'a list, {name} = ["..."]'
        raise SpecificationError(name, value, f"must be {what}")
    converted = []
    for index, entry in enumerate(value):
        try:
            converted.append(_convert(item, _label(index, entry), entry))
        except SpecificationError as error:
            raise error.inside(name) from error
    return tuple(converted)


def _label(index: int, entry: Any) -> str:
    """Return the label by which an entry of a list is addressed: its name, or else its index."""
    return str(entry.get("name", index) if isinstance(entry, Mapping) else index)


def labels(entries: list[Any]) -> list[str]:
    """Return the labels by which entries of a list are addressed: their names or indices."""
    return list(_by_label(entries))


def _by_label(entries: list[Any]) -> dict[str, Any]:
    return {_label(index, entry): entry for index, entry in enumerate(entries)}


def to_dict(obj: Any) -> Any:
    """Turn nested dataclasses into plain mappings and lists, without None and empty tables.

    Infinity becomes a word, as JSON has no number for it; `from_dict` accepts either.
    """
    kind: Any = type(obj)
    if names := _names(kind):
        values = {name: getattr(obj, name) for name in names}
        return {n: to_dict(value) for n, value in values.items() if value not in (None, {})}
    if isinstance(obj, tuple):
        return [to_dict(item) for item in obj]
    if isinstance(obj, dict):
        return {name: to_dict(value) for name, value in obj.items()}
    return INFINITE if obj == math.inf else obj


def value_at(test: BendingTest, key: str) -> Any:
    """Return the value of a test at a dotted key, with layers by name; None if there is none."""
    at: Any = test
    for part in key.split("."):
        if isinstance(at, tuple):
            at = {str(getattr(entry, "name", index)): entry for index, entry in enumerate(at)}
        elif names := _names(typing.cast(Any, type(at))):
            at = {name: getattr(at, name) for name in names}
        at = at.get(part) if isinstance(at, dict) else None
    return None if at == {} else to_dict(at)


def override(test: BendingTest, changes: Iterable[str] | Mapping[str, Any]) -> BendingTest:
    """Return the test with single values changed.

    Parameters
    ----------
    test
        The test to start from.
    changes
        Values by dotted key, or strings ``dotted.key=value`` with the value as in TOML (quotes
        around text may be omitted). Layers are addressed by name:
        ``stalk.layers.phloem.material.elastic.E_Z_MPa=1500``. The last part of a key is enough if
        no other key ends with it: ``span_mm=80``.

    Raises
    ------
    SpecificationError
        If a key is unknown or ambiguous, or a value is refused.
    """
    from ramiefenics.specification.short_keys import full_key  # which imports this file

    data, touched = to_dict(test), set()
    pairs = changes.items() if isinstance(changes, Mapping) else map(_assignment, changes)
    for name, value in pairs:
        key = full_key(data, name, value)
        _assign(data, BendingTest, key, value)
        touched.add(key.partition(".")[0])
    kept = {name: getattr(test, name) for name in data if name not in touched}
    return test_from_dict(data | kept)


def merged(test: BendingTest, changes: Mapping[str, Any]) -> BendingTest:
    """Return the test with the values that nested mappings contain in place of its own."""
    return test_from_dict(_merged(to_dict(test), changes))


def _merged(data: Any, changes: Any) -> Any:
    if not isinstance(data, Mapping) or not isinstance(changes, Mapping):
        return changes
    return {**data, **{name: _merged(data.get(name), own) for name, own in changes.items()}}


def _assignment(text: str) -> tuple[str, Any]:
    key, equals, value = (part.strip() for part in text.partition("="))
    if not equals or not key:
        raise SpecificationError("--set", text, "must be of the form key=value")
    return key, parse_value(value)


def parse_value(text: str) -> Any:
    """Parse one value, written as in TOML; quotes around text may be omitted.

    Raises
    ------
    SpecificationError
        If there is more than one value.
    """
    try:
        told = parse_toml(f"value = {text}")
    except ValueError:
        return text
    if len(told) > 1:
        raise SpecificationError("--set", text, "must be one value")
    return told["value"]


def _assign(data: Any, cls: Any, key: str, value: Any) -> None:
    *path, last = key.split(".")
    target, hint, walked = data, cls, ""
    for part in path:
        if isinstance(target, list):
            hint = typing.get_args(hint)[0]
            named = _by_label(target)
            known: Iterable[str] = named
            child = named.get(part)
        else:
            hints = {} if _is_table(hint) else _hints(hint)
            known = hints
            hint = hints.get(part)
            child = target.setdefault(part, {}) if _is_table(hint) else target.get(part)
        if not isinstance(child, (dict, list)):
            error = _unknown(part, value, known)
            raise error.inside(walked) if walked else error
        hint = _alternative(hint, child)
        target, walked = child, f"{walked}.{part}" if walked else part
    if isinstance(target, list):
        raise SpecificationError(key, value, f"must name a value of a layer, as in {key}.name=...")
    fields = [last] if _is_table(hint) else [f.name for f in dataclasses.fields(hint)]
    if last not in fields:
        error = _unknown(last, value, fields)
        raise error.inside(walked) if walked else error
    if last == "mesh" and isinstance(value, str):  # expanded, so that its parts can be set next
        value = to_dict(_convert(MeshRecipe, key, value))
    target[last] = value


def _is_table(hint: Any) -> bool:
    """Return whether a type is that of a table whose keys are not known in advance."""
    return typing.get_origin(hint) is dict

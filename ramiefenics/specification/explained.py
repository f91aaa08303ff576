"""Meaning of every key of a specification, read from the docstring of its class."""

from __future__ import annotations

import dataclasses
import functools
import inspect
import re
import textwrap
import types
import typing
from collections.abc import Iterator
from typing import Any

import tomli_w

from ramiefenics.specification.bending import BendingTest
from ramiefenics.specification.files import to_dict

WIDTH = 96
"""Width of the lines of a comment, in characters, without the leading ``# ``."""


@dataclasses.dataclass(frozen=True)
class Key:
    """A key of a specification.

    Attributes
    ----------
    path
        Dotted path; ``NAME`` stands for an entry of a list.
    type
        Type in words; empty for a table.
    default
        Default value as in TOML; empty for a table, or if there is none.
    meaning
        Description of the key.
    """

    path: str
    type: str
    default: str
    meaning: str


def keys(cls: Any = BendingTest, inside: str = "") -> Iterator[Key]:
    """Yield all keys of a dataclass, each table before its contents."""
    meanings = attributes(cls)
    for field, hint in _fields(cls):
        path = f"{inside}{field.name}"
        tables = [one for one in _options(hint) if dataclasses.is_dataclass(one)]
        kind = "" if tables else _words(hint)
        default = "" if tables else _default(field)
        yield Key(path, kind, default, meanings[field.name])
        entry = ".NAME." if typing.get_origin(hint) is tuple else "."
        for table in tables:
            yield from keys(table, f"{path}{entry}")


def explained(obj: Any, inside: str = "") -> str:
    """Return a specification as TOML, with the meaning of each key in a comment above it."""
    kind: Any = type(obj)
    meanings, plain, tables = attributes(kind), "", ""
    for field, _ in _fields(kind):
        value, path = getattr(obj, field.name), f"{inside}{field.name}"
        comment = textwrap.indent(textwrap.fill(meanings[field.name], WIDTH), "# ")
        if dataclasses.is_dataclass(value):
            tables += f"\n{comment}\n[{path}]\n{explained(value, f'{path}.')}"
        elif isinstance(value, tuple) and any(map(dataclasses.is_dataclass, value)):
            for entry in value:
                tables += f"\n{comment}\n[[{path}]]\n{explained(entry, f'{path}.')}"
                comment = "#"
        elif value is None:
            plain += f"{comment}\n# {field.name} =\n"
        else:
            plain += f"{comment}\n{field.name} = {_toml(value)}\n"
    return plain + tables


@functools.cache
def attributes(cls: Any) -> dict[str, str]:
    """Return the entries of the section "Attributes" of a class's docstring, by name."""
    section = (inspect.getdoc(cls) or "").partition("Attributes\n----------\n")[2]
    found = {}
    for entry in re.split(r"\n(?=\S)", section):
        names, _, text = entry.partition("\n")
        for name in names.split(","):
            found[name.strip()] = " ".join(text.split())
    return found


def _fields(cls: Any) -> list[tuple[dataclasses.Field[Any], Any]]:
    hints = typing.get_type_hints(cls)
    return [(field, hints[field.name]) for field in dataclasses.fields(cls)]


def _options(hint: Any) -> tuple[Any, ...]:
    """Return the types of a union, or of a tuple's entries."""
    if isinstance(hint, types.UnionType) or typing.get_origin(hint) is tuple:
        return typing.get_args(hint)
    return (hint,)


def _words(hint: Any) -> str:
    names = {float: "number", int: "whole number", str: "text", bool: "true or false"}
    if typing.get_origin(hint) is tuple:
        return f"list of {names.get(typing.get_args(hint)[0], 'table')}s"
    if typing.get_origin(hint) is dict:
        return "table of numbers"
    return next(names[one] for one in _options(hint) if one in names)


def _default(field: dataclasses.Field[Any]) -> str:
    if field.default is dataclasses.MISSING or field.default is None:
        return ""
    return _toml(field.default)


def _toml(value: Any) -> str:
    """Return a value as TOML, on one line or more."""
    if isinstance(value, dict):  # inline: a table of its own would end the table of the key
        return f"{{ {', '.join(f'{name} = {_toml(one)}' for name, one in value.items())} }}"
    if isinstance(value, tuple) and any(isinstance(one, dict) for one in value):
        return f"[{', '.join(map(_toml, value))}]"
    return tomli_w.dumps({"x": to_dict(value)}).partition("=")[2].strip()

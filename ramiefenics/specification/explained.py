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
from ramiefenics.specification.files import required_fields, to_dict

WIDTH = 96
"""Width of the lines of a comment, in characters, without the leading ``# ``."""

UNBROKEN = "\xa0"
"""Space at which no line is broken."""

HEAD = """\
# Specification of a bending test. `ramiefenics bend FILE` simulates it.
# Units: mm, N, MPa, s and, consistent with these, tonne; densities are in g/cm3, angles in degrees.
# The unit of a number ends its comment; 1 stands for a pure number.
# Axes: Z along the stalk, zero at midspan; Y up; X across. Index 3 is Z. Indenters move along -Y.
# Keys that are left out take their defaults; a key without a value, behind #, is left out.
"""
"""Comment at the top of an explained specification."""

ENDING = re.compile(
    "_((?:(?:N|g|mm)_)?per_(?:mm|N|MPa|s|m|cm3)|Nmm|mm3|cm|mm|MPa|N|deg|s|percent)$"
)
"""End of a name that states a unit."""

SYMBOLS = {
    "E_X_MPa": "E_X",
    "E_Z_MPa": "E_Z",
    "nu_XY": "nu_XY",
    "nu_XZ": "nu_XZ",
    "G_XZ_MPa": "G_XZ",
    "G_XY_MPa": "G_XY",
    "fibre_strength": "s_c / G_XZ",
    "fibre_residual_tangent": "h / G_XZ",
    "shear_yield_strain": "gamma_Y",
    "shear_residual_tangent": "R",
    "densification": "d",
    "static": "mu_s",
    "dynamic": "mu_d",
    "weakening_mm": "l_w",
    "theta": "theta",
    "presliding_mm": "l_p",
}
"""Symbols of keys in the documentation of the model, by the last part of the key."""


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
    required
        Whether the key cannot be left out.
    meaning
        Description of the key.
    """

    path: str
    type: str
    default: str
    required: bool
    meaning: str

    @property
    def unit(self) -> str:
        """Unit of a number, 1 for a pure number; empty for everything else."""
        return (unit_of(self.path) or "1") if self.type in ("number", "list of numbers") else ""

    @property
    def symbol(self) -> str:
        """Symbol in the documentation of the model; empty if there is none."""
        return SYMBOLS.get(self.path.rpartition(".")[2], "")


def keys(cls: Any = BendingTest, inside: str = "") -> Iterator[Key]:
    """Yield all keys of a dataclass, each table before its contents."""
    meanings, required = attributes(cls), required_fields(cls)
    for field, hint in _fields(cls):
        path = f"{inside}{field.name}"
        tables = [one for one in _options(hint) if dataclasses.is_dataclass(one)]
        kind = "" if tables else _words(hint)
        default = "" if tables else _default(field)
        yield Key(path, kind, default, field.name in required, meanings[field.name])
        entry = ".NAME." if typing.get_origin(hint) is tuple else "."
        for table in tables:
            yield from keys(table, f"{path}{entry}")


def unit_of(key: str) -> str:
    """Return the unit that the name of a key ends with; empty if it has none."""
    found = ENDING.search(key)
    unit = found[1] if found else ""
    return re.sub(r"^per_", "1/", unit).replace("_per_", "/")


def explained(test: BendingTest) -> str:
    """Return a specification as TOML, with the meaning of each key in a comment above it."""
    comments = {}
    for key in keys():
        unit = f" Unit:{UNBROKEN}{key.unit}." if key.unit else ""
        text = textwrap.fill(f"{key.meaning.replace('``', '`')}{unit}", WIDTH)
        comments[key.path] = textwrap.indent(text.replace(UNBROKEN, " "), "# ")
    return HEAD + "\n" + _commented(test, comments)


def _commented(obj: Any, comments: dict[str, str], table: str = "", path: str = "") -> str:
    """Return a table as TOML; `path` is that of `table` in `comments`, see `Key`."""
    plain, tables = "", ""
    for field in dataclasses.fields(obj):
        name, value = f"{table}{field.name}", getattr(obj, field.name)
        place = f"{path}{field.name}"
        comment = comments[place]
        if dataclasses.is_dataclass(value):
            inside = _commented(value, comments, f"{name}.", f"{place}.")
            tables += f"\n{comment}\n[{name}]\n{inside}"
        elif isinstance(value, tuple) and any(map(dataclasses.is_dataclass, value)):
            entries = (_commented(one, comments, f"{name}.", f"{place}.NAME.") for one in value)
            tables += f"\n{comment}"
            tables += "".join(f"\n[[{name}]]\n{entry}" for entry in entries)
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
        name, _, text = entry.partition("\n")
        found[name] = " ".join(text.split())
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
        inside = ", ".join(f"{name} = {_toml(one)}" for name, one in value.items())
        return f"{{ {inside} }}" if value else "{}"
    if isinstance(value, tuple) and any(isinstance(one, dict) for one in value):
        return f"[{', '.join(map(_toml, value))}]"
    return tomli_w.dumps({"x": to_dict(value)}).partition("=")[2].strip()

"""JSON schemas of the files that users write, generated from the classes that read them.

Editors use them to complete keys, to show the meaning of each, and to mark unknown ones. They do
not contain bounds, which are checked when the file is read.
"""

from __future__ import annotations

import dataclasses
import types
import typing
from typing import Any

from ramiefenics.specification.explained import attributes
from ramiefenics.specification.files import INFINITE, required_fields
from ramiefenics.specification.mesh_recipe import MeshRecipe, recipe_names

TYPES = {float: "number", int: "integer", str: "string", bool: "boolean", dict: "object"}


def schema(cls: Any, title: str, without: tuple[str, ...] = ()) -> dict[str, Any]:
    """Return the JSON schema (draft 2020-12) of the files from which a dataclass is read.

    Parameters
    ----------
    cls
        The dataclass.
    title
        Title of the schema.
    without
        Names of fields that do not occur in the file.
    """
    inside: dict[str, Any] = {}
    whole = _table(cls, inside, without)
    draft = "https://json-schema.org/draft/2020-12/schema"
    return {"$schema": draft, "title": title, **whole, "$defs": inside}


def _table(cls: Any, inside: dict[str, Any], without: tuple[str, ...] = ()) -> dict[str, Any]:
    hints, meanings = typing.get_type_hints(cls), attributes(cls)
    fields = [field for field in dataclasses.fields(cls) if field.name not in without]
    required = required_fields(cls)
    needed = [field.name for field in fields if field.name in required]
    properties = {}
    for field in fields:
        kind = _kind(hints[field.name], inside)
        if "radius" in field.name:
            kind = {"anyOf": [kind, {"const": INFINITE}]}
        meaning = meanings.get(field.name, "")
        properties[field.name] = {**kind, "description": meaning} if meaning else kind
    table = {"type": "object", "properties": properties, "additionalProperties": False}
    return {**table, "required": needed} if needed else table


def _kind(hint: Any, inside: dict[str, Any]) -> dict[str, Any]:
    if isinstance(hint, types.UnionType):
        kinds = [_kind(one, inside) for one in typing.get_args(hint) if one is not type(None)]
        return kinds[0] if len(kinds) == 1 else {"anyOf": kinds}
    origin = typing.get_origin(hint) or hint
    if origin in (tuple, list):
        return {"type": "array", "items": _kind(typing.get_args(hint)[0], inside)}
    if dataclasses.is_dataclass(hint):
        name = typing.cast(type, hint).__name__
        if name not in inside:
            inside[name] = {}  # placeholder, in case the class contains itself
            inside[name] = _table(hint, inside)
        table = {"$ref": f"#/$defs/{name}"}
        return {"anyOf": [{"enum": recipe_names()}, table]} if hint is MeshRecipe else table
    return {"type": TYPES[origin]} if origin in TYPES else {}

"""Replacement of single values deep inside a specification."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import Any, TypeVar, cast

from ramiefenics.specification.errors import SpecificationError

Path = tuple[str | int, ...]
T = TypeVar("T")


def replaced(whole: T, values: Mapping[Path, Any]) -> T:
    """Return nested dataclasses, tuples and tables with some values replaced.

    Only what contains these values is built anew, and all values are replaced before anything is
    checked, so that constants may change together that would be refused apart.

    Parameters
    ----------
    whole
        A specification, or a part of one.
    values
        Values, of the types of the fields, by the names of fields and the indices or names of parts
        of tuples that lead to them.

    Raises
    ------
    SpecificationError
        If a value is refused.
    """
    tree: dict[str | int, Any] = {}
    for path, value in values.items():
        branch = tree
        for part in path[:-1]:
            branch = branch.setdefault(part, {})
        branch[path[-1]] = _Leaf(value)
    return cast(T, _grown(whole, tree))


@dataclasses.dataclass(frozen=True)
class _Leaf:
    """A value that may itself be a table."""

    value: Any


def _grown(old: Any, new: Any) -> Any:
    if isinstance(new, _Leaf):
        return new.value
    if isinstance(old, tuple):
        names = [str(getattr(item, "name", index)) for index, item in enumerate(old)]
        own = [new.get(index, new.get(name)) for index, name in enumerate(names)]
        each = zip(names, old, own, strict=True)
        return tuple(item if to is None else _inside(name, item, to) for name, item, to in each)
    if isinstance(old, dict):
        return old | {name: _inside(str(name), old[name], own) for name, own in new.items()}
    return dataclasses.replace(
        old, **{name: _inside(name, getattr(old, name), own) for name, own in new.items()}
    )


def _inside(name: str, old: Any, new: Any) -> Any:
    try:
        return _grown(old, new)
    except SpecificationError as error:
        raise error.inside(name) from error

"""Python files of the user's own, in which the program looks for what it can use."""

from __future__ import annotations

from pathlib import Path
from types import ModuleType
from typing import TypeVar

from ramiefenics.specification.errors import SpecificationError

T = TypeVar("T")


def instances_in(path: str | Path, cls: type[T], field: str) -> list[T]:
    """Run a Python file, and return what it has of a class at its top level, in its order.

    Parameters
    ----------
    path
        The file.
    cls
        The class.
    field
        What asked for the file, for messages.

    Raises
    ------
    SpecificationError
        If there is no such file, it does not run, or it has none.
    """
    path = Path(path)
    if path.suffix != ".py" or not path.is_file():
        raise SpecificationError(field, str(path), "must be a Python file")
    module = ModuleType(path.stem)
    module.__file__ = str(path)
    try:
        exec(compile(path.read_bytes(), str(path), "exec"), vars(module))
    except SpecificationError:
        raise
    except Exception as error:
        reason = f"{type(error).__name__}: {error}"
        raise SpecificationError(field, str(path), f"does not run ({reason})") from error
    found = [value for value in vars(module).values() if isinstance(value, cls)]
    if not found:
        allowed = f"must define at least one ramiefenics.{cls.__name__} at its top level"
        raise SpecificationError(field, str(path), allowed)
    return found

"""Python files written by users: effects, laws, readers of raw files."""

from __future__ import annotations

from pathlib import Path
from types import ModuleType
from typing import TypeVar

from ramiefenics.specification.errors import SpecificationError

T = TypeVar("T")


def load_objects(path: str | Path, kind: type[T], field: str) -> list[T]:
    """Run a Python file and return the objects of a class that it defines at its top level.

    Parameters
    ----------
    path
        The file.
    kind
        Class of the objects.
    field
        Key or option that names the file, for error messages.

    Raises
    ------
    SpecificationError
        If there is no such file, it does not run, or it defines no such object.
    """
    path = Path(path)
    if path.suffix != ".py" or not path.is_file():
        raise SpecificationError(field, str(path), "must be a Python file")
    module = ModuleType(path.stem)
    module.__file__ = str(path)
    try:  # not by an import, which would leave a cache beside the user's file
        exec(compile(path.read_bytes(), str(path), "exec"), vars(module))
    except SpecificationError:
        raise
    except (Exception, SystemExit) as error:
        reason = f"{type(error).__name__}: {error}"
        raise SpecificationError(field, str(path), f"does not run ({reason})") from error
    found = [value for value in vars(module).values() if isinstance(value, kind)]
    if not found:
        allowed = f"must define at least one ramiefenics.{kind.__name__} at its top level"
        raise SpecificationError(field, str(path), allowed)
    return found

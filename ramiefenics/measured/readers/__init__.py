"""Formats of raw files, one module each; a new one is listed here."""

from pathlib import Path

from ramiefenics.measured.readers.base import Reader, read_raw_file
from ramiefenics.measured.readers.columns import COLUMNS
from ramiefenics.measured.readers.instron import INSTRON
from ramiefenics.specification import SpecificationError
from ramiefenics.specification.user_file import load_objects

READERS: dict[str, Reader] = {reader.name: reader for reader in (INSTRON, COLUMNS)}

__all__ = ["READERS", "Reader", "find_reader", "read_raw_file"]


def find_reader(format: str | Path) -> Reader:
    """Return the reader of a format that is listed, or the one that a Python file defines.

    Raises
    ------
    SpecificationError
        If there is none of that name, or the file does not define one.
    """
    if str(format).endswith(".py"):
        found = load_objects(format, Reader, "format")
        if len(found) > 1:
            names = ", ".join(reader.name for reader in found)
            raise SpecificationError("format", str(format), f"must define one Reader, not {names}")
        return found[0]
    if format not in READERS:
        allowed = f"must be {', '.join(READERS)}, or a Python file that defines a Reader"
        raise SpecificationError("format", str(format), allowed)
    return READERS[str(format)]

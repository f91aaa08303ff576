"""Readers of raw files, one module per format; new ones are listed here."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from ramiefenics.measured.readers.base import OtherFormat, Reader, read_raw_file
from ramiefenics.measured.readers.columns import COLUMNS
from ramiefenics.measured.readers.headings import HEADINGS
from ramiefenics.specification import SpecificationError
from ramiefenics.specification.user_file import load_objects

READERS: dict[str, Reader] = {reader.name: reader for reader in (HEADINGS, COLUMNS)}

__all__ = ["READERS", "Reader", "find_reader", "guess_reader", "read_raw_file"]


def guess_reader(paths: Sequence[str | Path], options: Mapping[str, Any]) -> Reader:
    """Return the first reader with the given options to whose format the first file belongs.

    Raises
    ------
    SpecificationError
        If there is no file, if no reader has the options, or if none can read the file; the message
        is that of the reader of its format, or else of the first reader with the options.
    """
    if not paths:
        raise SpecificationError("raw", None, "must name at least one file")
    refused: SpecificationError | None = None
    for reader in READERS.values():
        if set(options) <= set(reader.options):
            try:
                read_raw_file(reader, Path(paths[0]), options)
                return reader
            except OtherFormat as error:
                refused = refused or error
    raise refused or SpecificationError("options", ", ".join(options), "must all be of one format")


def find_reader(format: str | Path) -> Reader:
    """Return the reader of a listed format, or the one that a Python file defines.

    Raises
    ------
    SpecificationError
        If there is no reader of that name, or the file does not define exactly one.
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

"""Reading of users' files, with limits on their size and one-sentence error messages."""

from __future__ import annotations

import stat
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any

from ramiefenics.specification.errors import SpecificationError

LARGEST_BYTES = 200_000_000
"""Largest size of a file that is read into memory: hours of recording at 1 kHz."""

LARGEST_TOML_BYTES = 10_000_000


def read_bytes(path: Path, most: int = LARGEST_BYTES) -> bytes:
    """Return the content of a file.

    Raises
    ------
    SpecificationError
        If it cannot be read, is a device or a pipe, which may have no end, or is too large.
    """
    try:
        about = path.stat()
        regular, small = stat.S_ISREG(about.st_mode), about.st_size <= most
        content = path.read_bytes() if regular and small else b""
    except (OSError, ValueError) as error:  # ValueError for a name that no file can have
        why = getattr(error, "strerror", None) or error
        raise SpecificationError("file", str(path), f"cannot be read ({why})") from error
    if not regular:
        what = "is a folder" if stat.S_ISDIR(about.st_mode) else "is not a regular file"
        raise SpecificationError("file", str(path), f"cannot be read ({what})")
    if not small:
        allowed = f"must have at most {most / 1e6:g} MB, but has {about.st_size / 1e6:.0f}"
        raise SpecificationError("file", str(path), allowed)
    return content


def parse_toml(text: str, parse_float: Callable[[str], Any] = float) -> dict[str, Any]:
    """Parse TOML.

    Raises
    ------
    ValueError
        If it is not valid TOML, is nested too deeply, or has a number with too many digits.
    """
    try:
        return tomllib.loads(text, parse_float=parse_float)
    except RecursionError as error:
        raise ValueError("it is nested too deeply") from error


def read_toml(path: str | Path, parse_float: Callable[[str], Any] = float) -> dict[str, Any]:
    """Read a TOML file.

    Parameters
    ----------
    path
        The file.
    parse_float
        Converter of numbers with a decimal point; `str` keeps their digits.

    Raises
    ------
    SpecificationError
        If the file cannot be read or is not valid TOML.
    """
    content = read_bytes(Path(path), LARGEST_TOML_BYTES)
    try:
        return parse_toml(content.decode("utf-8-sig").replace("\r\n", "\n"), parse_float)
    except ValueError as error:
        raise SpecificationError("file", str(path), f"is not valid TOML ({error})") from error

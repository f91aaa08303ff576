"""Checksums of compiled code, so that what a disk has damaged is compiled again, not run."""

from __future__ import annotations

import hashlib
from contextlib import suppress
from pathlib import Path


def seal(path: Path) -> None:
    """Keep a file's checksum beside it."""
    _beside(path).write_text(_checksum(path), encoding="ascii")


def is_sound(path: Path) -> bool:
    """Return whether a file is there as it was sealed; one that never was is sealed as it is."""
    try:
        expected = _beside(path).read_bytes()
    except FileNotFoundError:
        if not path.exists():
            return False
        seal(path)
        return True
    return path.exists() and expected == _checksum(path).encode("ascii")


def discard(path: Path) -> None:
    """Remove a file and its checksum."""
    for one in (path, _beside(path)):
        with suppress(FileNotFoundError):
            one.unlink()


def _beside(path: Path) -> Path:
    return path.with_name(f"{path.name}.sha256")


def _checksum(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()

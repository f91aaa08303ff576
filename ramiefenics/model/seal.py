"""Checksums of compiled code, so that damaged files are compiled again instead of being run."""

from __future__ import annotations

import hashlib
from pathlib import Path


def seal(path: Path) -> None:
    """Write a file's checksum beside it."""
    _beside(path).write_text(_checksum(path), encoding="ascii")


def is_sound(path: Path) -> bool:
    """Return whether a file exists and is as it was when it was sealed."""
    try:
        return _beside(path).read_bytes() == _checksum(path).encode("ascii")
    except FileNotFoundError:  # the file or its checksum
        return False


def _beside(path: Path) -> Path:
    return path.with_name(f"{path.name}.sha256")


def _checksum(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()

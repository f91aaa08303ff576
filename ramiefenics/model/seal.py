"""Checksums of compiled code, so that what a disk has damaged is compiled again, not run."""

from __future__ import annotations

import hashlib
from pathlib import Path


def seal(path: Path) -> None:
    """Keep a file's checksum beside it."""
    _beside(path).write_text(_checksum(path), encoding="ascii")


def is_sound(path: Path) -> bool:
    """Return whether a file is there as it was sealed."""
    try:
        return _beside(path).read_bytes() == _checksum(path).encode("ascii")
    except FileNotFoundError:  # either of the two
        return False


def _beside(path: Path) -> Path:
    return path.with_name(f"{path.name}.sha256")


def _checksum(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()

"""Folders that commands write to."""

from __future__ import annotations

import os
from pathlib import Path

from ramiefenics.specification import SpecificationError


def check_writable(folder: Path) -> Path:
    """Find out before hours are spent on what goes into it; make nothing yet.

    Raises
    ------
    SpecificationError
        If the folder, or what is there of it, cannot be written.
    """
    existing = next(path for path in (folder, *folder.absolute().parents) if path.exists())
    if not existing.is_dir() or not os.access(existing, os.W_OK | os.X_OK):
        allowed = f"must be a folder that can be written, but {existing} cannot"
        raise SpecificationError("out", str(folder), allowed)
    return folder

"""Folders of results, in which nothing appears half-written."""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


@contextmanager
def draft(folder: Path, *stale: str) -> Iterator[Path]:
    """Make a folder to write to, whose content is moved into `folder` if all went well.

    Parameters
    ----------
    folder
        Made if it does not exist; files of an earlier run are replaced.
    stale
        Patterns of files that such a run may have left and this one may not replace: they go.
    """
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix=".writing-", dir=folder) as name:
        yield Path(name)
        for pattern in stale:
            for left in folder.glob(pattern):
                left.unlink()
        for made in sorted(Path(name).iterdir()):
            place = folder / made.name
            if place.is_dir():
                shutil.rmtree(place)
            made.replace(place)

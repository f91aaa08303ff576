"""Folders of results: wholly the old ones or wholly the new ones, never both."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from ramiefenics.results.claim import claimed
from ramiefenics.results.exchange import NEW, install, write_record


@contextmanager
def draft(folder: Path, replace: bool = True) -> Iterator[Path]:
    """Make a folder to write to, which takes the place of `folder` if all went well.

    Parameters
    ----------
    folder
        Made if it does not exist. What the program wrote there before goes; files of the user's
        stay, unless the new result has one of the same name.
    replace
        If false, what the program wrote there before stays too, and what it writes now is the
        user's from then on.

    Raises
    ------
    SpecificationError
        If another process is writing it.
    OSError
        If it cannot be written.
    """
    with claimed(folder) as work:
        made = work / NEW
        made.mkdir()
        try:
            yield made
            if replace:
                write_record(made)
            install(work, folder.resolve())
        finally:
            shutil.rmtree(made, ignore_errors=True)

"""Folders that hold either all of the old results or all of the new ones, never a mixture."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from ramiefenics.results.claim import claimed
from ramiefenics.results.exchange import NEW, install, write_record


@contextmanager
def draft(folder: Path, replace: bool = True) -> Iterator[Path]:
    """Provide a folder to write to, whose content replaces that of `folder` if all goes well.

    Parameters
    ----------
    folder
        Folder of results; created if it does not exist. What the program wrote there before is
        removed. The user's own files stay, unless the new result has a file of the same name.
    replace
        If false, what the program wrote there before stays, too, and what it writes now counts as
        the user's own from then on.

    Raises
    ------
    SpecificationError
        If another process is writing to the folder.
    OSError
        If the folder cannot be written to.
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

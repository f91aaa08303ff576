"""Exclusive access to a folder of results: one process writes it at a time."""

from __future__ import annotations

import fcntl
import os
import shutil
import socket
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TextIO

from ramiefenics.results.exchange import NEW, put_right
from ramiefenics.specification.errors import SpecificationError

LOCK = "lock"

_held: dict[Path, int] = {}
"""Identifiers of the threads of this process, by the working folder that each holds."""


@contextmanager
def claimed(folder: Path) -> Iterator[Path]:
    """Hold a folder of results, so that no other process or thread writes to it.

    What a killed process has left there is put right first. The thread that holds a folder may
    claim it again.

    Parameters
    ----------
    folder
        Folder of results; it need not exist, and is not created.

    Returns
    -------
    Path
        Working folder on the same file system, which exists as long as `folder` is held.

    Raises
    ------
    SpecificationError
        If another process, or another thread of this one, holds the folder.
    OSError
        If the file system refuses.
    """
    target = folder.resolve()
    work = _working_folder(target)
    if _held.get(work) == threading.get_ident():
        yield work
        return
    made = [path for path in work.parents if not path.exists()]
    lock = _lock(work, folder)
    _held[work] = threading.get_ident()
    try:
        put_right(work, target)
        yield work
    finally:
        del _held[work]
        shutil.rmtree(work / NEW, ignore_errors=True)
        (work / LOCK).unlink(missing_ok=True)
        for path in (work, *made):
            with suppress(OSError):  # not empty
                path.rmdir()
        lock.close()


def _working_folder(folder: Path) -> Path:
    """Return where the next content of a folder is written: beside it if possible, or inside."""
    above = next((path for path in folder.parents if path.exists()), folder)
    if _is_mounted(folder) or not os.access(above, os.W_OK | os.X_OK):
        return folder / ".draft"
    return folder.with_name(f".{folder.name}.draft")


def _is_mounted(folder: Path) -> bool:
    """Return whether something is mounted on a folder, even from the same file system."""
    escaped = str(folder).replace(" ", r"\040")
    with suppress(OSError):
        mounts = Path("/proc/self/mountinfo").read_text(encoding="utf-8").splitlines()
        return any(line.split()[4] == escaped for line in mounts)
    return folder.is_mount()


def _lock(work: Path, folder: Path) -> TextIO:
    """Lock a working folder, created if necessary; the lock ends with its process."""
    while True:
        with suppress(FileExistsError):
            work.mkdir(parents=True)
        with suppress(FileNotFoundError):  # its holder has just removed it
            lock = (work / LOCK).open("a+", encoding="utf-8")
            if not _got(lock):
                holder = _read(lock)
                if not holder:  # the holder has not yet written who it is
                    continue
                allowed = f"is being written by another process ({holder})"
                raise SpecificationError("out", str(folder), allowed)
            if os.path.samestat(os.fstat(lock.fileno()), (work / LOCK).stat()):
                lock.truncate(0)
                lock.write(f"PID {os.getpid()} on {socket.gethostname()}")
                lock.flush()
                return lock
            lock.close()


def _read(lock: TextIO) -> str:
    with lock:
        lock.seek(0)
        return lock.read()


def _got(lock: TextIO) -> bool:
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except OSError:  # a file system without locks
        return True
    return True

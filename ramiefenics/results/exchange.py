"""Replace an old result by a new one at once, and leave the user's own files where they are.

`RECORD` lists what the program wrote into a folder; everything else in it is the user's. If
possible, the whole folder is exchanged. If the file system does not allow that, or if the folder
holds more than a result, the old files are removed and the new ones are then moved in. If the
program is killed meanwhile, `put_right` completes the replacement.
"""

from __future__ import annotations

import ctypes
import errno
import os
import shutil
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path, PurePosixPath

RECORD = ".written"
"""File in a folder of results that lists what the program wrote there, one path per line."""

NEW, ASIDE, MOVING = "new", "aside", "moving"
"""Folders in the working folder: the result that is being written; the old result, while no folder
has the result's name; a new result of which some files have already been moved in."""

UNFINISHED = "UNFINISHED.txt"
"""File with `WARNING` that is in a folder while files are being moved into it."""

WARNING = (
    "A new result is replacing an old one, and files are missing. If the program was killed in "
    "the meantime, its next command that writes here will complete the replacement.\n"
)

AT_FDCWD, RENAME_EXCHANGE = -100, 2  # linux/fcntl.h, linux/fs.h


def write_record(made: Path) -> None:
    """Write the record of a new result, which lists all its files."""
    text = "".join(f"{name}\n" for name in sorted(_files(made)))
    (made / RECORD).write_text(text, encoding="utf-8", errors="surrogateescape")


def install(work: Path, folder: Path) -> None:
    """Replace the result in a folder by the one in ``work/new``.

    Parameters
    ----------
    work
        Working folder. Afterwards ``work/new`` is gone, or holds the old result.
    folder
        Absolute path that is not a link. A new result without a record only adds to what is there.

    Raises
    ------
    OSError
        If the file system refuses, or if a file of the user's is in the place of a folder of the
        result, or the other way round.
    """
    new = work / NEW
    if not folder.exists():
        new.rename(folder)
        return
    _check_room(new, folder)
    old = recorded(folder) if (new / RECORD).exists() else set()
    if _exchangeable(new, folder, old):
        shutil.copymode(folder, new)
        _keep_own(folder, new, old)
        _exchange(new, folder, work / ASIDE)
        _keep_own(new, folder, old)  # what the user has added meanwhile
    else:
        new.rename(work / MOVING)
        _move(work / MOVING, folder)


def put_right(work: Path, folder: Path) -> None:
    """Complete what a killed process has begun, and remove what it has left behind."""
    shutil.rmtree(work / NEW, ignore_errors=True)
    if (work / ASIDE).exists():
        if folder.exists():
            _keep_own(work / ASIDE, folder, recorded(work / ASIDE))
            shutil.rmtree(work / ASIDE)
        else:
            (work / ASIDE).rename(folder)
    if (work / MOVING).exists():
        _move(work / MOVING, folder)


def _files(folder: Path) -> Iterator[str]:
    """Yield the paths of all files in a folder and its subfolders, relative to it."""
    for place, names, files in os.walk(folder):
        links = [name for name in names if (Path(place) / name).is_symlink()]
        for name in [*files, *links]:
            yield (Path(place) / name).relative_to(folder).as_posix()


def recorded(folder: Path) -> set[str]:
    """Return the paths of what the program wrote into a folder, the record included."""
    try:
        text = (folder / RECORD).read_text(encoding="utf-8", errors="surrogateescape")
    except FileNotFoundError:
        return set()
    names = {name for name in text.splitlines() if ".." not in PurePosixPath(name).parts}
    return {name for name in names if not name.startswith("/")} | {RECORD}


def _check_room(new: Path, folder: Path) -> None:
    for name in _files(new):
        place = folder / name
        within = place.parents[: len(PurePosixPath(name).parts) - 1]
        if place.is_dir() or any(path.exists() and not path.is_dir() for path in within):
            raise FileExistsError(errno.EEXIST, "is in the way of a result", str(place))


def _exchangeable(new: Path, folder: Path, old: set[str]) -> bool:
    """Return whether a folder can be exchanged for the new one without harm to anybody.

    It cannot if this process works in it, if the new one is inside it or has another owner, or if
    it has subfolders of the user's, such as the results below ``results``, in which other processes
    may be at work.
    """
    here, there = new.stat(), folder.stat()
    parts = {PurePosixPath(name).parts[0] for name in old}
    own = {entry.name for entry in os.scandir(folder) if entry.is_dir(follow_symlinks=False)}
    return (
        own <= parts
        and (here.st_uid, here.st_gid) == (there.st_uid, there.st_gid)
        and not new.is_relative_to(folder)
        and not Path.cwd().is_relative_to(folder)
    )


def _keep_own(source: Path, target: Path, old: set[str]) -> None:
    """Link the user's files into another folder, unless it has files of the same names."""
    for name in _files(source):
        place = target / name
        if name in old or os.path.lexists(place):
            continue
        place.parent.mkdir(parents=True, exist_ok=True)
        try:
            os.link(source / name, place, follow_symlinks=False)
        except OSError:  # a file system without links, or a file of another user
            shutil.copy2(source / name, place, follow_symlinks=False)


def _exchange(new: Path, folder: Path, aside: Path) -> None:
    """Exchange the names of two folders."""
    try:
        _exchange_at_once(new, folder)
    except OSError as error:
        if error.errno not in (errno.EINVAL, errno.ENOSYS, errno.ENOTSUP):
            raise
        folder.rename(aside)
        new.rename(folder)
        aside.rename(new)


def _exchange_at_once(one: Path, other: Path) -> None:
    """Exchange two names by renameat2(2), which Python's `os` does not offer."""
    call = getattr(ctypes.CDLL(None, use_errno=True), "renameat2", None)
    if call is None:
        raise OSError(errno.ENOSYS, "no renameat2 in the C library")
    names = os.fsencode(one), os.fsencode(other)
    if call(AT_FDCWD, names[0], AT_FDCWD, names[1], RENAME_EXCHANGE) != 0:
        number = ctypes.get_errno()
        raise OSError(number, os.strerror(number), str(one), None, str(other))


def _move(moving: Path, folder: Path) -> None:
    """Remove the old result, then move the new one in, or continue doing so.

    The record is the last file to be removed and the last to be moved in. Until the new record is
    there, any record lists files of the old result.
    """
    (folder / UNFINISHED).write_text(WARNING, encoding="utf-8")
    if (moving / RECORD).exists():
        for name in sorted(recorded(folder), key=lambda name: name == RECORD):
            with suppress(FileNotFoundError, IsADirectoryError, NotADirectoryError):
                (folder / name).unlink()
            for parent in (folder / name).parents[: len(PurePosixPath(name).parts) - 1]:
                with suppress(OSError):  # not empty
                    parent.rmdir()
    for name in sorted(_files(moving), key=lambda name: name == RECORD):
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.move(moving / name, folder / name)
    (folder / UNFINISHED).unlink()
    shutil.rmtree(moving)

"""Put a new result in an old one's place at once, and leave the user's own files where they are.

`RECORD` lists what the program wrote into a folder; all else in it is the user's. Where the file
system can, the whole folder is exchanged. Where it cannot, or where the folder is more than a
result, the old files are removed, then the new ones moved in; `put_right` ends what was killed.
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
"""File in a folder of results: what the program wrote there, one path a line."""

NEW, ASIDE, MOVING = "new", "aside", "moving"
"""Folders beside the result: what is being written; the old result, while no folder has the
result's name; a new result of which some files are already in the old one's place."""

UNFINISHED = "UNFINISHED.txt"
"""File in a folder while files are being moved into it, with `WARNING`."""

WARNING = (
    "A new result is taking the place of an old one: files are missing. If the program was killed "
    "meanwhile, its next command that writes here puts it right.\n"
)

AT_FDCWD, RENAME_EXCHANGE = -100, 2  # linux/fcntl.h, linux/fs.h


def write_record(made: Path) -> None:
    """List all files of a new result in its record."""
    text = "".join(f"{name}\n" for name in sorted(_files(made)))
    (made / RECORD).write_text(text, encoding="utf-8", errors="surrogateescape")


def install(work: Path, folder: Path) -> None:
    """Put the result in ``work/new`` in the place of the one in a folder.

    Parameters
    ----------
    work
        Where it has been written; after that ``work/new`` is gone, or holds the old result.
    folder
        Neither a link nor relative. If the new result has no record it only adds to what is there.

    Raises
    ------
    OSError
        If the file system refuses, or a user's file is where a folder of the result is to go, or
        the other way round.
    """
    new = work / NEW
    if not folder.exists():
        new.rename(folder)
        return
    _check_room(new, folder)
    old = _recorded(folder) if (new / RECORD).exists() else set()
    if _exchangeable(new, folder, old):
        shutil.copymode(folder, new)
        _keep_own(folder, new, old)
        _exchange(new, folder, work / ASIDE)
        _keep_own(new, folder, old)  # what the user has added in between
    else:
        new.rename(work / MOVING)
        _move(work / MOVING, folder)


def put_right(work: Path, folder: Path) -> None:
    """End what a killed process has begun, and clear away what it has left."""
    shutil.rmtree(work / NEW, ignore_errors=True)
    if (work / ASIDE).exists():
        if folder.exists():
            _keep_own(work / ASIDE, folder, _recorded(work / ASIDE))
            shutil.rmtree(work / ASIDE)
        else:
            (work / ASIDE).rename(folder)
    if (work / MOVING).exists():
        _move(work / MOVING, folder)


def _files(folder: Path) -> Iterator[str]:
    """Paths of all files in a folder and those below, relative to it."""
    for place, names, files in os.walk(folder):
        links = [name for name in names if (Path(place) / name).is_symlink()]
        for name in [*files, *links]:
            yield (Path(place) / name).relative_to(folder).as_posix()


def _recorded(folder: Path) -> set[str]:
    """Paths of what the program wrote into a folder, the record included."""
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
    """Return whether nobody will miss the folder itself when another one has its name.

    A process would that works in it, or whose it is; so would one at work in a folder of the
    user's within it, such as the results below ``results``.
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
    """Link the user's files into another folder, which may have others of these names."""
    for name in _files(source):
        place = target / name
        if name in old or os.path.lexists(place):
            continue
        place.parent.mkdir(parents=True, exist_ok=True)
        try:
            os.link(source / name, place, follow_symlinks=False)
        except OSError:  # a file system without links, a file of another user
            shutil.copy2(source / name, place, follow_symlinks=False)


def _exchange(new: Path, folder: Path, aside: Path) -> None:
    """Exchange two folders' names."""
    try:
        _exchange_at_once(new, folder)
    except OSError as error:
        if error.errno not in (errno.EINVAL, errno.ENOSYS, errno.ENOTSUP):
            raise
        folder.rename(aside)
        new.rename(folder)
        aside.rename(new)


def _exchange_at_once(one: Path, other: Path) -> None:
    """Exchange two names by renameat2(2), which Python's `os` does not have."""
    call = getattr(ctypes.CDLL(None, use_errno=True), "renameat2", None)
    if call is None:
        raise OSError(errno.ENOSYS, "no renameat2 in the C library")
    names = os.fsencode(one), os.fsencode(other)
    if call(AT_FDCWD, names[0], AT_FDCWD, names[1], RENAME_EXCHANGE) != 0:
        number = ctypes.get_errno()
        raise OSError(number, os.strerror(number), str(one), None, str(other))


def _move(moving: Path, folder: Path) -> None:
    """Remove the old result, then move the new one in, or go on with that.

    The record is the last file to go and the last to come: while the new one is not there, what an
    old one lists is the old result.
    """
    (folder / UNFINISHED).write_text(WARNING, encoding="utf-8")
    if (moving / RECORD).exists():
        for name in sorted(_recorded(folder), key=lambda name: name == RECORD):
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

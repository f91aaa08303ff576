"""Kill processes that write a folder of results, and report what they leave.

    python tests/killed_writers.py FOLDER WAY KILLS

Each time, two writers that start together and write without pause are killed at random moments.
WAY is how the folder can be replaced: ``exchange``, ``aside`` (without renameat2's exchange) or
``inside`` (the folder is the writers' working directory). Prints the counts of the folder's states
as JSON.
"""

from __future__ import annotations

import errno
import importlib.util
import json
import os
import random
import signal
import sys
import time
import types
from collections import Counter
from contextlib import suppress
from pathlib import Path

found = importlib.util.find_spec("ramiefenics")
assert found is not None
package = types.ModuleType("ramiefenics")
package.__path__ = list(found.submodule_search_locations or [])
sys.modules["ramiefenics"] = package  # skips the imports of its __init__, which take a second

from ramiefenics.results import exchange  # noqa: E402
from ramiefenics.results.claim import claimed  # noqa: E402
from ramiefenics.results.draft import draft  # noqa: E402
from ramiefenics.specification.errors import SpecificationError  # noqa: E402

OWN = {"notes.txt", "fields/mine.txt"}
LINES = 500


def names(number: int) -> set[str]:
    """Return the files of a result; an odd-numbered one has one more."""
    tables = {f"table_{i}.csv" for i in range(7)}
    return tables | {"fields/1.vtu", "fields/2.vtu"} | ({"odd.toml"} if number % 2 else set())


def write(folder: Path, number: int) -> None:
    with draft(folder) as made:
        (made / "fields").mkdir()
        for name in names(number):
            (made / name).write_text(f"{number}\n" * LINES)


def write_for_ever(folder: Path, number: int, refusals: int) -> None:
    while True:
        try:
            write(folder, number)
        except SpecificationError as error:
            told = "is being written by another process (PID " in str(error)
            os.write(refusals, b"!" if told else b"?")
        number += 3


def look(folder: Path) -> str:
    """Return the state of a folder: absent, whole, part of one result, or a mix."""
    if not folder.exists():
        return "absent"
    there = {path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file()}
    if not there >= OWN or any((folder / name).read_text() != "mine" for name in OWN):
        return "user's files lost"
    results = there - OWN - {exchange.RECORD, exchange.UNFINISHED}
    texts = {(folder / name).read_text() for name in results}
    if len(texts) > 1:
        return "mix"
    part = "part" if exchange.UNFINISHED in there else "part, and does not say so"
    if not texts:
        return part
    lines = texts.pop().splitlines()
    expected = names(int(lines[0]))
    if len(lines) == LINES and results == expected and exchange.RECORD in there:
        return "whole"
    return part if results <= expected else "mix"


def kill_two(folder: Path, way: str, refusals: int) -> None:
    children = []
    for number in (0, 1):
        child = os.fork()
        if child == 0:
            if way == "inside":
                os.chdir(folder)
            try:
                write_for_ever(folder, number, refusals)
            finally:
                sys.excepthook(*sys.exc_info())  # type: ignore[arg-type]
                os._exit(1)
        children.append(child)
    statuses = []
    for child in children:
        time.sleep(random.uniform(0.0, 0.02))
        os.kill(child, signal.SIGKILL)
        statuses.append(os.waitpid(child, 0)[1])
    assert all(map(os.WIFSIGNALED, statuses)), "a writer failed"


def main(folder: Path, way: str, kills: int) -> None:
    if way == "aside":

        def refuse(*_: Path) -> None:
            raise OSError(errno.EINVAL, "not on this file system")

        exchange._exchange_at_once = refuse
    random.seed(1)
    write(folder, 0)
    for name in OWN:
        (folder / name).write_text("mine")
    reader, writer = os.pipe()
    os.set_blocking(writer, False)
    os.set_blocking(reader, False)
    killed, after, refused = Counter[str](), Counter[str](), Counter[str]()
    leftovers = 0
    for _ in range(kills // 2):
        kill_two(folder, way, writer)
        killed[look(folder)] += 1
        leftovers += len(list(folder.parent.iterdir())) > 1
        with claimed(folder):
            after[look(folder)] += 1
        with suppress(BlockingIOError):
            refused.update(os.read(reader, 65536).decode())
    beside = [path.name for path in folder.parent.iterdir() if path != folder]
    print(
        json.dumps(
            {
                "killed": killed,
                "put right": after,
                "refused": refused["!"],
                "refused without a reason": refused["?"],
                "leftovers": leftovers,
                "beside": beside,
            }
        )
    )


if __name__ == "__main__":
    main(Path(sys.argv[1]).resolve(), sys.argv[2], int(sys.argv[3]))

"""Folders of results are entirely old or entirely new, even if writers are killed or compete."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

import ramiefenics as rf
from ramiefenics.cli import main
from ramiefenics.results import claim, exchange
from ramiefenics.results.claim import claimed
from ramiefenics.results.draft import draft

WRITERS = Path(__file__).with_name("killed_writers.py")


def write(folder: Path, *names: str, text: str = "new", replace: bool = True) -> None:
    with draft(folder, replace) as made:
        for name in names:
            (made / name).parent.mkdir(parents=True, exist_ok=True)
            (made / name).write_text(text)


def files(folder: Path) -> set[str]:
    found = {path.relative_to(folder).as_posix() for path in folder.rglob("*")}
    return {name for name in found if not (folder / name).is_dir()} - {exchange.RECORD}


@pytest.mark.parametrize(
    ("way", "allowed"),
    [
        ("exchange", {"whole"}),
        # if the file system cannot exchange folders, there is a moment without any folder
        ("aside", {"whole", "absent"}),
        # a working directory cannot be exchanged; the folder then says that it is incomplete
        ("inside", {"whole", "part"}),
    ],
)
def test_killed_writers_never_leave_a_mix(tmp_path: Path, way: str, allowed: set[str]) -> None:
    command = [sys.executable, str(WRITERS), str(tmp_path / "out"), way, "60"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120, check=True)
    found = json.loads(done.stdout)
    assert set(found["killed"]) <= allowed
    assert found["put right"] == {"whole": 30}
    assert found["refused"] > 0
    assert found["refused without a reason"] == 0
    assert found["leftovers"] > 0  # otherwise no writer was killed while it wrote
    assert found["beside"] == []


def inside_of(monkeypatch: pytest.MonkeyPatch, folder: Path) -> None:
    monkeypatch.chdir(folder)


def mounted(monkeypatch: pytest.MonkeyPatch, folder: Path) -> None:
    monkeypatch.setattr(claim, "_is_mounted", lambda path: path == folder)


def below_what_cannot_be_written(monkeypatch: pytest.MonkeyPatch, folder: Path) -> None:
    monkeypatch.setattr(claim.os, "access", lambda path, mode: path != folder.parent)


def holding_a_folder_of_the_users(monkeypatch: pytest.MonkeyPatch, folder: Path) -> None:
    (folder / "photos").mkdir()
    (folder / "photos" / "stalk.jpg").write_text("mine")


def plain(monkeypatch: pytest.MonkeyPatch, folder: Path) -> None:
    """Leave the folder as it is."""


@pytest.mark.parametrize(
    "somehow",
    [
        plain,
        inside_of,
        mounted,
        below_what_cannot_be_written,
        holding_a_folder_of_the_users,
    ],
)
def test_the_old_result_goes_and_the_users_files_stay(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, somehow: Callable[..., None]
) -> None:
    out = tmp_path / "out"
    write(out, "curve.csv", "extended.toml", "fields/1.vtu", "old/only.txt", text="old")
    own = {"notes.txt": "mine", "fields/labbook.txt": "mine too"}
    for name, text in own.items():
        (out / name).write_text(text)
    (out / "link").symlink_to("nowhere")
    somehow(monkeypatch, out)
    before = files(out)
    folder = out.stat().st_ino
    notes = (out / "notes.txt").open("a")  # still being written while the folder is exchanged
    write(out, "curve.csv", "fields/2.vtu")
    with notes:
        notes.write(", still")
    expected = {"curve.csv", "fields/2.vtu", "link", *own} | (before & {"photos/stalk.jpg"})
    assert files(out) == expected
    assert not (out / "old").exists()
    assert (out / "curve.csv").read_text() == "new"
    assert (out / "notes.txt").read_text() == "mine, still"
    assert (out / "fields" / "labbook.txt").read_text() == "mine too"
    assert os.readlink(out / "link") == "nowhere"
    assert [path.name for path in tmp_path.iterdir()] == ["out"]
    # the folder itself is replaced, unless this is impossible or would remove a user's folder
    assert (out.stat().st_ino != folder) == (somehow is plain)


def test_a_link_to_a_folder_stays_one(tmp_path: Path) -> None:
    (tmp_path / "disk" / "data").mkdir(parents=True)
    (tmp_path / "out").symlink_to(tmp_path / "disk" / "data")
    for text in ("old", "new"):
        write(tmp_path / "out", "curve.csv", text=text)
    assert (tmp_path / "out").is_symlink()
    assert (tmp_path / "disk" / "data" / "curve.csv").read_text() == "new"
    assert [path.name for path in (tmp_path / "disk").iterdir()] == ["data"]


def test_permissions_of_the_folder_stay(tmp_path: Path) -> None:
    write(tmp_path / "out", "curve.csv")
    (tmp_path / "out").chmod(0o2770)
    write(tmp_path / "out", "curve.csv")
    assert (tmp_path / "out").stat().st_mode & 0o7777 == 0o2770


def test_what_is_only_added_replaces_no_result(tmp_path: Path) -> None:
    """A data set is for the user to edit, so no later result may replace it."""
    write(tmp_path, "curves.csv", "groups.csv")
    write(tmp_path, "dataset.toml", "curves/A.csv", replace=False)
    assert files(tmp_path) == {"curves.csv", "groups.csv", "dataset.toml", "curves/A.csv"}
    write(tmp_path, "verdict.json")
    assert files(tmp_path) == {"verdict.json", "dataset.toml", "curves/A.csv"}


def test_a_folder_in_the_way_is_told_and_nothing_is_touched(tmp_path: Path) -> None:
    write(tmp_path / "out", "curve.csv", text="old")
    (tmp_path / "out" / "fields").write_text("mine")
    (tmp_path / "out" / "curve.png").mkdir()
    for name in ("fields/1.vtu", "curve.png"):
        with pytest.raises(FileExistsError, match="is in the way of a result"):
            write(tmp_path / "out", "curve.csv", name)
    assert files(tmp_path / "out") == {"curve.csv", "fields"}
    assert (tmp_path / "out" / "curve.csv").read_text() == "old"


def test_a_record_from_elsewhere_reaches_no_other_folder(tmp_path: Path) -> None:
    (tmp_path / "out" / "own").mkdir(parents=True)  # not to be exchanged as a whole
    (tmp_path / "precious.txt").write_text("mine")
    there = f"../precious.txt\n{tmp_path / 'precious.txt'}\n"
    (tmp_path / "out" / exchange.RECORD).write_text(there)
    write(tmp_path / "out", "curve.csv")
    assert (tmp_path / "precious.txt").read_text() == "mine"


@pytest.fixture
def holder(tmp_path: Path) -> Iterator[subprocess.Popen[str]]:
    """Another process that holds the folder `out`."""
    script = (
        "import sys, time, pathlib\n"
        "from ramiefenics.results.claim import claimed\n"
        "with claimed(pathlib.Path(sys.argv[1])) as work:\n"
        "    (work / 'new').mkdir()\n"
        "    (work / 'new' / 'curve.csv').write_text('half')\n"
        "    print('held', flush=True)\n"
        "    time.sleep(600)\n"
    )
    command = [sys.executable, "-c", script, str(tmp_path / "out")]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "held\n"
        yield process
        process.kill()


def test_a_second_writer_is_told_before_it_computes(
    coarse: rf.BendingTest,
    tmp_path: Path,
    holder: subprocess.Popen[str],
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    def never(*_: object, **__: object) -> None:
        raise AssertionError("it computes")

    monkeypatch.setattr("ramiefenics.solve.simulate.simulate", never)
    rf.write_test(coarse, tmp_path / "coarse.toml")
    arguments = ["bend", str(tmp_path / "coarse.toml"), "--out", str(tmp_path / "out")]
    monkeypatch.setattr("sys.argv", ["ramiefenics", *arguments])
    with pytest.raises(SystemExit) as stop:
        main()
    assert stop.value.code == 2
    told = capsys.readouterr().err
    assert f"is being written by another process (PID {holder.pid} on " in told
    assert told.count("\n") == 1
    with pytest.raises(rf.SpecificationError, match=f"PID {holder.pid} "):
        write(tmp_path / "out", "curve.csv")
    assert not (tmp_path / "out").exists()
    holder.kill()
    holder.wait()
    assert (tmp_path / ".out.draft" / "new" / "curve.csv").exists()
    write(tmp_path / "out", "summary.json")
    assert files(tmp_path / "out") == {"summary.json"}
    assert {path.name for path in tmp_path.iterdir()} == {"coarse.toml", "out"}


def test_a_second_thread_is_told_too(tmp_path: Path) -> None:
    told: list[str] = []

    def second() -> None:
        try:
            write(tmp_path / "out", "curve.csv")
        except rf.SpecificationError as error:
            told.append(str(error))

    with claimed(tmp_path / "out"):
        thread = threading.Thread(target=second)
        thread.start()
        thread.join()
        write(tmp_path / "out", "summary.json")  # the first thread may write
    assert len(told) == 1
    assert f"PID {os.getpid()} " in told[0]
    assert files(tmp_path / "out") == {"summary.json"}


def test_only_one_holds_a_folder_that_many_want(tmp_path: Path) -> None:
    """Claims come and go, and with them the folder that holds the lock."""
    inside: list[int] = []
    together: list[int] = []

    def want(_: int) -> int:
        had = 0
        for _ in range(400):
            try:
                with claimed(tmp_path / "out"):
                    inside.append(1)
                    together.append(len(inside))
                    inside.pop()
                    had += 1
            except rf.SpecificationError:
                continue
        return had

    with ThreadPoolExecutor(3) as pool:
        assert all(had > 0 for had in pool.map(want, range(3)))
    assert set(together) == {1}
    assert not list(tmp_path.iterdir())


def test_nothing_is_left_of_a_claim_that_came_to_nothing(tmp_path: Path) -> None:
    with pytest.raises(OSError, match="disk full"), draft(tmp_path / "a" / "b" / "out"):
        raise OSError("disk full")
    assert not list(tmp_path.iterdir())

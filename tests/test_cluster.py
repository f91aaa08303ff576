"""Studies on a Dask cluster and on MPI ranks: the same tables, even if workers die."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from concurrent.futures import BrokenExecutor, CancelledError, Executor, Future
from contextlib import contextmanager
from pathlib import Path

import psutil
import pytest
from distributed import LocalCluster

import ramiefenics as rf
from ramiefenics.cli import main
from ramiefenics.model.jit import CACHE
from ramiefenics.runs import Runs, Store

RADII = "fixture.indenter_radius_mm=4:6:8"


class Word:
    """A task that takes no time."""

    def __init__(self, name: str = "a") -> None:
        self.name = name

    def keys(self) -> tuple[str, ...]:
        return (self.name,)

    def compute(self) -> str:
        return self.name.upper()

    def read(self, text: str) -> str:
        return text


class Elsewhere(Executor):
    """A worker that does not see the folder of the process that submits."""

    def __init__(self, folder: Path, error: Exception | None = None) -> None:
        self._folder, self._error = folder, error

    def submit(self, function, task, folder, name):
        future: Future[str] = Future()
        if self._error is None:
            future.set_result(function(task, self._folder, name))
        elif isinstance(self._error, CancelledError):
            future.cancel()
            future.set_running_or_notify_cancel()
        else:
            future.set_exception(self._error)
        return future


def test_results_come_home_without_a_shared_folder(tmp_path: Path) -> None:
    here, there = tmp_path / "here", tmp_path / "there"
    (done,) = Runs(here, Elsewhere(there)).map([Word()])
    assert done.result() == "A"
    assert Store(here).get("a") == Store(there).get("a") == "A"


def test_workers_of_another_version_are_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    task = Word()
    pool = Elsewhere(tmp_path)
    pool.submit = lambda function, task, folder, name: Elsewhere.submit(
        pool, function, Word("b"), folder, name
    )
    with pytest.raises(BrokenExecutor, match="different versions of ramiefenics"):
        Runs(tmp_path, pool).map([task])


def test_a_lost_cluster_is_no_failed_simulation(tmp_path: Path) -> None:
    killed = type("KilledWorker", (Exception,), {"__module__": "distributed.scheduler"})
    for error in (killed("attempted 4 times"), CancelledError()):
        with pytest.raises(BrokenExecutor, match=r"Dask gave up|connection"):
            Runs(tmp_path, Elsewhere(tmp_path, error)).map([Word()])


def test_a_notebook_shows_what_is_left(tmp_path: Path, cell: list[str]) -> None:
    """There is one bar for all work of a `Runs`, and none if everything is kept already."""
    shown = cell
    runs = Runs(tmp_path, Elsewhere(tmp_path))
    runs.map([Word("a"), Word("b")])
    runs.map([Word("a"), Word("c")])
    assert '<progress value="0" max="2">' in shown[0]
    assert '<progress value="2" max="3">' in shown[-2]
    assert shown[-1].startswith("3 of 3 simulations")
    shown.clear()
    Runs(tmp_path, Elsewhere(tmp_path)).map([Word("a")])
    assert not shown


@pytest.mark.parametrize(
    ("options", "told"),
    [
        (["--pool", "threads"], "pool = 'threads' must be mpi"),
        (["--pool", "mpi"], "needs two ranks or more"),
        (["--pool", "mpi", "--jobs", "2"], "jobs and --pool"),
        (["--scheduler", "tcp//nowhere"], "must be the address of a running Dask scheduler"),
    ],
)
def test_what_cannot_work_is_refused(
    options: list[str],
    told: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "argv", ["ramiefenics", "sweep", "--set", RADII, *options])
    with pytest.raises(SystemExit) as ended:
        main()
    assert ended.value.code == 2
    assert told in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


@pytest.fixture
def kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Folder of finished runs in a cache that is empty except for compiled forms."""
    cache = tmp_path / "cache" / "ramiefenics"
    cache.mkdir(parents=True)
    CACHE.mkdir(parents=True, exist_ok=True)
    (cache / "forms").symlink_to(CACHE)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.setenv("OMP_NUM_THREADS", "1")
    return cache / "runs"


@pytest.fixture
def spec(coarse: rf.BendingTest, tmp_path: Path) -> Path:
    path = tmp_path / "stalk.toml"
    rf.write_test(coarse, path)
    return path


@contextmanager
def sweeping(spec: Path, out: Path, *options: str, ranks: int = 1) -> Iterator[subprocess.Popen]:
    """Run a sweep of eight simulations in a process of its own."""
    command = [sys.executable, "-m", "ramiefenics", "sweep", str(spec), "--set", RADII]
    if ranks > 1:
        command = ["mpirun", "--oversubscribe", "-n", str(ranks), *command]
    with subprocess.Popen(
        [*command, "--out", str(out), *options], stderr=subprocess.PIPE, text=True
    ) as process:
        try:
            yield process
        finally:
            process.kill()


def wait_for_one(kept: Path, process: subprocess.Popen) -> None:
    """Wait until the first run is finished."""
    while not list(kept.glob("*.txt")):
        assert process.poll() is None, process.stderr.read()
        time.sleep(0.02)


def tables(out: Path) -> dict[str, str]:
    """Return all tables of a folder."""
    return {path.name: path.read_text() for path in sorted(out.glob("*.csv"))}


@pytest.mark.slow
def test_dask_cluster_that_loses_a_worker(spec: Path, kept: Path, tmp_path: Path) -> None:
    with LocalCluster(
        n_workers=2, threads_per_worker=1, dashboard_address=None, worker_dashboard_address=None
    ) as cluster:
        address = cluster.scheduler_address
        with sweeping(spec, tmp_path / "dask", "--scheduler", address) as process:
            wait_for_one(kept, process)
            os.kill(cluster.workers[0].pid, signal.SIGKILL)
            assert process.wait() == 0, process.stderr.read()
    assert len(list(kept.glob("*.txt"))) == 8
    kept.rename(tmp_path / "before")
    with sweeping(spec, tmp_path / "alone", "--jobs", "2") as process:
        assert process.wait() == 0
    assert tables(tmp_path / "dask") == tables(tmp_path / "alone")


@pytest.mark.slow
def test_mpi_ranks_that_lose_one(spec: Path, kept: Path, tmp_path: Path) -> None:
    """MPI then ends all ranks; the same command, run again, continues."""
    with sweeping(spec, tmp_path / "mpi", "--pool", "mpi", ranks=3) as process:
        wait_for_one(kept, process)
        ranks = psutil.Process(process.pid).children(recursive=True)
        [rank for rank in ranks if "ramiefenics" in rank.cmdline()][-1].kill()
        assert process.wait() != 0
    done = {path.name: path.stat().st_mtime_ns for path in kept.glob("*.txt")}
    assert 0 < len(done) < 8
    with sweeping(spec, tmp_path / "mpi", "--pool", "mpi", ranks=3) as process:
        assert process.wait() == 0, process.stderr.read()
    now = {path.name: path.stat().st_mtime_ns for path in kept.glob("*.txt")}
    assert len(now) == 8
    assert now.items() >= done.items()
    kept.rename(tmp_path / "before")
    with sweeping(spec, tmp_path / "alone", "--jobs", "2") as process:
        assert process.wait() == 0
    assert tables(tmp_path / "mpi") == tables(tmp_path / "alone")

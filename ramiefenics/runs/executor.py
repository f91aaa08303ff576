"""Many tasks on any executor; what is done is kept, and never done again."""

from __future__ import annotations

import logging
import os
import threading
import warnings
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import BrokenExecutor, CancelledError, Executor, Future, as_completed
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Generic, Protocol, TypeVar

from loky import ProcessPoolExecutor

from ramiefenics.diagnostics import LOG, show_log
from ramiefenics.runs.notebook import NotebookProgress, in_notebook
from ramiefenics.runs.store import Store

log = logging.getLogger(__name__)

_ONE_AT_A_TIME = threading.Lock()
"""Gmsh has one state per process, whatever the number of a worker's threads."""

T = TypeVar("T")
T_co = TypeVar("T_co", covariant=True)


class Task(Protocol[T_co]):
    """Something to compute; can be sent to another process."""

    def keys(self) -> tuple[str, ...]:
        """Return the names under which it is kept, its own one first (see `key_of`)."""

    def compute(self) -> str:
        """Return the text to keep."""

    def read(self, text: str) -> T_co:
        """Return what a text tells."""


@dataclass(frozen=True)
class Done(Generic[T]):
    """What came of a task.

    Attributes
    ----------
    value
        None if it failed.
    error
        Why; None if it did not.
    """

    value: T | None
    error: Exception | None = None

    def result(self) -> T:
        """Return the value, or raise the error."""
        if self.error is not None:
            raise self.error
        assert self.value is not None  # one of the two
        return self.value


class Runs:
    """Does tasks that have not been done before; equal ones once.

    Parameters
    ----------
    folder
        Where results are kept, `RUNS` by default; by workers elsewhere too, if they see it.
    executor
        Does the work, each task on one process: see `workers`, `dask_workers` and `mpi_ranks`. By
        default as many local processes as there are cores.
    on_done
        Called with the number of distinct tasks done since the last call. By default a bar in the
        output of a notebook's cell, and nothing elsewhere.

    Attributes
    ----------
    asked, computed
        Tasks so far; those of them that had not been done before.
    """

    def __init__(
        self,
        folder: Path | None = None,
        executor: Executor | None = None,
        on_done: Callable[[int], None] | None = None,
    ) -> None:
        self._folder, self._executor = folder, executor
        self._on_done = on_done
        self._bar = NotebookProgress() if on_done is None and in_notebook() else None
        self.asked = self.computed = 0

    def map(self, tasks: Sequence[Task[T]]) -> list[Done[T]]:
        """Do tasks; return what came of them, in their order.

        Raises
        ------
        KeyboardInterrupt
            If the user has interrupted it; finished tasks are kept.
        BrokenExecutor
            If a worker died, or has another version of this code; finished tasks are kept.
        """
        store = Store(self._folder)
        names = [task.keys()[0] for task in tasks]
        distinct = dict(zip(names, tasks, strict=True))
        kept = {name: store.get(name) for name in distinct}
        found: dict[str, str | Exception] = {
            n: text for n, text in kept.items() if text is not None
        }
        left = {name: task for name, task in distinct.items() if name not in found}
        self.asked += len(tasks)
        self.computed += len(left)
        log.info("%d tasks: %d kept, %d to compute", len(distinct), len(found), len(left))
        if self._bar is not None:
            self._bar.expect(len(left))
        if self._on_done is not None:
            self._on_done(len(found))
        if left:
            found |= self._compute(left, store)
        return _read(tasks, [found[name] for name in names])

    def _compute(self, tasks: dict[str, Task[T]], store: Store) -> dict[str, str | Exception]:
        found: dict[str, str | Exception] = {}
        with workers(self._executor) as pool:
            futures = {pool.submit(compute, t, self._folder, n): n for n, t in tasks.items()}
            try:
                for future in as_completed(futures):
                    name, error = futures[future], _error_of(future)
                    if error is None:
                        found[name] = text = future.result()
                        if not store.has(name):  # made where that folder is not seen
                            store.put(tasks[name].keys(), text)
                    elif isinstance(error, Exception) and not isinstance(error, BrokenExecutor):
                        log.info("failed: %s", error)
                        found[name] = error
                    else:
                        raise error
                    self._tell_one()
            except BaseException:
                for future in futures:
                    future.cancel()
                raise
        return found

    def _tell_one(self) -> None:
        if self._bar is not None:
            self._bar.advance(1)
        if self._on_done is not None:
            self._on_done(1)


def _read(tasks: Sequence[Task[T]], found: Sequence[str | Exception]) -> list[Done[T]]:
    """Return what came of tasks: the same for equal ones.

    Others may read the same text differently, as stalks in proportion do of which one is simulated.
    """
    done: list[Done[T]] = []
    known: dict[int, list[tuple[Task[T], Done[T]]]] = {}
    for task, text in zip(tasks, found, strict=True):
        alike = known.setdefault(id(text), [])
        one = next((done for other, done in alike if other == task), None)
        if one is None:
            one = Done(task.read(text)) if isinstance(text, str) else Done(None, text)
            alike.append((task, one))
        done.append(one)
    return done


def _error_of(future: Future[str]) -> BaseException | None:
    """Return why there is no result; a `BrokenExecutor` where that is not the task's fault."""
    try:
        error = future.exception()
    except CancelledError:
        return BrokenExecutor("the connection to the workers is lost")
    if type(error).__module__.startswith("distributed"):  # as where a task's workers all died
        return BrokenExecutor(f"Dask gave up: {error}")
    return error


def compute(task: Task[object], folder: Path | None = None, name: str = "") -> str:
    """Do a task in this process, unless it has been done before; keep and return the text.

    Parameters
    ----------
    task, folder
        What to do, and where it is kept.
    name
        Under which, if another process asks for it.

    Raises
    ------
    BrokenExecutor
        If the name is another here, as under another version of this code or of dolfinx.
    """
    store, names = Store(folder), task.keys()
    if name not in ("", names[0]):
        raise BrokenExecutor(
            "a worker has another version of ramiefenics, of dolfinx or of PETSc than the process "
            "that asks"
        )
    with _ONE_AT_A_TIME:
        text = store.get(names[0])
        if text is None:
            text = task.compute()
            store.put(names, text)
    return text


@contextmanager
def workers(executor: Executor | None = None, number: int | None = None) -> Iterator[Executor]:
    """Lend an executor: the given one, or so many local processes, by default as there are cores.

    The local ones start when there is work, and end with the block, at once where it fails. They
    write to standard error what this process is set to log by `LOG`'s own level.
    """
    if executor is not None:
        yield executor
        return
    # a worker that has met larger meshes keeps their memory; loky restarts it, which is no news
    warnings.filterwarnings("ignore", "A worker was restarted", UserWarning)
    pool = ProcessPoolExecutor(
        max_workers=number or len(os.sched_getaffinity(0)),
        initializer=show_log,
        initargs=(LOG.level,),
    )
    try:
        yield pool
    except BaseException:
        pool.shutdown(wait=True, kill_workers=True)
        raise
    pool.shutdown()

"""Many tasks on any executor; finished ones are kept and never done again."""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable, Generator, Iterator, Sequence
from concurrent.futures import (
    FIRST_COMPLETED,
    BrokenExecutor,
    CancelledError,
    Executor,
    Future,
    wait,
)
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Generic, Protocol, TypeAlias, TypeVar

from ramiefenics.notebook import NotebookProgress, in_notebook
from ramiefenics.runs.store import Store
from ramiefenics.runs.workers import workers

log = logging.getLogger(__name__)

_ONE_AT_A_TIME = threading.Lock()
"""Lock for computing, as Gmsh has one state per process, however many threads a worker has."""

T = TypeVar("T")
R = TypeVar("R")
M = TypeVar("M")
T_co = TypeVar("T_co", covariant=True)


class Task(Protocol[T_co]):
    """Computation that can be sent to another process."""

    def keys(self) -> tuple[str, ...]:
        """Return the names under which its result is kept, its own first (see `key_of`)."""

    def compute(self) -> str:
        """Carry out the computation; return the text to keep."""

    def read(self, text: str) -> T_co:
        """Return the result that a kept text describes."""


@dataclass(frozen=True)
class Done(Generic[T]):
    """Outcome of a task.

    Attributes
    ----------
    value
        Result of the task; None if it failed.
    error
        Why it failed; None if it did not.
    """

    value: T | None
    error: Exception | None = None

    def result(self) -> T:
        """Return the value, or raise the error."""
        if self.error is not None:
            raise self.error
        assert self.value is not None  # one of the two
        return self.value


Computation: TypeAlias = Generator[Sequence[Task[T]], list[Done[T]], R]
"""Generator that yields tasks, is sent their outcomes, and finally returns a result."""

Futures: TypeAlias = dict[str, tuple[Task[Any], Future[str]]]
"""Submitted tasks by name."""

Found: TypeAlias = dict[str, str | Exception]
"""Texts of finished tasks, or why they failed, by name."""


class Runs:
    """Executes tasks that have not been done before; equal ones only once.

    Parameters
    ----------
    folder
        Folder in which results are kept, `RUNS` by default. Workers on other machines use it, too,
        if they can see it.
    executor
        Executor that does the work, each task on one process; see `workers`, `dask_workers` and
        `mpi_ranks`. By default there are as many local processes as cores.
    on_done
        Called with the number of distinct tasks done since the last call. By default there is a
        progress bar in the output of a notebook's cell, and nothing elsewhere.

    Attributes
    ----------
    asked
        Number of tasks so far.
    computed
        Number of distinct tasks among them that had not been done before.
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
        """Execute tasks; return their outcomes, in their order.

        Raises
        ------
        KeyboardInterrupt
            If the user interrupts it; finished tasks are kept.
        BrokenExecutor
            If a worker died, or has another version of this code; finished tasks are kept.
        """

        def once() -> Computation[T, list[Done[T]]]:
            return (yield tasks)

        return self.together([once()])[0]

    def together(self, computations: Sequence[Computation[T, R]]) -> list[R]:
        """Carry out computations, each of which goes on as soon as its own tasks are done.

        Parameters
        ----------
        computations
            Generators that yield tasks, are sent their outcomes, and finally return a result.

        Returns
        -------
        The results, in the order of the computations.

        Raises
        ------
        KeyboardInterrupt, BrokenExecutor
            As `map`.
        """
        results: dict[int, R] = {}
        found: Found = {}
        asked: list[Sequence[Task[T]] | None] = [None for _ in computations]
        waiting: dict[int, list[str]] = {i: [] for i in range(len(computations))}
        with workers(self._executor) as pool, _cancelled_if_it_fails() as futures:
            while waiting:
                ready = [i for i, names in waiting.items() if found.keys() >= set(names)]
                if not ready:
                    self._collect(futures, found)
                for i in ready:
                    tasks, names = asked[i], waiting.pop(i)
                    # a generator that has not begun yet takes None
                    outcomes: Any = None
                    if tasks is not None:
                        outcomes = _read(tasks, [found[name] for name in names])
                    try:
                        asked[i] = tasks = computations[i].send(outcomes)
                    except StopIteration as end:
                        results[i] = end.value
                        continue
                    waiting[i] = [task.keys()[0] for task in tasks]
                    self._begin(dict(zip(waiting[i], tasks, strict=True)), pool, futures, found)
                    self.asked += len(tasks)
        return [results[i] for i in range(len(computations))]

    def _begin(
        self, tasks: dict[str, Task[T]], pool: Executor, futures: Futures, found: Found
    ) -> None:
        """Submit the tasks that have neither been done nor begun."""
        store = Store(self._folder)
        new = [name for name in tasks if name not in found and name not in futures]
        kept = {name: text for name in new if (text := store.get(name)) is not None}
        left = [name for name in new if name not in kept]
        found |= kept
        self.computed += len(left)
        log.info("%d tasks: %d kept, %d to compute", len(tasks), len(kept), len(left))
        if self._bar is not None:
            self._bar.expect(len(left))
        if self._on_done is not None:
            self._on_done(len(kept))
        for name in left:
            futures[name] = tasks[name], pool.submit(compute, tasks[name], self._folder, name)

    def _collect(self, futures: Futures, found: Found) -> None:
        """Wait for submitted tasks; take the outcomes of those that are done."""
        store = Store(self._folder)
        wait([future for _, future in futures.values()], return_when=FIRST_COMPLETED)
        for name in [name for name, (_, future) in futures.items() if future.done()]:
            task, future = futures.pop(name)
            error = _error_of(future)
            if error is None:
                found[name] = text = future.result()
                if not store.has(name):  # done where that folder is not visible
                    store.put(task.keys(), text)
            elif isinstance(error, Exception) and not isinstance(error, BrokenExecutor):
                log.info("failed: %s", error)
                found[name] = error
            else:
                raise error
            self._tell_one()

    def _tell_one(self) -> None:
        if self._bar is not None:
            self._bar.advance(1)
        if self._on_done is not None:
            self._on_done(1)


@contextmanager
def _cancelled_if_it_fails() -> Iterator[Futures]:
    """Provide room for futures, which are cancelled if the block fails."""
    futures: Futures = {}
    try:
        yield futures
    except BaseException:
        for _, future in futures.values():
            future.cancel()
        raise


def _read(tasks: Sequence[Task[T]], found: Sequence[str | Exception]) -> list[Done[T]]:
    """Return the outcomes of tasks, one and the same for equal tasks.

    Tasks that are not equal may read the same text differently: of stalks whose moduli are in
    proportion, only one is simulated.
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
    """Return why there is no result; a `BrokenExecutor` if the task is not at fault."""
    try:
        error = future.exception()
    except CancelledError:
        return BrokenExecutor("the connection to the workers was lost")
    if type(error).__module__.startswith("distributed"):  # such as when all workers of a task died
        return BrokenExecutor(f"Dask gave up: {error}")
    return error


def compute(task: Task[object], folder: Path | None = None, name: str = "") -> str:
    """Execute a task in this process, unless it was done before; keep and return the text.

    Parameters
    ----------
    task, folder
        Task, and folder in which its text is kept.
    name
        Name under which the process that asks expects the text, if that is another process.

    Raises
    ------
    BrokenExecutor
        If the name is different here, as with another version of this code or of dolfinx.
    """
    store, names = Store(folder), task.keys()
    if name not in ("", names[0]):
        raise BrokenExecutor(
            "a worker and the calling process have different versions of ramiefenics, dolfinx or "
            "PETSc"
        )
    with _ONE_AT_A_TIME:
        text = store.get(names[0])
        if text is None:
            text = task.compute()
            store.put(names, text)
    return text


@contextmanager
def lasting(runs: M | None) -> Iterator[M | Runs]:
    """Provide the given runs or else default ones, whose local processes last until the end."""
    if runs is not None:
        yield runs
        return
    with workers() as pool:
        yield Runs(executor=pool)

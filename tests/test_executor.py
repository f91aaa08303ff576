"""Many tasks on several processes."""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest

from ramiefenics.runs import Runs, workers
from ramiefenics.runs.executor import Computation

PATIENCE_S = 60.0


@dataclass(frozen=True)
class Wait:
    """Task that waits for a file."""

    path: Path

    def keys(self) -> tuple[str, ...]:
        return (f"wait-{self.path.name}",)

    def compute(self) -> str:
        end = time.monotonic() + PATIENCE_S
        while not self.path.exists():
            if time.monotonic() > end:
                raise TimeoutError(str(self.path))
            time.sleep(0.02)
        return "waited"

    def read(self, text: str) -> str:
        return text


@dataclass(frozen=True)
class Write:
    """Task that writes a file."""

    path: Path

    def keys(self) -> tuple[str, ...]:
        return (f"write-{self.path.name}",)

    def compute(self) -> str:
        assert not self.path.exists(), "written twice"
        self.path.touch()
        return f"wrote {self.path.name}"

    def read(self, text: str) -> str:
        return text


@pytest.fixture
def runs(tmp_path: Path) -> Iterator[Runs]:
    with workers(number=2) as pool:
        yield Runs(tmp_path / "kept", pool)


def writing(*paths: Path) -> Computation[str, list[str]]:
    """Write files one after the other; return what the tasks say."""
    said = []
    for path in paths:
        (done,) = yield [Write(path)]
        said.append(done.result())
    return said


def waiting(*paths: Path) -> Computation[str, int]:
    """Wait for files, all at once; return for how many."""
    done = yield [Wait(path) for path in paths]
    return [one.result() for one in done].count("waited")


def test_a_computation_does_not_wait_for_the_tasks_of_another(runs: Runs, tmp_path: Path) -> None:
    """The file that one waits for is written by the second task of the other."""
    first, second = tmp_path / "first", tmp_path / "second"
    assert runs.together([waiting(second), writing(first, second)]) == [
        1,
        ["wrote first", "wrote second"],
    ]
    assert (runs.asked, runs.computed) == (3, 3)


def test_computations_share_tasks(runs: Runs, tmp_path: Path) -> None:
    """`Write` refuses to be computed twice."""
    first, second = tmp_path / "first", tmp_path / "second"
    said = runs.together([writing(first, second), writing(second), writing(), writing(first)])
    assert [len(some) for some in said] == [2, 1, 0, 1]
    assert (runs.asked, runs.computed) == (4, 2)
    assert runs.together([writing(second, first)]) == [["wrote second", "wrote first"]]
    assert runs.computed == 2


def test_a_failed_task_is_told_to_its_computation(runs: Runs, tmp_path: Path) -> None:
    path = tmp_path / "file"
    path.touch()
    with pytest.raises(AssertionError, match="written twice"):
        runs.together([writing(path)])

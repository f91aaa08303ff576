"""Simulations kept by the content of their specification: none is done twice."""

from __future__ import annotations

import dataclasses
import functools
import hashlib
import json
import os
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pandas as pd
from mpi4py import MPI

from ramiefenics.model.compat import VERSION
from ramiefenics.model.jit import CACHE
from ramiefenics.model.observables import Observables
from ramiefenics.solve.quasistatic import Ending, Jump, Step
from ramiefenics.solve.result import BendingResult, Statistics
from ramiefenics.solve.simulate import simulate
from ramiefenics.specification import BendingTest
from ramiefenics.specification.files import to_dict

RUNS = CACHE.parent / "runs"


class Shelf:
    """Texts by key; one that is there is whole.

    Parameters
    ----------
    suffix
        Of the files, such as ``csv``.
    folder
        Of the files, `RUNS` by default.
    """

    def __init__(self, suffix: str, folder: Path | None = None) -> None:
        self._folder = RUNS if folder is None else folder
        self._folder.mkdir(parents=True, exist_ok=True)
        self._suffix = suffix

    def path(self, key: str) -> Path:
        """Return the file of a key, whether it is there or not."""
        return self._folder / f"{key}.{self._suffix}"

    def put(self, key: str, text: str) -> None:
        """Keep a text."""
        partial = self.path(key).with_suffix(f".{os.getpid()}")
        partial.write_text(text, encoding="utf-8")
        partial.rename(self.path(key))  # never half a file under that name


def key_of(content: Any) -> str:
    """Return a name for what comes out: of nested content, the program and its solver."""
    text = json.dumps([_rounded(content), _program()], sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()[:32]


@dataclass(frozen=True)
class KeptRun:
    """A simulation, done now or before.

    Attributes
    ----------
    result
        Without snapshots.
    cpu_s
        Processor time of all ranks.
    """

    result: BendingResult
    cpu_s: float


class KeptRuns:
    """Simulates, unless it has been done before on as many ranks.

    Parameters
    ----------
    comm
        MPI communicator, all of whose ranks call; the world by default.
    folder
        Where results are kept, `RUNS` by default.
    """

    def __init__(self, comm: MPI.Comm | None = None, folder: Path | None = None) -> None:
        self.comm = MPI.COMM_WORLD if comm is None else comm
        self._shelf = Shelf("json", folder)

    def has(self, test: BendingTest) -> bool:
        """Return whether a test has been simulated; collective."""
        return bool(self.comm.bcast(self._shelf.path(self.key(test)).exists()))

    def run(
        self, test: BendingTest, on_step: Callable[[Step[Observables]], None] | None = None
    ) -> KeptRun:
        """Return the result of a test; collective.

        Raises
        ------
        SpecificationError
            If the law cannot take a layer's constants.
        KeyboardInterrupt
            If the user has interrupted it; nothing is kept of it.
        """
        key = self.key(test)
        if not self.has(test):
            start = time.process_time()
            result = simulate(test, self.comm, on_step)
            if result.ending.kind == "interrupted":
                raise KeyboardInterrupt
            spent = self.comm.allreduce(time.process_time() - start)
            if self.comm.rank == 0:
                self._shelf.put(key, _dump(KeptRun(result, spent)))
        path = self._shelf.path(key)
        text = path.read_text(encoding="utf-8") if self.comm.rank == 0 else ""
        return _load(test, self.comm.bcast(text))

    def key(self, test: BendingTest) -> str:
        """Return the name under which a test is kept, whatever its mesh recipe is called."""
        mesh = dataclasses.replace(test.numerics.mesh, name="")
        numerics = dataclasses.replace(test.numerics, mesh=mesh)
        return key_of([to_dict(dataclasses.replace(test, numerics=numerics)), self.comm.size])


def _dump(run: KeptRun) -> str:
    result = run.result
    content = {
        "curve": result.curve.to_dict("list"),
        "statistics": dataclasses.asdict(result.statistics),
        "ending": dataclasses.asdict(result.ending),
        "jumps": [dataclasses.asdict(jump) for jump in result.jumps],
        "cpu_s": run.cpu_s,
    }
    return json.dumps(content)


def _load(test: BendingTest, text: str) -> KeptRun:
    content = json.loads(text)
    result = BendingResult(
        test,
        pd.DataFrame(content["curve"]),
        (),
        Statistics(**content["statistics"]),
        Ending(**content["ending"]),
        tuple(Jump(**jump) for jump in content["jumps"]),
    )
    return KeptRun(result, content["cpu_s"])


def _rounded(value: Any) -> Any:
    """Return nested content with numbers to twelve digits: rounding must not tell tests apart."""
    if isinstance(value, dict):
        return {key: _rounded(item) for key, item in value.items()}
    if isinstance(value, list):
        return [_rounded(item) for item in value]
    return f"{value:.12g}" if isinstance(value, float) else value


@functools.cache
def _program() -> str:
    """Return a key of all source that a result depends on."""
    package = Path(__file__).resolve().parent
    digest = hashlib.sha256(VERSION.encode())
    for part in ("specification", "model", "solve"):
        for path in sorted((package / part).rglob("*.py")):
            digest.update(path.read_bytes())
    return digest.hexdigest()

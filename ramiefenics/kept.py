"""Simulations kept by the content of their specification: none is done twice."""

from __future__ import annotations

import dataclasses
import functools
import hashlib
import json
import os
import secrets
import time
import warnings
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pandas as pd
from mpi4py import MPI

from ramiefenics.model.jit import CACHE
from ramiefenics.model.observables import Observables
from ramiefenics.solve.provenance import libraries, source
from ramiefenics.solve.quasistatic import Ending, Jump, Step
from ramiefenics.solve.result import BendingResult, Statistics
from ramiefenics.solve.simulate import simulate
from ramiefenics.specification import BendingTest
from ramiefenics.specification.files import to_dict

RUNS = CACHE.parent / "runs"


class Shelf:
    """Texts by key; what is not as it was put there counts as never put.

    The first line of a file is a checksum of key and text. A file that does not match it is
    removed, which is told once per process, so that its content is computed again.

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

    def get(self, key: str) -> str | None:
        """Return the text of a key; None if there is none, or none that can be trusted."""
        path = self._path(key)
        try:
            content = path.read_bytes()
        except FileNotFoundError:
            return None
        except OSError:
            content = b""
        checksum, _, text = content.partition(b"\n")
        if checksum == _checksum(key, text):
            return text.decode("utf-8")
        _tell_once(f"some results kept in {self._folder} are damaged; they are computed again")
        with suppress(OSError):
            path.unlink()
        return None

    def put(self, key: str, text: str) -> None:
        """Keep a text; tell, once per process, if the file system does not let it."""
        path, content = self._path(key), text.encode("utf-8")
        partial = path.with_name(f".{path.name}.{secrets.token_hex(8)}")
        try:
            with partial.open("xb") as file:
                file.write(_checksum(key, content) + b"\n" + content)
                file.flush()
                os.fsync(file.fileno())
            partial.replace(path)  # never half a file under that name
        except OSError as error:
            _tell_once(f"results cannot be kept in {self._folder}: {error.strerror}")
            partial.unlink(missing_ok=True)

    def _path(self, key: str) -> Path:
        return self._folder / f"{key}.{self._suffix}"


def _checksum(key: str, text: bytes) -> bytes:
    """Return a checksum of a text and the key it belongs to."""
    return hashlib.sha256(key.encode() + b"\n" + text).hexdigest().encode()


@functools.cache  # once per process, whatever the filters of warnings are
def _tell_once(message: str) -> None:
    warnings.warn(message, stacklevel=3)


def key_of(content: Any, *modules: str) -> str:
    """Return a name for what comes out, by all that it depends on.

    Parameters
    ----------
    content
        Nested, as JSON knows it: the specification, and what else is asked for.
    modules
        Files of modules other than the solver's that what is kept depends on.
    """
    text = json.dumps([_rounded(content), source(*modules), libraries()], sort_keys=True)
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
        return self._text(test) is not None

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
        text = self._text(test)
        if text is None:
            start = time.process_time()
            result = simulate(test, self.comm, on_step)
            if result.ending.kind == "interrupted":
                raise KeyboardInterrupt
            spent = self.comm.allreduce(time.process_time() - start)
            text = self.comm.bcast(_dump(KeptRun(result, spent)))
            if self.comm.rank == 0:
                self._shelf.put(self.key(test), text)
        return _load(test, text)

    def _text(self, test: BendingTest) -> str | None:
        """Return what is kept of a test; collective."""
        text = self._shelf.get(self.key(test)) if self.comm.rank == 0 else None
        return self.comm.bcast(text)

    def key(self, test: BendingTest) -> str:
        """Return the name under which a test is kept, whatever its mesh recipe is called."""
        mesh = dataclasses.replace(test.numerics.mesh, name="")
        numerics = dataclasses.replace(test.numerics, mesh=mesh)
        content = [to_dict(dataclasses.replace(test, numerics=numerics)), self.comm.size]
        return key_of(content, __file__)


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
    """Return nested content with numbers to twelve digits.

    A specification that is reached by another order of multiplications differs in the sixteenth;
    in the twelfth no result feels a difference, since Newton's tolerance is far coarser.
    """
    if isinstance(value, dict):
        return {key: _rounded(item) for key, item in value.items()}
    if isinstance(value, list):
        return [_rounded(item) for item in value]
    return f"{value:.12g}" if isinstance(value, float) else value

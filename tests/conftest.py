"""Shared fixtures: a coarse test, and one screening run for all tests that examine results."""

from __future__ import annotations

import dataclasses
import fcntl
import hashlib
import os
import pickle
import warnings
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
import pytest
from mpi4py import MPI

from ramiefenics import BendingResult, BendingTest, override, ramie, simulate
from ramiefenics.solve.quasistatic import Ending
from ramiefenics.solve.result import Statistics
from ramiefenics.specification.files import dump_test

Simulate = Callable[[BendingTest], BendingResult]


@pytest.fixture(autouse=True)
def _no_progress_colours(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("NO_COLOR", "1")


@pytest.fixture
def cell(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """What a progress bar shows, one after the other, as if this was the cell of a notebook."""
    shown: list[str] = []

    class Output:
        def update(self, html: Any) -> None:
            shown.append(html.data)

    shell = SimpleNamespace(kernel=None)
    monkeypatch.setattr("IPython.get_ipython", lambda: shell)
    monkeypatch.setattr("IPython.display.display", lambda *args, **options: Output())
    return shown


@pytest.fixture(scope="session")
def screening() -> BendingTest:
    """The calibration stalk on the screening recipe."""
    return override(ramie(14.23, 7.28, 0.67), ["numerics.mesh=screening"])


@pytest.fixture(scope="session")
def coarse(screening: BendingTest) -> BendingTest:
    """The coarsest usable mesh, for tests of the program: 3 mm of travel in a second or two."""
    return override(
        screening,
        [
            "numerics.mesh=ladder_q1_1",
            "numerics.mesh.angular_elements=6",
            "numerics.mesh.wall_elements=1",
            "numerics.mesh.contact_size=0.02",
            "numerics.mesh.coarse_size=0.045",
            "protocol.travel_mm=3.0",
        ],
    )


@pytest.fixture(scope="session")
def simulated(tmp_path_factory: pytest.TempPathFactory) -> Simulate:
    """Simulate on one rank, each specification only once across all of pytest's processes."""
    folder = tmp_path_factory.getbasetemp()
    if "PYTEST_XDIST_WORKER" in os.environ:
        folder = folder.parent

    results: dict[str, BendingResult] = {}

    def run(test: BendingTest) -> BendingResult:
        name = hashlib.sha256(dump_test(test).encode()).hexdigest()
        if name not in results:
            kept = folder / f"{name}.pickle"
            with (folder / f"{name}.lock").open("w") as lock:
                fcntl.flock(lock, fcntl.LOCK_EX)
                if not kept.exists():
                    kept.write_bytes(pickle.dumps(simulate(test, comm=MPI.COMM_SELF)))
            results[name] = pickle.loads(kept.read_bytes())
        return results[name]

    return run


@pytest.fixture(scope="session")
def bent(screening: BendingTest, simulated: Simulate) -> BendingResult:
    """Result of the whole travel on the screening recipe."""
    return simulated(screening)


@pytest.fixture
def as_result() -> Callable[..., BendingResult]:
    """Make a result from a curve that no solver computed."""

    def make(test: BendingTest, x: np.ndarray, force: np.ndarray) -> BendingResult:
        displacement, recorded = test.machine.recorded(x, force)
        curve = pd.DataFrame({"displacement_mm": x, "recorded_displacement_mm": displacement})
        completed = x[-1] >= test.protocol.travel_mm
        ending = Ending("completed") if completed else Ending("physical", "the void has closed")
        statistics = Statistics(9, 1, 28, 30, 60, 0, 1.0, 1)
        losses = {"min_volume_ratio": 1.0, "min_principal_stretch": 1.0, "min_acoustic_MPa": 1.0}
        curve = curve.assign(force_N=force, recorded_force_N=recorded, **losses)
        return BendingResult(test, curve, (), statistics, ending)

    return make


@pytest.fixture
def change() -> Callable[..., BendingTest]:
    """Replace top-level parts of a test."""

    def apply(test: BendingTest, **parts: object) -> BendingTest:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return dataclasses.replace(test, **parts)

    return apply

"""The package's log, shown on request."""

from __future__ import annotations

import logging
import os
import re
import subprocess
import sys
from itertools import pairwise
from pathlib import Path

import pytest
from mpi4py import MPI

import ramiefenics as rf
from ramiefenics.diagnostics import LOG
from ramiefenics.runs import workers


@pytest.fixture
def short(coarse: rf.BendingTest) -> rf.BendingTest:
    return rf.override(coarse, ["protocol.travel_mm=0.4", "numerics.stepping.first_step_mm=0.2"])


def residuals(caplog: pytest.LogCaptureFixture) -> list[list[tuple[float, float]]]:
    """Return residual and tolerance of every iteration of each solve."""
    solves: list[list[tuple[float, float]]] = []
    for record in caplog.records:
        if record.name == "ramiefenics.solve.newton":
            iteration, *residual_and_tolerance = record.args
            solves += [[]] if iteration == 0 else []
            solves[-1].append(residual_and_tolerance)
    return solves


def test_residuals_of_every_iteration_are_told(
    short: rf.BendingTest, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level(logging.DEBUG, "ramiefenics")
    result = rf.simulate(short, MPI.COMM_SELF)
    solves = residuals(caplog)
    assert sum(len(solve) - 1 for solve in solves) == result.statistics.newton_iterations
    assert any(len(solve) > 2 for solve in solves)
    for solve in solves:  # each ends at the first iteration that has converged
        assert [residual <= tolerance for residual, tolerance in solve].index(True) == len(
            solve
        ) - 1
        # and each iteration reduces the residual by a factor of five at least
        assert all(after < 0.2 * before for (before, _), (after, _) in pairwise(solve))
    told = [r.getMessage() for r in caplog.records if r.name == "ramiefenics.solve.quasistatic"]
    steps = [text for text in told if text.endswith("iterations")]
    assert len(steps) == result.statistics.steps
    assert f"{result.curve['force_N'].iloc[-1]:.4f} N" in steps[-1]


def test_nothing_is_logged_where_nobody_asks(
    short: rf.BendingTest, capfd: pytest.CaptureFixture[str]
) -> None:
    rf.simulate(short, MPI.COMM_SELF)
    assert capfd.readouterr() == ("", "")


def test_options_of_petsc_reach_the_solver(short: rf.BendingTest, tmp_path: Path) -> None:
    """PETSc's view of the solver shows them, and the code's choice for all other options."""
    rf.write_test(short, tmp_path / "short.toml")
    script = (
        "import ramiefenics as rf; from mpi4py import MPI;"
        "rf.simulate(rf.read_test('short.toml'), MPI.COMM_SELF)"
    )
    options = "-ramiefenics_mat_mumps_icntl_14 50 -ramiefenics_ksp_view ::ascii_info_detail"
    done = subprocess.run(
        [sys.executable, "-c", script],
        env={**os.environ, "PETSC_OPTIONS": options},
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=True,
    )
    assert re.search(r" ICNTL\(14\) .*:\s*50\n", done.stdout)
    assert re.search(r" ICNTL\(7\) .*:\s*5\n", done.stdout)  # METIS
    assert "not used" not in done.stdout + done.stderr


def test_verbose_commands_tell_on_standard_error(tmp_path: Path) -> None:
    def specification(*options: str) -> subprocess.CompletedProcess[str]:
        command = [sys.executable, "-m", "ramiefenics", "specification", "table3", *options]
        return subprocess.run(command, capture_output=True, text=True)

    quiet, told = specification(), specification("-v")
    assert told.stdout == quiet.stdout
    assert "ramiefenics 0.1.0: specification table3 -v" in told.stderr
    assert set(quiet.stderr.splitlines()) < set(told.stderr.splitlines())
    refused = specification("-vv", "--set", "fixture.span_mm=-1")
    assert refused.returncode == 2
    assert "check_number" in refused.stderr


def level() -> int:
    return logging.getLogger("ramiefenics").level


def test_workers_tell_what_their_parent_does(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(LOG, "level", logging.DEBUG)
    with workers() as pool:
        assert pool.submit(level).result() == logging.DEBUG

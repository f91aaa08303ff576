"""An interrupted run resumes and gives the same result to the bit."""

from __future__ import annotations

import hashlib
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest
from mpi4py import MPI
from pandas.testing import assert_frame_equal

from ramiefenics import BendingResult, BendingTest, override, simulate
from ramiefenics.runs import resumed
from ramiefenics.runs.resumed import solutions_of
from ramiefenics.solve.newton import Newton
from ramiefenics.specification.files import dump_test

YIELDING = [
    "law=fibre_plasticity",
    "stalk.layers.phloem.material.law_constants.tensile_yield_strain=0.002",
]
SECOND_ORDER = [  # the element of the recipes for use, on few cells
    "numerics.mesh=screening",
    "numerics.mesh.contact_size=0.02",
    "numerics.mesh.coarse_size=0.045",
]
ITERATIVE = ["numerics.stepping.linear_solver=iterative"]


class PowerCut(Exception):
    """Sudden end of a run."""


@pytest.fixture(autouse=True)
def own_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr(resumed, "BENDS", tmp_path / "bends")
    return tmp_path / "bends"


@pytest.fixture
def solves(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    """List with one entry for each nonlinear solve."""
    counted, solve = [], Newton.solve

    def counting(self, *args, **kwargs):
        counted.append(0.0)
        return solve(self, *args, **kwargs)

    monkeypatch.setattr(Newton, "solve", counting)
    return counted


def bend(test: BendingTest, until_mm: float = 1e9, comm: MPI.Comm = MPI.COMM_SELF) -> BendingResult:
    """Bend with kept solutions; the power fails beyond some travel."""

    def cut(step) -> None:
        if step.travel_mm > until_mm:
            raise PowerCut

    with solutions_of(test, comm) as solutions:
        assert solutions is not None
        return simulate(test, comm, on_step=cut, solutions=solutions)


def same(one: BendingResult, other: BendingResult) -> None:
    assert_frame_equal(one.curve, other.curve, check_exact=True)
    assert one.statistics.newton_iterations == other.statistics.newton_iterations
    assert one.statistics.linear_iterations == other.statistics.linear_iterations
    assert one.ending == other.ending
    assert one.jumps == other.jumps
    for snapshot, twin in zip(one.snapshots, other.snapshots, strict=True):
        assert (snapshot.body.points == twin.body.points).all()


KINDS = pytest.mark.parametrize(
    "changes",
    [[], YIELDING, ITERATIVE, SECOND_ORDER],
    ids=["elastic", "plastic", "iterative", "second order"],
)


@KINDS
def test_an_interrupted_bend_goes_on_to_the_bit(
    changes: list[str], coarse: BendingTest, solves: list[float]
) -> None:
    test = override(coarse, changes)
    whole = simulate(test, MPI.COMM_SELF)
    needed = len(solves)
    for until in (0.5, 0.5, 1.7):  # the second run gets no farther than the first
        with pytest.raises(PowerCut):
            bend(test, until)
    same(bend(test), whole)
    assert len(solves) == 2 * needed  # no solve is repeated
    same(bend(test), whole)
    assert len(solves) == 2 * needed


def test_further_tests_go_on_too(coarse: BendingTest, solves: list[float]) -> None:
    back = ["protocol.travel_mm=1", "protocol.then=[{to_mm=0}]"]
    further = "further=[{protocol={travel_mm=2.0, then=[]}}]"
    test = override(coarse, [*YIELDING, *back, further])
    whole = simulate(test, MPI.COMM_SELF)
    needed = len(solves)
    with pytest.raises(PowerCut):
        bend(test, 1.2)  # in the second test
    again = bend(test)
    assert len(solves) == 2 * needed
    for one, other in ((again, whole), (again.further[0], whole.further[0])):
        same(one, other)


@pytest.mark.mpi
@KINDS
def test_ranks_go_on_together(
    changes: list[str], coarse: BendingTest, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """They do so even if one of them has kept one step less than the other.

    Factors on several ranks are summed in the order in which messages arrive, so two runs may
    differ by rounding, amplified by solving to a relative tolerance of 1e-5.
    """
    comm = MPI.COMM_WORLD
    shared = comm.bcast(tmp_path)
    monkeypatch.setattr(resumed, "BENDS", shared)
    test = override(coarse, [*changes, "protocol.travel_mm=1.5"])
    whole = simulate(test, comm)
    with pytest.raises(PowerCut):
        bend(test, 1.0, comm)
    comm.barrier()
    if comm.rank == 0:
        path = next(shared.glob("*-0"))
        path.write_bytes(path.read_bytes()[:-1])
    comm.barrier()
    again = bend(test, comm=comm)
    assert_frame_equal(again.curve, whole.curve, rtol=1e-5, atol=1e-5)
    assert again.statistics.newton_iterations == whole.statistics.newton_iterations


@pytest.mark.slow
def test_jumps_are_repeated_to_the_bit(screening: BendingTest) -> None:
    """The slip during a jump is restored as well."""
    mesh = ["numerics.mesh=ladder_q1_1", "numerics.mesh.contact_size=0.015"]
    test = override(screening, ["law=neo_hookean", *mesh])
    whole = simulate(test, MPI.COMM_SELF)
    assert whole.jumps
    jumped = whole.jumps[0].displacement_mm
    for until in (jumped - 1e-6, jumped + 0.5):
        with pytest.raises(PowerCut):
            bend(test, until)
    same(bend(test), whole)


def half(content: bytes) -> bytes:
    return content[: len(content) // 2]


def flipped(content: bytes) -> bytes:
    changed = bytearray(content)
    changed[len(content) // 3] ^= 1
    return bytes(changed)


@pytest.mark.parametrize("damaged", [half, flipped, lambda content: b"", lambda content: b"x" * 99])
def test_what_is_damaged_is_solved_again(
    damaged: Callable[[bytes], bytes], coarse: BendingTest, own_folder: Path, solves: list[float]
) -> None:
    test = override(coarse, ["protocol.travel_mm=1.0"])
    whole = bend(test)
    (path,) = own_folder.iterdir()
    path.write_bytes(damaged(path.read_bytes()))
    before = len(solves)
    same(bend(test), whole)
    assert len(solves) > before
    before = len(solves)
    same(bend(test), whole)
    assert len(solves) == before


def test_solutions_of_other_unknowns_are_not_used(
    coarse: BendingTest, own_folder: Path, solves: list[float]
) -> None:
    """Examples are another partition of the mesh, or the numbering of another release."""
    test = override(coarse, ["protocol.travel_mm=1.0"])
    whole = bend(test)
    (path,) = own_folder.iterdir()
    content = path.read_bytes()
    path.write_bytes(hashlib.sha256(b"other positions").digest() + content[32:])
    before = len(solves)
    same(bend(test), whole)
    assert len(solves) == 2 * before
    assert path.read_bytes()[:32] == content[:32]


def test_who_comes_second_is_not_kept(coarse: BendingTest) -> None:
    with solutions_of(coarse, MPI.COMM_SELF) as first:
        assert first is not None
        with solutions_of(coarse, MPI.COMM_SELF) as second:
            assert second is None


def test_old_runs_make_room(
    coarse: BendingTest, own_folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    own_folder.mkdir()
    for age, name in enumerate(("newer-0", "older-0", "oldest-0")):
        (own_folder / name).write_bytes(b"x" * 400)
        os.utime(own_folder / name, times=(1e9 - age, 1e9 - age))
    monkeypatch.setattr(resumed, "ROOM_BYTES", 1000)
    bend(override(coarse, ["protocol.travel_mm=0.1"]))
    kept = {path.name for path in own_folder.iterdir()}
    assert {"newer-0", "older-0"} < kept
    assert "oldest-0" not in kept
    assert len(kept) == 3


@pytest.mark.slow
def test_a_killed_command_goes_on(coarse: BendingTest, tmp_path: Path) -> None:
    spec = tmp_path / "coarse.toml"
    spec.write_text(dump_test(coarse))
    environment = os.environ | {"XDG_CACHE_HOME": str(tmp_path / "cache")}

    def command(out: str) -> list[str]:
        python = [sys.executable, "-m", "ramiefenics"]
        return [*python, "bend", str(spec), "--out", str(tmp_path / out)]

    def size() -> int:
        kept = (tmp_path / "cache").rglob("bends/*-0")
        return sum(path.stat().st_size for path in kept)

    seen = 0
    for _ in range(3):
        running = subprocess.Popen(command("killed"), env=environment)
        while running.poll() is None and size() <= seen:
            time.sleep(0.01)
        running.send_signal(signal.SIGKILL)
        running.wait()
        seen = size()
    subprocess.run(command("killed"), env=environment, check=True, capture_output=True)
    elsewhere = os.environ | {"XDG_CACHE_HOME": str(tmp_path / "other")}
    subprocess.run(command("whole"), env=elsewhere, check=True, capture_output=True)
    killed, whole = (tmp_path / name / "curve.csv" for name in ("killed", "whole"))
    assert killed.read_bytes() == whole.read_bytes()

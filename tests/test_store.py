"""Kept results are those that were computed; otherwise they are computed again."""

from __future__ import annotations

import errno
import json
import os
import random
import subprocess
import sys
import warnings
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from types import SimpleNamespace

import dolfinx
import gmsh
import numpy as np
import pandas as pd
import pytest
from mpi4py import MPI
from petsc4py import PETSc

import ramiefenics as rf
from ramiefenics.discovery.curves.factors import factors
from ramiefenics.runs import Runs, SharedRuns, Simulation, Store, simulation, store
from ramiefenics.runs import curve as curves
from ramiefenics.runs.curve import CurveTask
from ramiefenics.solve import provenance

FLIPS = 300

Ask = Callable[[], tuple[pd.DataFrame, bool]]
"""Function that requests a curve; returns it, and whether it had to be computed."""


@pytest.fixture
def truth() -> pd.DataFrame:
    x = np.linspace(0.0, 14.0, 29)
    return pd.DataFrame({"displacement_mm": x, "force_N": 12.0 * np.sin(x / 9.0)})


@pytest.fixture(params=["together", "task"])
def ask(
    request: pytest.FixtureRequest,
    coarse: rf.BendingTest,
    truth: pd.DataFrame,
    as_result: Callable[..., rf.BendingResult],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> Ask:
    """Both ways to keep a curve, in a folder of one file; a formula replaces the simulation."""
    computed: list[object] = []

    def simulate(test: rf.BendingTest, *_: object) -> rf.BendingResult:
        computed.append(test)
        return as_result(test, truth["displacement_mm"].to_numpy(), truth["force_N"].to_numpy())

    def compute(task: CurveTask) -> str:
        computed.append(task)
        return truth.to_csv(index=False)

    monkeypatch.setattr(simulation, "simulate", simulate)
    monkeypatch.setattr(CurveTask, "compute", compute)
    monkeypatch.setattr(curves, "normalised", lambda test: (test, 1.0))

    def one() -> tuple[pd.DataFrame, bool]:
        before = len(computed)
        if request.param == "together":
            runs = SharedRuns(MPI.COMM_SELF, tmp_path)
            curve = runs.run(coarse).result.curve[["displacement_mm", "force_N"]]
        else:
            with ThreadPoolExecutor(1) as pool:
                curve = Runs(tmp_path, pool).map([CurveTask(coarse)])[0].result()
        return curve, len(computed) > before

    return one


@pytest.mark.filterwarnings("ignore:some results kept")
def test_no_flipped_bit_is_used_as_if_true(
    ask: Ask, truth: pd.DataFrame, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(store.os, "fsync", lambda _: None)  # avoids waiting 300 times for a disk
    assert ask()[1]
    (file,) = tmp_path.iterdir()
    whole = file.read_bytes()
    draw = random.Random(1)
    for _ in range(FLIPS):
        damaged = bytearray(whole)
        place = draw.randrange(8 * len(whole))
        damaged[place // 8] ^= 1 << place % 8
        file.write_bytes(damaged)
        curve, computed = ask()
        assert computed, f"bit {place}"
        assert np.allclose(curve, truth, rtol=1e-14, atol=0.0)  # text to number and back
    assert not ask()[1]  # the replacement is sound


@pytest.mark.filterwarnings("ignore:some results kept")
def test_what_is_cut_empty_or_anothers_is_computed_again(ask: Ask, tmp_path: Path) -> None:
    ask()
    (file,) = tmp_path.iterdir()
    whole = file.read_bytes()
    Store(tmp_path).put(["other"], "displacement_mm,force_N\n0,0\n1,1\n")
    others = (tmp_path / "other.txt").read_bytes()
    cuts = [whole[:length] for length in (0, 10, 64, 65, len(whole) // 2, len(whole) - 1)]
    for content in (*cuts, whole + b"0", others):
        file.write_bytes(content)
        assert ask()[1]
        assert not ask()[1]


def test_what_cannot_be_read_is_computed_again(ask: Ask, tmp_path: Path) -> None:
    """A folder of that name stands for a bad sector: reading it fails for every user."""
    ask()
    (file,) = tmp_path.iterdir()
    file.unlink()
    file.mkdir()
    with pytest.warns(UserWarning, match="kept in"):
        assert ask()[1]


def test_damage_is_told_once(ask: Ask, tmp_path: Path) -> None:
    ask()
    (file,) = tmp_path.iterdir()
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        for _ in range(3):
            file.write_bytes(b"")
            ask()
    assert [str(warning.message) for warning in told] == [
        f"some results kept in {tmp_path} are damaged and will be computed again"
    ]


def test_a_full_disk_costs_no_result(
    ask: Ask, truth: pd.DataFrame, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(_: int) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(store.os, "fsync", full)
    with pytest.warns(UserWarning, match=r"cannot be kept in .*: No space left"):
        curve, computed = ask()
    assert computed
    assert np.allclose(curve, truth, rtol=1e-14, atol=0.0)
    assert not list(tmp_path.iterdir())


class NewerPETSc:
    """Stand-in for `PETSc.Sys`, which cannot be changed."""

    @staticmethod
    def getVersion() -> tuple[int, int, int]:
        return 9, 9, 9


@pytest.fixture
def _fresh_provenance() -> Iterator[None]:
    yield
    provenance.libraries.cache_clear()
    provenance.source.cache_clear()


@pytest.mark.usefixtures("_fresh_provenance")
def test_a_key_depends_on_all_that_computes(
    coarse: rf.BendingTest, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def keys() -> tuple[str, str]:
        provenance.libraries.cache_clear()
        provenance.source.cache_clear()
        return Simulation(coarse).keys()[0], CurveTask(coarse).keys()[0]

    seen = {keys()}
    assert {keys()} == seen
    changes: list[tuple[object, str, object]] = [
        (dolfinx, "__version__", "9.9"),
        (gmsh, "__version__", "9.9"),
        (np, "__version__", "9.9"),
        (provenance.basix, "__version__", "9.9"),
        (provenance.ffcx, "__version__", "9.9"),
        (provenance.ufl, "__version__", "9.9"),
        (provenance, "PETSc", SimpleNamespace(Sys=NewerPETSc, Options=PETSc.Options)),
        (provenance.platform, "python_version", lambda: "9.9"),
        (provenance, "_shared", lambda: ["libdmumps-9.9.so 1"]),
        (provenance, "JIT_OPTIONS", {"cffi_extra_compile_args": ["-O0"]}),
    ]
    for thing, name, value in changes:
        with monkeypatch.context() as patch:
            patch.setattr(thing, name, value)
            seen.add(keys())
    options = PETSc.Options()
    options["ramiefenics_newton_ksp_rtol"] = 0.5
    seen.add(keys())
    options.delValue("ramiefenics_newton_ksp_rtol")
    monkeypatch.setattr(provenance, "SOLVER", ("specification", "model"))  # other source
    seen.add(keys())
    monkeypatch.undo()
    assert len({key for pair in seen for key in pair}) == 2 * (1 + len(changes) + 2)
    assert keys() in seen
    loaded = " ".join(provenance.libraries()["shared"])  # type: ignore[arg-type]
    assert "mumps" in loaded
    assert "blas" in loaded


@pytest.mark.parametrize("name", ["law.py", "law.c"])
@pytest.mark.usefixtures("_fresh_provenance")
def test_a_key_depends_on_what_is_written_in_python_and_in_c(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(provenance, "PACKAGE", tmp_path)
    file = tmp_path / "model" / name
    file.parent.mkdir()
    sources = set()
    for text in ("first", "second"):
        file.write_text(text)
        provenance.source.cache_clear()
        sources.add(provenance.source())
    assert len(sources) == 2


def test_a_key_is_the_same_in_every_process(coarse: rf.BendingTest, tmp_path: Path) -> None:
    """Other imports must not change it, because a parent looks for what its workers keep."""
    rf.write_test(coarse, tmp_path / "coarse.toml")
    script = (
        "import sys, json\n"
        "for name in sys.argv[2:]: __import__(name)\n"
        "import ramiefenics as rf\n"
        "from ramiefenics.runs.curve import CurveTask\n"
        "from ramiefenics.runs import Simulation\n"
        "test = rf.read_test(sys.argv[1])\n"
        "print(json.dumps([Simulation(test).keys(), CurveTask(test).keys()]))\n"
    )
    command = [sys.executable, "-c", script, str(tmp_path / "coarse.toml")]
    command += ["pyvista", "scipy.linalg"]  # these may load libraries of linear algebra
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    here = [list(task.keys()) for task in (Simulation(coarse), CurveTask(coarse))]
    assert json.loads(done.stdout) == here


def test_a_curve_kept_with_derivatives_serves_those_who_want_none(
    coarse: rf.BendingTest, truth: pd.DataFrame, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """They get the force without the derivatives."""
    used = factors(coarse)
    computed = []

    def compute(task: CurveTask) -> str:
        computed.append(task)
        slopes = {factor.name: truth["force_N"] for factor in task.factors}
        return truth.assign(**slopes).to_csv(index=False)

    monkeypatch.setattr(CurveTask, "compute", compute)
    with ThreadPoolExecutor(1) as pool:
        runs = Runs(tmp_path, pool)
        asked = [CurveTask(coarse, used, smooth=True), CurveTask(coarse, used), CurveTask(coarse)]
        curves = [runs.map([task])[0].result() for task in asked]
    assert len(computed) == 1
    names = [factor.name for factor in used]
    for task, curve in zip(asked, curves, strict=True):
        assert list(curve) == ["displacement_mm", "force_N", *(names if task.factors else [])]

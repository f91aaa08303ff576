"""Commands that are killed and run again, for `benchmarks/reliability.py`."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from mpi4py import MPI

import ramiefenics as rf
from ramiefenics.model.jit import CACHE

SEED, KILLS = 20261, 15  # at least so many kills of each job

COARSE = {
    "numerics.mesh": "ladder_q1_1",
    "numerics.mesh.angular_elements": 6,
    "numerics.mesh.wall_elements": 1,
    "numerics.mesh.contact_size": 0.02,
    "numerics.mesh.coarse_size": 0.045,
    "protocol.travel_mm": 3.0,
}

CALIBRATION = """
title = "Small"
baseline = "stalk.toml"
mesh = "ladder_q1_1"
model = "linear"
[design]
kind = "central_composite"
[[factors]]
name = "radius"
keys = ["fixture.indenter_radius_mm"]
low = 4.0
high = 6.0
[[factors]]
name = "friction"
keys = ["fixture.friction.dynamic"]
low = 0.05
high = 0.15
[[responses]]
name = "force_3mm_N"
target = 30.0
error = 1.0
"""


VALIDATION = """
title = "Small"
mesh = "ladder_q1_1"
response = "force_3mm_N"
model = "linear"
[design]
kind = "sobol"
runs = 8
[[factors]]
name = "friction"
keys = ["fixture.friction.dynamic"]
low = 0.05
high = 0.15
[[observations]]
name = "thick"
baseline = "stalk.toml"
measured = 30.0
error = 0.5
[[observations]]
name = "thin"
baseline = "thin.toml"
measured = 32.0
error = 1.0
[[splits]]
title = "thin from thick"
on = ["thick"]
"""

JOBS = {
    "bend": ("bend", "stalk.toml"),
    "validate": ("validate", "validation.toml"),
    "calibrate": ("calibrate", "study.toml"),
    "discover": ("discover", "data", "--suspect", "seating_gap", "--suspect", "load_scale"),
}


def coarse(**changes: Any) -> rf.BendingTest:
    """Return a test that takes a second to simulate."""
    return rf.override(rf.ramie(14.23, 7.28, 0.67), COARSE | changes)


@contextmanager
def desk() -> Iterator[tuple[Path, dict[str, str]]]:
    """Provide a folder with jobs, and an environment whose cache holds only compiled forms."""
    with tempfile.TemporaryDirectory() as name:
        place = Path(name)
        cache = place / "cache" / "ramiefenics"
        cache.mkdir(parents=True)
        (cache / "forms").symlink_to(CACHE)
        rf.write_test(coarse(), place / "stalk.toml")
        rf.write_test(coarse(**{"stalk.void_diameter_mm": 7.0}), place / "thin.toml")
        (place / "study.toml").write_text(CALIBRATION)
        (place / "validation.toml").write_text(VALIDATION)
        make_stalks(place)
        yield place, os.environ | {"XDG_CACHE_HOME": str(place / "cache"), "OMP_NUM_THREADS": "1"}


def make_stalks(place: Path) -> None:
    """Write a data set of three stalks with a seating gap."""
    (place / "data" / "curves").mkdir(parents=True)
    shutil.copy(place / "stalk.toml", place / "data")
    lines = ["specimen,curve,void"]
    rng = np.random.default_rng(SEED)
    for number, void in enumerate((7.0, 7.3, 7.6)):
        curve = rf.simulate(coarse(**{"stalk.void_diameter_mm": void}), comm=MPI.COMM_SELF).curve
        at = np.linspace(0.0, 3.0, 61)
        force = np.interp(at - 0.2, curve["displacement_mm"], curve["force_N"])
        force += 0.002 * force.max() * rng.standard_normal(len(at))
        measured = pd.DataFrame({"displacement_mm": at, "force_N": force})
        measured.to_csv(place / "data" / "curves" / f"{number}.csv", index=False)
        lines.append(f"{number},curves/{number}.csv,{void}")
    (place / "data" / "specimens.csv").write_text("\n".join(lines))
    (place / "data" / "dataset.toml").write_text(
        'baseline = "stalk.toml"\nmesh = "ladder_q1_1"\nfit = ["phloem.axial"]\n'
        '[specimens]\n"stalk.void_diameter_mm" = "void"\n'
    )


def kills() -> dict[str, Any]:
    """Kill commands at random moments, then run them to the end, and compare what they write."""
    rng, found = np.random.default_rng(SEED), {}
    for name, job in JOBS.items():
        with desk() as (place, environment):
            start = time.perf_counter()
            whole = tables(place, environment, job, "whole")
            wall = time.perf_counter() - start
        killed = different = partial = 0
        while killed < KILLS:
            with desk() as (place, environment):
                command = [sys.executable, "-m", "ramiefenics", *job, "--out", "out"]
                for _ in range(5):
                    process = subprocess.Popen(
                        command, cwd=place, env=environment, start_new_session=True,
                        stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
                    )  # fmt: skip
                    try:
                        process.wait(rng.uniform(0.5, wall))
                    except subprocess.TimeoutExpired:
                        killed += 1
                    with suppress(ProcessLookupError):  # all processes have ended
                        os.killpg(process.pid, signal.SIGKILL)
                    process.wait()
                    out = place / "out"
                    partial += out.exists() and not (out / ".written").exists()
                different += tables(place, environment, job, "out") != whole
        found[name] = {"kills": killed, "different": different, "half written": partial}
        print(name, found[name], flush=True)
    return found


def tables(
    place: Path, environment: dict[str, str], job: tuple[str, ...], out: str
) -> dict[str, str]:
    """Run a job to its end; return its tables and specifications by name."""
    command = [sys.executable, "-m", "ramiefenics", *job, "--out", out]
    subprocess.run(command, cwd=place, env=environment, check=True, capture_output=True)
    kinds = (path for kind in ("*.csv", "*.toml") for path in sorted((place / out).glob(kind)))
    return {path.name: path.read_text() for path in kinds}

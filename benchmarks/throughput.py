"""Simulations per minute: 64 stalks of different geometry and moduli, on all cores.

    ./run python benchmarks/throughput.py

Takes five minutes on two cores. Writes `records/throughput.json`.
"""

from __future__ import annotations

import os
import time
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context

import numpy as np
from record import WORKERS, write_record
from rich.progress import track
from scipy.stats import qmc

from ramiefenics import BendingTest, override, published_test, simulate

RUNS = 64
SPREAD = {
    "stalk.void_diameter_mm": 7.28,
    "stalk.layers.xylem.outer_diameter_mm": 12.84,
    "stalk.layers.phloem.outer_diameter_mm": 14.23,
    "stalk.layers.xylem.material.elastic.E_X_MPa": 7.67,
    "stalk.layers.xylem.material.elastic.E_Z_MPa": 320.0,
    "stalk.layers.phloem.material.elastic.E_Z_MPa": 1919.08,
    "stalk.layers.phloem.material.elastic.G_XZ_MPa": 33.8,
}
"""Middle of each varied value; lengths vary by 1 % and moduli by 20 % in either direction."""


def specifications() -> list[BendingTest]:
    """Return the tests, a Latin hypercube of the varied values."""
    base = override(
        published_test("table3"), ["numerics.mesh=screening", "numerics.acoustic_check=false"]
    )
    points = 2 * qmc.LatinHypercube(len(SPREAD), seed=1).random(RUNS) - 1
    widths = np.array([0.01 if key.endswith("_mm") else 0.2 for key in SPREAD])
    middles = np.array(list(SPREAD.values()))
    return [
        override(base, [f"{key}={value}" for key, value in zip(SPREAD, row, strict=True)])
        for row in middles * (1 + widths * points)
    ]


def run(test: BendingTest) -> tuple[float, float]:
    """Return a run's largest force, N, and CPU time, s."""
    from mpi4py import MPI

    start = time.process_time()
    force = simulate(test, MPI.COMM_SELF).max_force_N
    return force, time.process_time() - start


def main() -> None:
    """Run all tests, and record the cost."""
    os.environ["OMP_NUM_THREADS"] = "1"  # for the workers: one core each
    start = time.perf_counter()
    with ProcessPoolExecutor(WORKERS, mp_context=get_context("spawn")) as pool:
        results = list(track(pool.map(run, specifications()), "throughput", total=RUNS))
    wall = time.perf_counter() - start
    forces, cpu = zip(*results, strict=True)
    summary = {
        "runs": RUNS,
        "workers": WORKERS,
        "wall_s": wall,
        "runs_per_minute": 60.0 * RUNS / wall,
        "median_cpu_s": float(np.median(cpu)),
        "smallest_force_N": min(forces),
        "largest_force_N": max(forces),
    }
    write_record("throughput", summary)


if __name__ == "__main__":
    main()

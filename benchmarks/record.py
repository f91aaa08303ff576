"""Many simulations, two at a time, recorded one by one so that an interrupted study resumes."""

from __future__ import annotations

import json
import multiprocessing
import os
import time
import warnings
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from pathlib import Path
from typing import Any

import numpy as np
from rich.progress import track

from ramiefenics import BendingResult, BendingTest, SpecificationWarning, simulate

DOCS = Path(__file__).resolve().parents[1] / "docs"
WORKERS = 2


def run(test: BendingTest) -> dict[str, Any]:
    """Simulate, and return what the tables need."""
    from mpi4py import MPI

    warnings.simplefilter("ignore", SpecificationWarning)
    start = time.process_time()
    result = simulate(test, MPI.COMM_SELF)
    return row(result, time.process_time() - start)


def row(result: BendingResult, cpu_s: float) -> dict[str, Any]:
    """Return what the tables need of a run."""
    curve = result.curve
    travel = curve["displacement_mm"]
    return {
        **{
            f"force_{at}mm_N": float(np.interp(at, travel, curve["force_N"], right=np.nan))
            for at in (4, 8, 12, 14)
        },
        "max_force_N": result.max_force_N,
        "displacement_at_max_mm": result.displacement_at_max_mm,
        "has_force_maximum": result.has_force_maximum,
        "slope_N_per_mm": result.slope_N_per_mm,
        "ending": result.ending.kind,
        "reason": result.ending.reason,
        "reached_mm": float(travel.iloc[-1]),
        "dofs": result.statistics.dofs,
        "cells": result.statistics.cells,
        "newton_iterations": result.statistics.newton_iterations,
        "cut_backs": result.statistics.cut_backs,
        "jumps": len(result.jumps),
        "min_void_height_mm": float(curve["void_height_mm"].min()),
        "min_overhang_mm": float(curve["overhang_mm"].min()),
        "min_acoustic_MPa": float(curve["min_acoustic_MPa"].min()),
        "ellipticity_lost_at_mm": result.losses_mm.get("ellipticity"),
        "cpu_s": cpu_s,
    }


def run_all(
    name: str,
    cases: Mapping[str, BendingTest],
    work: Callable[[BendingTest], dict[str, Any]] = run,
) -> dict[str, dict[str, Any]]:
    """Simulate what `docs/NAME.json` does not hold yet; delete the file to start afresh.

    Parameters
    ----------
    name, cases
        Of the file; tests by label.
    work
        Simulates one; a function of a module.

    Returns
    -------
    dict
        Rows by label, in the order of the cases.
    """
    path = DOCS / f"{name}.json"
    record = json.loads(path.read_text()) if path.exists() else {}
    left = {label: test for label, test in cases.items() if label not in record}
    os.environ["OMP_NUM_THREADS"] = "1"  # for the workers: one core each
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(WORKERS, mp_context=context) as pool:
        jobs = {pool.submit(work, test): label for label, test in left.items()}
        try:
            for job in track(as_completed(jobs), name, total=len(jobs)):
                record[jobs[job]] = job.result()
                path.write_text(json.dumps(record, indent=1) + "\n")
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise
    return {label: record[label] for label in cases}


def table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Return a Markdown table."""
    lines = ["| " + " | ".join(head) + " |", "|---" * len(head) + "|"]
    return "\n".join(lines + ["| " + " | ".join(row) + " |" for row in rows]) + "\n"

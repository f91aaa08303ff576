"""Runs of many simulations, each kept under a key of its content so that studies can resume."""

from __future__ import annotations

import inspect
import json
import os
import time
import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from rich.progress import Progress

from ramiefenics import BendingResult, BendingTest, SpecificationWarning, simulate
from ramiefenics.runs import Runs, key_of
from ramiefenics.specification.files import to_dict

RECORDS = Path(__file__).resolve().parent / "records"
DOCS = RECORDS.parents[1] / "docs"
WORKERS = 2


def run(test: BendingTest) -> dict[str, Any]:
    """Simulate a test, and return what the tables need."""
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


@dataclass(frozen=True)
class Case:
    """Task that applies `work`, a function of the module `file`, to a test, and keeps the row."""

    test: BendingTest
    work: Callable[[BendingTest], dict[str, Any]]
    file: str

    def keys(self) -> tuple[str, ...]:
        """Return the key under which the row is kept."""
        content = [to_dict(self.test), self.work.__name__]
        return (key_of(content, __file__, self.file),)

    def compute(self) -> str:
        """Return the row as JSON."""
        return json.dumps(self.work(self.test))

    def read(self, text: str) -> dict[str, Any]:
        """Return the row that a text holds."""
        return dict(json.loads(text))


def run_all(
    name: str,
    cases: Mapping[str, BendingTest],
    work: Callable[[BendingTest], dict[str, Any]] = run,
) -> dict[str, dict[str, Any]]:
    """Simulate the cases that this version has not simulated yet, and record all in `NAME.json`.

    Parameters
    ----------
    name, cases
        Name of the file in `RECORDS`, whose other rows stay; tests by label.
    work
        Function of a module that simulates a test and returns its row.

    Returns
    -------
    dict
        Rows by label, in the order of the cases.
    """
    os.environ["OMP_NUM_THREADS"] = "1"  # for the workers: one core each
    with Progress() as progress:
        bar = progress.add_task(name, total=len(cases))
        runs = Runs(on_done=lambda number: progress.advance(bar, number))
        file = inspect.getfile(work)  # unknown to workers, if it is the script itself
        done = runs.map([Case(test, work, file) for test in cases.values()])
    rows = {label: one.result() for label, one in zip(cases, done, strict=True)}
    write_record(name, read_record(name) | rows)
    return rows


def read_record(name: str) -> dict[str, Any]:
    """Return the content of `NAME.json` in `RECORDS`, empty if there is no such file."""
    path = RECORDS / f"{name}.json"
    return dict(json.loads(path.read_text())) if path.exists() else {}


def write_record(name: str, record: Mapping[str, Any]) -> None:
    """Write `NAME.json` in `RECORDS`."""
    (RECORDS / f"{name}.json").write_text(json.dumps(record, indent=1) + "\n")


def table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Return a Markdown table."""
    lines = ["| " + " | ".join(head) + " |", "|---" * len(head) + "|"]
    return "\n".join(lines + ["| " + " | ".join(row) + " |" for row in rows]) + "\n"

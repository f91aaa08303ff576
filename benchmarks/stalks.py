"""Cost of a discovery against the number of stalks.

    ./run python benchmarks/stalks.py [--stalks 8 25 80 200 400]

Takes 75 minutes on two cores. Keeps finished cases in `records/stalks.json`, with the duration of
every simulation by round, and writes `docs/stalks.png`; `benchmarks/performance.py` reports the
results.

The forces are those of `ramiefenics.discovery.synthetic`. A few stalks are simulated on each of its
fine meshes and all on the recipe `screening`, whose forces are multiplied by the mean ratio of
the two meshes.
"""

from __future__ import annotations

import argparse
import heapq
import os
import tempfile
import time
import warnings
from collections.abc import Callable, Sequence
from concurrent.futures import Executor, Future, wait
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
import pandas as pd
from distributed import LocalCluster
from matplotlib.figure import Figure
from record import DOCS, WORKERS, read_record, write_record

from ramiefenics import SpecificationWarning, discover, ramie
from ramiefenics.discovery.curves.blocks import Array
from ramiefenics.discovery.curves.meshes import on_mesh
from ramiefenics.discovery.synthetic import Secret, make_dataset
from ramiefenics.effects import EFFECTS, SUSPECTS
from ramiefenics.results.style import BLUE, GREY, STYLE, VERMILION
from ramiefenics.runs import Runs, dask_workers, workers
from ramiefenics.runs.curve import CurveTask, Mapper, simulated
from ramiefenics.runs.executor import Done
from ramiefenics.specification import mesh_recipe

STALKS = (8, 25, 80, 200, 400)
FEW = 8  # stalks simulated on the fine mesh
HIDDEN, SEED = "machine_compliance", 710000
SIX = (
    "machine_compliance",
    "seating_gap",
    "pith_core",
    "taper",
    "fibre_damage",
    "stiffness_gradient",
)
TRIED = {"24 suspects": tuple(SUSPECTS), "six suspects": SIX}
MOST_WITH_SIX = 25  # stalks; with more, confirming takes nearly all time, whatever the suspects


class OnFineMesh(Mapper):
    """Stand-in for `Runs` that scales coarse curves to the fine mesh of a few of the stalks.

    Attributes
    ----------
    asked
        Number of tasks so far.
    """

    def __init__(self, runs: Runs) -> None:
        self._runs, self.asked = runs, 0

    def map(self, tasks: Sequence[CurveTask]) -> list[Done[pd.DataFrame]]:
        """Return curves on a coarse mesh, multiplied by the mean ratio of fine to coarse forces."""
        self.asked += len(tasks)
        coarse = mesh_recipe("screening")
        curves = simulated(self._runs, [CurveTask(on_mesh(task.test, coarse)) for task in tasks])
        at = np.linspace(0.5, tasks[0].test.protocol.travel_mm, 28)
        meshes = [task.test.numerics.mesh for task in tasks]
        for mesh in dict.fromkeys(meshes):
            there = [i for i, one in enumerate(meshes) if one == mesh]
            fine = simulated(self._runs, [tasks[i] for i in there[:FEW]])
            ratio = force(fine, at) / force([curves[i] for i in there[:FEW]], at)
            for i in there:
                curves[i]["force_N"] *= np.interp(curves[i]["displacement_mm"], at, ratio)
        return [Done(curve) for curve in curves]


def force(curves: Sequence[pd.DataFrame], at: Array) -> Array:
    """Return the sum of the forces of some curves at some displacements."""
    return np.sum([np.interp(at, c["displacement_mm"], c["force_N"]) for c in curves], axis=0)


class Timed(Executor):
    """Executor that records how long each task takes.

    Attributes
    ----------
    rounds
        Durations of the tasks, s, by round. A new round begins when a task is submitted while no
        other is left.
    """

    def __init__(self, pool: Executor) -> None:
        self._pool, self._left = pool, 0
        self.rounds: list[list[float]] = []

    def submit(self, function: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        """Submit a task."""
        if self._left == 0:
            self.rounds.append([])
        self._left += 1
        done: Future[Any] = Future()

        def finish(of: Future[Any]) -> None:
            self._left -= 1
            if (error := of.exception()) is not None:
                done.set_exception(error)
                return
            seconds, result = of.result()
            self.rounds[-1].append(round(seconds, 2))
            done.set_result(result)

        self._pool.submit(timed, function, *args, **kwargs).add_done_callback(finish)
        return done


def timed(function: Callable[..., Any], *args: Any, **kwargs: Any) -> tuple[float, Any]:
    """Return the duration of a call, s, and its result."""
    start = time.perf_counter()
    result = function(*args, **kwargs)
    return time.perf_counter() - start, result


def echo(task: CurveTask, text: str) -> str:
    """Return a text of the length that a simulation of the task would send back."""
    return text


def transport() -> dict[str, float]:
    """Return the time that a task takes in addition to its work, s, on two workers."""
    task, text, number = CurveTask(ramie(14.2, 7.3, 0.67)), "x" * 30_000, 400
    with (
        LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster,
        dask_workers(cluster.scheduler_address) as dask,
        workers(number=2) as local,
    ):
        found = {}
        for name, pool in (("processes", local), ("Dask", dask)):
            wait([pool.submit(echo, task, text) for _ in range(20)])  # so that imports are done
            start = time.perf_counter()
            wait([pool.submit(echo, task, text + str(n)) for n in range(number)])
            found[name] = (time.perf_counter() - start) / number
    return found


def predicted_s(row: dict[str, Any], cores: int, transport_s: float) -> float:
    """Return the wall time that a discovery would take on some number of cores, s.

    Whatever is not simulation takes as long as measured. The leading process sends the tasks of a
    round one after the other, each to whichever core is free first.
    """

    def makespan(seconds: list[float], cores: int, transport_s: float) -> float:
        free = [0.0] * min(cores, len(seconds))
        for number, own in enumerate(seconds, start=1):
            begun = max(heapq.heappop(free), number * transport_s)
            heapq.heappush(free, begun + own)
        return max(free)

    rounds = [seconds for seconds in row["rounds"] if seconds]
    serial = row["wall_s"] - sum(makespan(seconds, WORKERS, 0.0) for seconds in rounds)
    return max(serial, 0.0) + sum(makespan(seconds, cores, transport_s) for seconds in rounds)


def run(folder: Path, number: int, names: tuple[str, ...]) -> dict[str, Any]:
    """Run a discovery on the first stalks of a data set, without results from earlier runs."""
    whole = pd.read_csv(folder / "specimens.csv")
    try:
        whole.head(number).to_csv(folder / "specimens.csv", index=False)
        with tempfile.TemporaryDirectory() as kept, workers() as pool:
            start = time.perf_counter()
            noting = Timed(pool)
            runs = Runs(Path(kept), noting)
            found = discover(folder, {name: EFFECTS[name] for name in names}, runs=runs)
            wall = time.perf_counter() - start
    finally:
        whole.to_csv(folder / "specimens.csv", index=False)
    return {
        "stalks": number,
        "wall_s": wall,
        "curves": found.effort.curves,
        "simulations": found.effort.simulations,
        "computed": runs.computed,
        "learned_error": found.effort.learned_error,
        "verdict": found.verdict,
        "groups": found.groups,
        "rounds": noting.rounds,
    }


def picture(record: dict[str, dict[str, Any]]) -> Figure:
    """Draw time and simulations against the number of stalks."""
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(7.2, 3.2), layout="constrained")
        left, right = figure.subplots(1, 2)
        for (label, names), colour in zip(TRIED.items(), (BLUE, VERMILION), strict=True):
            rows = [row for key, row in record.items() if key.endswith(f"{len(names)} suspects")]
            table = pd.DataFrame(rows).sort_values("stalks")
            left.loglog(table["stalks"], table["wall_s"] / 60.0, "o-", color=colour, label=label)
            right.loglog(table["stalks"], table["computed"], "o-", color=colour)
            right.loglog(table["stalks"], table["curves"], ":", color=colour)
        right.plot([], [], "o-", color=GREY, label="simulated")
        right.plot([], [], ":", color=GREY, label="force curves asked for")
        for axes in (left, right):
            axes.set_xticks(STALKS, map(str, STALKS))
            axes.minorticks_off()
        minutes = (1, 2, 5, 10, 20, 50)
        left.set_yticks(minutes, map(str, minutes))
        left.set(xlabel="Stalks", ylabel="Wall time on two cores (min)")
        right.set(xlabel="Stalks", ylabel="Number")
        for axes in (left, right):  # above the axes, where there are no curves
            axes.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2, fontsize=8)
    return figure


def main() -> None:
    """Run the cases that are not recorded yet, then draw the figure."""
    warnings.simplefilter("ignore", SpecificationWarning)
    os.environ["OMP_NUM_THREADS"] = "1"  # for the workers: one core each
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--stalks", type=int, nargs="+", default=list(STALKS))
    numbers = parser.parse_args().stalks
    record = read_record("stalks")
    record["transport_s"] = record.get("transport_s") or transport()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name) / "data"
        secret = Secret(EFFECTS[HIDDEN], EFFECTS[HIDDEN].typical)
        with workers() as pool:
            make_dataset(folder, secret, SEED, OnFineMesh(Runs(executor=pool)), max(numbers))
        for number in numbers:
            for names in TRIED.values():
                if names is SIX and number > MOST_WITH_SIX:
                    continue
                label = f"{number} stalks, {len(names)} suspects"
                record[label] = record.get(label) or run(folder, number, names)
                write_record("stalks", record)
                print(label, {**record[label], "rounds": ...}, flush=True)
    picture(record).savefig(DOCS / "stalks.png")


if __name__ == "__main__":
    main()

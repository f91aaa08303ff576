"""Cost of large models: the first millimetre of travel with friction, solved by multigrid.

    ./run python benchmarks/growth.py

Takes twenty minutes on one core and up to 20 GB of memory. Keeps finished runs in
`records/growth.json`, and draws `docs/growth.png`.
"""

from __future__ import annotations

import json
import resource
import subprocess
import sys
import time
from typing import Any

import matplotlib as mpl
from matplotlib.figure import Figure
from record import DOCS, read_record, write_record

from ramiefenics import BendingTest, override, published_test, simulate
from ramiefenics.results.style import BLUE, STYLE

REFINEMENT = (1.0, 1.5, 2.25, 2.8, 3.3)
"""Refinement factors relative to the finest mesh of the first-order ladder."""


def model(factor: float) -> BendingTest:
    """Return the calibration stalk's test on a mesh refined by a factor in all directions."""
    mesh = {
        "angular_elements": 2 * round(16 * factor),
        "wall_elements": round(5 * factor),
        "rind_elements": round(2 * factor),
        "contact_size": 0.006 / factor,
        "coarse_size": 0.018 / factor,
    }
    settings = ["travel_mm=1", "save_every_mm=1"]
    return override(
        published_test("table3"),
        [
            "numerics.mesh=ladder_q1_5",
            *(f"numerics.mesh.{key}={value}" for key, value in mesh.items()),
            *(f"protocol.{setting}" for setting in settings),
            "numerics.stepping.linear_solver=iterative",
            "numerics.acoustic_check=false",
        ],
    )


def run(factor: float) -> dict[str, Any]:
    """Simulate in this process, and return the cost."""
    start = time.process_time()
    statistics = simulate(model(factor)).statistics
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
    return {
        "unknowns": statistics.dofs,
        "newton_iterations": statistics.newton_iterations,
        "linear_iterations": statistics.linear_iterations,
        "cpu_s": time.process_time() - start,
        "cpu_ms_per_unknown": 1e3 * (time.process_time() - start) / statistics.dofs,
        "memory_kB_per_unknown": memory / 1024 / statistics.dofs,
    }


def figure(rows: list[dict[str, Any]]) -> Figure:
    """Draw time and memory per unknown."""
    with mpl.rc_context(STYLE):
        drawing = Figure(figsize=(7.0, 3.2), layout="constrained")
        labels = (
            ("cpu_ms_per_unknown", "CPU time per unknown (ms)"),
            (
                "memory_kB_per_unknown",
                "Peak memory per unknown (kB)",
            ),
        )
        for axes, (key, label) in zip(drawing.subplots(1, 2), labels, strict=True):
            axes.semilogx([r["unknowns"] for r in rows], [r[key] for r in rows], "o-", color=BLUE)
            axes.set(xlabel="Unknowns", ylabel=label, ylim=(0, None))
        return drawing


def main() -> None:
    """Run each model in a process of its own, to measure its peak memory."""
    if len(sys.argv) > 1:
        print(json.dumps(run(float(sys.argv[1]))))
        return
    record = read_record("growth")
    for factor in REFINEMENT:
        if str(factor) not in record:
            command = [sys.executable, __file__, str(factor)]
            done = subprocess.run(command, check=True, capture_output=True, text=True)
            record[str(factor)] = json.loads(done.stdout.splitlines()[-1])
            write_record("growth", record)
    figure([record[str(factor)] for factor in REFINEMENT]).savefig(DOCS / "growth.png", dpi=200)


if __name__ == "__main__":
    main()

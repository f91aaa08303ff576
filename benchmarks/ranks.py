"""Wall time of the calibration stalk on the fine recipe, on one rank and on two.

    ./run python benchmarks/ranks.py

Takes five minutes on two idle cores. Writes `records/ranks.json`.
"""

from __future__ import annotations

import os
import statistics
import subprocess
import sys

from record import write_record

PAIRS = 3

PROGRAM = """
import ramiefenics as rf
result = rf.simulate(rf.override(rf.published_test("table3"), ["numerics.mesh=fine"]))
if result.snapshots:
    print(result.statistics.wall_s, result.max_force_N)
"""


def run(ranks: int) -> tuple[float, float]:
    """Return wall time, s, and largest force, N, on some ranks."""
    command = ["mpirun", "-n", str(ranks), sys.executable, "-c", PROGRAM]
    environment = os.environ | {"OMP_NUM_THREADS": "1"}
    done = subprocess.run(command, check=True, capture_output=True, text=True, env=environment)
    wall, force = done.stdout.split()
    return float(wall), float(force)


def main() -> None:
    """Run on one rank and on two in turn, and record the medians."""
    runs = [(run(1), run(2)) for _ in range(PAIRS)]
    one, two = (statistics.median(pair[i][0] for pair in runs) for i in (0, 1))
    summary = {
        "one_rank_s": one,
        "two_ranks_s": two,
        "speedup": one / two,
        "force_difference": abs(runs[0][1][1] / runs[0][0][1] - 1),
    }
    write_record("ranks", summary)


if __name__ == "__main__":
    main()

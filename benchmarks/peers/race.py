"""User CPU time of three codes for the same problem on the same mesh, as whole processes in turn.

    python3 benchmarks/peers/race.py MESH.msh... --felupe PYTHON

Needs FElupe 11.3 with pypardiso in `PYTHON`, the interpreter of a virtual environment on top of
that of `./run`, and CalculiX 2.20 as `ccx` on the PATH. The script itself needs no packages. Keeps
finished races in `records/race.json`.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
RECORDS = HERE.parent / "records"
PAIRS = 3


def user_seconds(command: list[str], cwd: str) -> float:
    """Run a command to its end on one thread; return the user CPU time of it and its children."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
    environment = os.environ | {"OMP_NUM_THREADS": "1", "MKL_NUM_THREADS": "1"}
    subprocess.run(command, check=True, cwd=cwd, env=environment, stdout=subprocess.DEVNULL)
    return resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before


def forces(path: Path) -> dict[str, float]:
    """Return the forces at 4, 8 and 14 mm, interpolated linearly between steps."""
    lines = path.read_text().splitlines()[1:]
    rows = [tuple(map(float, line.split(","))) for line in lines]
    return {f"force_{at}mm_N": between(rows, at) for at in (4, 8, 14)}


def between(rows: list[tuple[float, ...]], at: float) -> float:
    """Return the force at a travel within the range of the rows."""
    end = next(k for k, (travel, _) in enumerate(rows) if travel > at - 1e-6)
    (x0, y0), (x1, y1) = rows[max(end - 1, 0)], rows[end]
    return y0 + (y1 - y0) * (at - x0) / (x1 - x0)


def race(mesh: Path, friction: float, pythons: dict[str, list[str]]) -> dict[str, Any]:
    """Run all codes in turn, several times."""
    result: dict[str, Any] = {}
    times: dict[str, list[float]] = {name: [] for name in pythons}
    with tempfile.TemporaryDirectory() as folder:
        for turn in range(PAIRS + 1):
            for name, python in pythons.items():
                if turn == 0 and name != "ramiefenics":
                    continue  # the first turn is for compilation, which only ramiefenics needs
                out = Path(folder) / f"{name}.csv"
                script = str(HERE / f"{name}_bend.py")
                command = [*python, script, str(mesh), "--friction", str(friction)]
                spent = user_seconds([*command, "--out", str(out)], folder)
                if turn:
                    times[name].append(spent)
                result[name] = forces(out)
    for name, values in times.items():
        median = statistics.median(values)
        result[name] |= {"user_s": values, "median_s": median}
        result[name]["over_ours"] = median / statistics.median(times["ramiefenics"])
    return result


def main() -> None:
    """Race on every mesh given, without and with friction."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("meshes", nargs="+", type=Path)
    parser.add_argument("--felupe", required=True, help="a Python that has FElupe")
    parser.add_argument("--friction", nargs="+", type=float, default=[0.0, 0.12])
    arguments = parser.parse_args()
    pythons = {
        "ramiefenics": [str(ROOT / "run"), "python"],
        "felupe": [str(ROOT / "run"), arguments.felupe],
        "calculix": [sys.executable],
    }
    path = RECORDS / "race.json"
    record = json.loads(path.read_text()) if path.exists() else {}
    for mesh in arguments.meshes:
        for friction in arguments.friction:
            label = f"{mesh.stem} friction {friction:g}"
            if label not in record:
                record[label] = race(mesh.resolve(), friction, pythons)
                path.write_text(json.dumps(record, indent=1) + "\n")


if __name__ == "__main__":
    main()

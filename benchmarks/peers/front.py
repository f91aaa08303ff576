"""Error against time of FElupe's hexahedra, for the calibration stalk with the default law.

    ./run python benchmarks/peers/front.py --felupe PYTHON

`PYTHON` is as for `race.py`, with tensortrax in addition. Takes three minutes on one core. Keeps
finished runs in `records/felupe_front.json`; `performance.py` draws them.
"""

from __future__ import annotations

import argparse
import csv
import json
import os
import resource
import subprocess
import tempfile
import warnings
from pathlib import Path
from typing import Any

import gmsh

from ramiefenics import SpecificationWarning, override, published_test
from ramiefenics.model.laws import LAWS
from ramiefenics.model.tube import write_tube

HERE = Path(__file__).resolve().parent
RECORDS = HERE.parent / "records"
RECIPES = ("ladder_q1_1", "ladder_q1_2", "ladder_q1_3")


def run(recipe: str, python: str) -> dict[str, Any]:
    """Write mesh and parameters, have FElupe bend the stalk, and return forces and cost."""
    warnings.simplefilter("ignore", SpecificationWarning)
    test = override(published_test("table3"), [f"numerics.mesh={recipe}"])
    parameters = [LAWS[test.law].parameters(layer.material) for layer in test.stalk.layers]
    with tempfile.TemporaryDirectory() as name:
        mesh, numbers, out = (Path(name) / part for part in ("tube.msh", "law.json", "forces.csv"))
        gmsh.initialize()
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.option.setNumber("Mesh.MshFileVersion", 2.2)
        write_tube(test, mesh)
        gmsh.finalize()
        numbers.write_text(json.dumps(parameters))
        before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
        command = [python, str(HERE / "felupe_ramie.py"), str(mesh), str(numbers)]
        single = os.environ | {"OMP_NUM_THREADS": "1", "MKL_NUM_THREADS": "1"}
        subprocess.run([*command, "--out", str(out)], check=True, env=single, capture_output=True)
        spent = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before
        with out.open() as stream:
            forces = {
                float(r["displacement_mm"]): float(r["force_N"]) for r in csv.DictReader(stream)
            }
    kept = {f"force_{at}mm_N": forces[at] for at in (4, 8, 12, 14)}
    return {**kept, "max_force_N": max(forces.values()), "cpu_s": spent}


def main() -> None:
    """Run the meshes that are not recorded yet."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--felupe", required=True, help="a Python that has FElupe and tensortrax")
    arguments = parser.parse_args()
    path = RECORDS / "felupe_front.json"
    record = json.loads(path.read_text()) if path.exists() else {}
    for recipe in RECIPES:
        if recipe not in record:
            record[recipe] = run(recipe, arguments.felupe)
            path.write_text(json.dumps(record, indent=1) + "\n")


if __name__ == "__main__":
    main()

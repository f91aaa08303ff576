"""Errors of the mesh recipes on four specimens of different size, against a finer mesh of each.

    ./run python benchmarks/recipes.py

Takes an hour on two cores. Keeps every finished run, and records all in `records/recipes.json`.
Writes the table in `meshes/README.md`, and `meshes/errors.csv`, from which a result reports the
error of its mesh.
"""

from __future__ import annotations

import csv
import re
import time
import warnings
from dataclasses import dataclass
from typing import Any

import numpy as np
from record import DOCS, run_all, table

from ramiefenics import (
    BendingTest,
    Elastic,
    Fixture,
    Layer,
    Material,
    Protocol,
    SpecificationWarning,
    Stalk,
    mesh_recipe,
    override,
    published_test,
    simulate,
)
from ramiefenics.discovery.curves.meshes import finer, on_mesh

RECIPES = ("screening", "standard", "fine")
SHARES = (2, 4, 8, 14)
"""Displacements compared, in fourteenths of the travel."""


@dataclass(frozen=True)
class Specimen:
    """A specimen and its test.

    Attributes
    ----------
    words
        Description in the table.
    test
        Specification with the whole travel.
    """

    words: str
    test: BendingTest


def _specimen(words: str, stalk: Stalk, fixture: Fixture, travel_mm: float) -> Specimen:
    protocol = Protocol(travel_mm=travel_mm, save_every_mm=travel_mm)
    return Specimen(words, BendingTest(stalk, fixture, protocol=protocol))


def _tissue(outer_mm: float, elastic: Elastic) -> tuple[Layer]:
    return (Layer("tissue", outer_mm, Material(elastic, density_g_per_cm3=1.0)),)


ROOT = Elastic(E_X_MPa=16.0, E_Z_MPa=180.0, nu_XY=0.3, nu_XZ=0.03, G_XZ_MPa=18.0)
CULM = Elastic(E_X_MPa=900.0, E_Z_MPa=12000.0, nu_XY=0.3, nu_XZ=0.02, G_XZ_MPa=700.0)
SPECIMENS = {
    "root": _specimen(
        "solid root, 5.0 x 4.7 mm, span 17.5, radii 2.5",
        Stalk(26.0, 0.0, _tissue(5.0, ROOT), section_height_mm=4.7),
        Fixture(span_mm=17.5, indenter_radius_mm=2.5, support_radius_mm=2.5),
        2.4,
    ),
    "thin root": _specimen(
        "solid root, 3 mm, span 17.5, radii 2.5",
        Stalk(26.0, 0.0, _tissue(3.0, ROOT)),
        Fixture(span_mm=17.5, indenter_radius_mm=2.5, support_radius_mm=2.5),
        2.4,
    ),
    "stalk": Specimen("calibration stalk, 14.2 mm, span 100, radii 5", published_test("table3")),
    "culm": _specimen(
        "culm, 60 mm, wall 8, span 500, radii 25",
        Stalk(640.0, 44.0, _tissue(60.0, CULM)),
        Fixture(span_mm=500.0, indenter_radius_mm=25.0, support_radius_mm=25.0),
        50.0,
    ),
}


def cases() -> dict[str, BendingTest]:
    """Return the tests of every specimen on every recipe and on a finer mesh, by label."""
    found = {}
    for name, specimen in SPECIMENS.items():
        travel = specimen.test.protocol.travel_mm
        test = override(  # steps whose error is far below that of the meshes
            specimen.test,
            [
                "numerics.acoustic_check=false",
                "numerics.stepping.force_tolerance=0.0005",
                f"numerics.stepping.max_step_mm={travel / 20.0}",
                f"numerics.stepping.first_step_mm={travel / 40.0}",
            ],
        )
        for recipe in RECIPES:
            found[f"{name}, {recipe}"] = on_mesh(test, mesh_recipe(recipe))
        found[f"{name}, finer"] = on_mesh(test, finer(mesh_recipe("fine")))
    return found


def run(test: BendingTest) -> dict[str, Any]:
    """Simulate a test, and return what the table needs."""
    from mpi4py import MPI

    warnings.simplefilter("ignore", SpecificationWarning)
    start = time.process_time()
    result = simulate(test, MPI.COMM_SELF)
    curve = result.curve
    at = np.array(SHARES) / 14.0 * test.protocol.travel_mm
    forces = np.interp(at, curve["displacement_mm"], curve["force_N"], right=np.nan)
    return {
        "forces_N": forces.tolist(),
        "max_force_N": result.max_force_N,
        "ending": result.ending.reason or result.ending.kind,
        "dofs": result.statistics.dofs,
        "cpu_s": time.process_time() - start,
    }


def main() -> None:
    """Run the cases that are not kept yet, then write the table and the file of errors."""
    warnings.simplefilter("ignore", SpecificationWarning)
    tests = cases()
    rows = run_all("recipes", dict(reversed(tests.items())), run)  # the longest first
    lines, worst = [], dict.fromkeys(RECIPES, 0.0)
    for name, specimen in SPECIMENS.items():
        best = rows[f"{name}, finer"]
        for recipe in RECIPES:
            row = rows[f"{name}, {recipe}"]
            error = row["max_force_N"] / best["max_force_N"] - 1.0
            worst[recipe] = max(worst[recipe], abs(error))
            parts = np.array(row["forces_N"]) / best["forces_N"] - 1.0
            cells = [f"{100.0 * e:+.1f} %" for e in (error, *parts)]
            lines.append([specimen.words, f"`{recipe}`", *cells, f"{row['cpu_s']:.0f}"])
        cells = [f"{v:.4g} N" for v in (best["max_force_N"], *best["forces_N"])]
        lines.append(["", "finer", *cells, f"{best['cpu_s']:.0f}"])
    head = ["", "recipe", "maximum", *(f"F at {s}/14" for s in SHARES), "CPU (s)"]
    path = DOCS.parent / "meshes" / "README.md"
    marks = r"(<!-- made by benchmarks/recipes.py -->\n).*?(<!-- end -->)"
    text = re.sub(marks, rf"\g<1>{table(head, lines)}\g<2>", path.read_text(), flags=re.DOTALL)
    path.write_text(text)
    with (path.parent / "errors.csv").open("w", newline="") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(["recipe", "max_force_error"])
        writer.writerows([name, f"{error:.3f}"] for name, error in worst.items())


if __name__ == "__main__":
    main()

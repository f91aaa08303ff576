"""Bend a stalk with FElupe: the default law, on a mesh of `ramiefenics mesh`.

Usage: python felupe_ramie.py MESH.msh PARAMETERS.json [--friction MU] [--out forces.csv]

As felupe_bend.py, but for the law, which tensortrax differentiates, and for the steps: of 0.25 mm,
as longer ones do not converge. The mesh is in Gmsh's format 2.2; the parameters are those of the
law, by layer.
"""

import argparse
import csv
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import felupe as fem
import felupe_bend
import numpy as np
import tensortrax.math as tm
from felupe_bend import Model, displacement

OUTER, SYMMETRY_X, SYMMETRY_Z = 101, 104, 105
STEP, END = 0.25, 14.0  # mm


def energy(C: Any, p: Mapping[str, float]) -> Any:
    """Return the stored energy of the law `saturating_fibre` without damage."""
    J = tm.sqrt(tm.linalg.det(C))
    log_j = tm.log(J)
    area = C[0, 0] * C[1, 1] - C[0, 1] * C[1, 0]
    stretch = tm.sqrt(C[2, 2])
    e = stretch - 1 + p["r"] * (log_j - tm.log(stretch))
    distortion = tm.trace(C) - 3 - 2 * log_j
    q = C[2, 2] * area / J**2 - 1
    yielded = p["gamma_Y"] ** 2
    shear = p["R"] * q + (1 - p["R"]) * 2 * yielded * (tm.sqrt(1 + q / yielded) - 1)
    drop = p["k"] - p["h"]
    size = tm.sqrt(e**2 + 1e-16)
    x = drop * size / p["s_c"]
    log_cosh = x + tm.log((1 + tm.exp(-2 * x)) / 2)
    compressed = p["h"] / 2 * e**2 + p["s_c"] ** 2 / drop * log_cosh
    return (
        p["mu"] / 2 * distortion
        + p["lambda"] / 2 * log_j**2
        + p["d"] / 24 * (2 * p["mu"] + p["lambda"]) * (log_j**4 + distortion**2 / 4)
        + tm.if_else(e >= 0, p["k"] / 2 * e**2, compressed)
        + p["shear_XZ"] / 2 * shear
    )


def stalk(mesh: Path, parameters: list[dict[str, float]], friction: float) -> Model:
    """Return the model of the tube with other materials and surface tags."""
    felupe_bend.OUTER, felupe_bend.SYMMETRY_X = OUTER, SYMMETRY_X
    felupe_bend.SYMMETRY_Z = SYMMETRY_Z
    model = Model(mesh, friction)
    points, volumes, _ = felupe_bend.read_mesh(mesh)
    points = np.vstack([points, model.field.region.mesh.points[-2:]])
    bodies = [
        fem.SolidBody(
            fem.Hyperelastic(energy, p=parameters[tag - 1]), displacement(points, volumes[tag])
        )
        for tag in sorted(volumes)
    ]
    model.items = [*bodies, *(item for item in model.items if not isinstance(item, fem.SolidBody))]
    return model


def bend(model: Model) -> list[tuple[float, float]]:
    """Depth of the indenter and its force after each step."""
    before = now = model.field[0].values.copy()
    forces = []
    for number in range(1, round(END / STEP) + 1):
        guess = 2 * now - before if number > 2 else now
        before = now
        now, force, iterations = model.push(number * STEP, guess)
        forces.append((number * STEP, force))
        print(f"{number * STEP:5.2f} mm  {force:9.4f} N  {iterations} iterations", flush=True)
    return forces


def main() -> None:
    """Run from the command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("mesh", type=Path)
    parser.add_argument("parameters", type=Path)
    parser.add_argument("--friction", type=float, default=0.12)
    parser.add_argument("--out", type=Path, default=Path("forces.csv"))
    options = parser.parse_args()
    forces = bend(stalk(options.mesh, json.loads(options.parameters.read_text()), options.friction))
    with options.out.open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(["displacement_mm", "force_N"])
        writer.writerows((f"{depth:g}", f"{force:.5f}") for depth, force in forces)


if __name__ == "__main__":
    main()

"""Bend a stalk with FElupe, with the default law on a mesh of `ramiefenics mesh`.

Usage: python felupe_ramie.py MESH.msh PARAMETERS.json [--friction MU] [--out forces.csv]

As felupe_bend.py, except for the law, which tensortrax differentiates, and the steps of 0.25 mm,
because longer ones do not converge. The mesh is in Gmsh's format 2.2; the parameters are those of
the law, by layer.
"""

import argparse
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import felupe as fem
import tensortrax.math as tm
from felupe_bend import Model, bend, write

SURFACES = (101, 104, 105)  # tags of the same surfaces as in felupe_bend
STEP = 0.25  # mm


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


def main() -> None:
    """Run from the command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("mesh", type=Path)
    parser.add_argument("parameters", type=Path)
    parser.add_argument("--friction", type=float, default=0.12)
    parser.add_argument("--out", type=Path, default=Path("forces.csv"))
    options = parser.parse_args()
    layers = json.loads(options.parameters.read_text())

    def material(tag: int) -> fem.Hyperelastic:
        return fem.Hyperelastic(energy, p=layers[tag - 1])

    write(bend(Model(options.mesh, options.friction, material, SURFACES), STEP), options.out)


if __name__ == "__main__":
    main()

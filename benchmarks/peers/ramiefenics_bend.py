"""The isotropic contact problem of the race, solved by ramiefenics.

python ramiefenics_bend.py MESH.msh [--friction MU] [--out forces.csv]
"""

from __future__ import annotations

import argparse

from mpi4py import MPI

from ramiefenics import BendingTest, Elastic, Layer, Material, Stalk, override, simulate
from ramiefenics.model.tube import read_tube

TAGS = {11: "outer", 12: "inner", 13: "symmetry_x", 14: "symmetry_z", 15: "ends"}


def problem(friction: float) -> BendingTest:
    """Return the specification of the problem."""
    xylem, phloem = (Material(Elastic(E, E, 0.3, 0.3, E / 2.6)) for E in (30.0, 120.0))
    layers = (Layer("xylem", 12.84, xylem), Layer("phloem", 14.23, phloem))
    return override(
        BendingTest(Stalk(180.0, 7.28, layers), law="isotropic"),
        [
            f"fixture.friction.static={friction}",
            f"fixture.friction.dynamic={friction}",
            "protocol.save_every_mm=14",
            "numerics.acoustic_check=false",  # the other codes have no such check
        ],
    )


def main() -> None:
    """Run from the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("mesh")
    parser.add_argument("--friction", type=float, default=0.0)
    parser.add_argument("--out", default="forces.csv")
    arguments = parser.parse_args()
    tube = read_tube(arguments.mesh, MPI.COMM_SELF, TAGS)
    curve = simulate(problem(arguments.friction), MPI.COMM_SELF, tube=tube).curve
    curve[["displacement_mm", "force_N"]].to_csv(arguments.out, index=False)


if __name__ == "__main__":
    main()

"""The isotropic contact problem of the race, by this code.

python ramiefenics_bend.py MESH.msh [--friction MU] [--void MM] [--radius MM] [--travel MM]
       [--out forces.csv]
"""

from __future__ import annotations

import argparse

from mpi4py import MPI

from ramiefenics import BendingTest, Elastic, Layer, Material, Stalk, override, simulate
from ramiefenics.model.tube import read_tube

TAGS = {11: "outer", 12: "inner", 13: "symmetry_x", 14: "symmetry_z", 15: "ends"}


def problem(
    friction: float, void: float = 7.28, radius: float = 5.0, travel: float = 14.0
) -> BendingTest:
    """Return the specification."""
    xylem, phloem = (Material(Elastic(E, E, 0.3, 0.3, E / 2.6)) for E in (30.0, 120.0))
    layers = (Layer("xylem", 12.84, xylem), Layer("phloem", 14.23, phloem))
    return override(
        BendingTest(Stalk(180.0, void, layers), law="isotropic"),
        [
            f"fixture.friction.static={friction}",
            f"fixture.friction.dynamic={friction}",
            f"fixture.indenter_radius_mm={radius}",
            f"fixture.support_radius_mm={radius}",
            f"protocol.travel_mm={travel}",
            f"protocol.save_every_mm={travel}",
            "numerics.acoustic_check=false",  # the peers have none
        ],
    )


def main() -> None:
    """Run."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("mesh")
    parser.add_argument("--friction", type=float, default=0.0)
    parser.add_argument("--void", type=float, default=7.28, help="its diameter, mm")
    parser.add_argument("--radius", type=float, default=5.0, help="of the cylinders, mm")
    parser.add_argument("--travel", type=float, default=14.0, help="mm")
    parser.add_argument("--out", default="forces.csv")
    arguments = parser.parse_args()
    tube = read_tube(arguments.mesh, MPI.COMM_SELF, TAGS)
    test = problem(arguments.friction, arguments.void, arguments.radius, arguments.travel)
    curve = simulate(test, MPI.COMM_SELF, tube=tube).curve
    curve[["displacement_mm", "force_N"]].to_csv(arguments.out, index=False)


if __name__ == "__main__":
    main()

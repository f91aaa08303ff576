"""Layered tubes on a mesh from a file against other codes."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import ufl
from dolfinx import fem
from mpi4py import MPI

from ramiefenics import BendingTest, Elastic, Layer, Material, Stalk, override, simulate
from ramiefenics.model.jit import compile_form
from ramiefenics.model.solid import Solid
from ramiefenics.model.tube import SURFACES, read_tube
from ramiefenics.solve.newton import Newton

pytestmark = pytest.mark.filterwarnings("ignore:G_XY_MPa")

DATA = Path(__file__).parent / "data" / "reference"


TAGS = {11: "outer", 12: "inner", 13: "symmetry_x", 14: "symmetry_z", 15: "ends"}


def test_pinned_tube() -> None:
    """St. Venant-Kirchhoff, no contact: three codes agree to seven digits."""
    tube = read_tube(DATA / "tube_L1.msh", MPI.COMM_SELF, TAGS)
    xylem = Material(Elastic(7.67, 320.0, 0.32, 0.04, 69.0, G_XY_MPa=2.95))
    phloem = Material(Elastic(2.27, 1919.08, 0.29, 0.004, 33.8))
    solid = Solid(tube.mesh, tube.cells, [xylem, phloem], "svk")
    u, v = solid.displacement, ufl.TestFunction(solid.space)
    du = ufl.TrialFunction(solid.space)
    vertical = solid.space.sub(1)
    at = [
        fem.locate_dofs_geometrical(
            (vertical, vertical.collapse()[0]), lambda x, z=z: np.isclose(x[2], z)
        )[0]
        for z in (0.0, 50.0)
    ]
    pushed = fem.Constant(tube.mesh, 0.0)
    bcs = [
        solid.symmetry(tube.facets.find(SURFACES["symmetry_x"]), 0),
        solid.symmetry(tube.facets.find(SURFACES["symmetry_z"]), 2),
        fem.dirichletbc(pushed, at[0], vertical),
        fem.dirichletbc(np.array(0.0), at[1], vertical),
    ]
    weak = ufl.derivative(solid.energy(), u, v)
    residual = compile_form(weak)
    newton = Newton(residual, compile_form(ufl.derivative(weak, u, du)), u, bcs, 20)
    reference = pd.read_csv(DATA / "pinned_svk_L1.csv")
    previous = 0.0
    for d in np.arange(0.25, 2.51, 0.25):
        u.x.array[:] *= d / previous if previous else 1.0  # linear prediction
        u.x.array[at[0]] = -d
        pushed.value = -d
        previous = d
        assert newton.solve(1e-9, largest_update_mm=10.0).converged
        force = fem.assemble_vector(residual).array
        published = reference.loc[np.isclose(reference["displacement_mm"], d), "force_N"]
        for value in published:
            # printed with five decimals
            assert -4.0 * force[at[0]].sum() == pytest.approx(value, abs=1.5e-5)


def test_pressed_tube() -> None:
    """Isotropic layers between cylinders, without friction, to 6 mm of travel.

    FElupe (penalty) and Kratos (mortar) agree within 1.1 %.
    """
    tube = read_tube(DATA / "tube_L1.msh", MPI.COMM_SELF, TAGS)
    xylem, phloem = (Material(Elastic(E, E, 0.3, 0.3, E / 2.6)) for E in (30.0, 120.0))
    layers = (Layer("xylem", 12.84, xylem), Layer("phloem", 14.23, phloem))
    test = override(
        BendingTest(Stalk(180.0, 7.28, layers), law="isotropic"),
        ["protocol.travel_mm=6", "fixture.friction.static=0", "fixture.friction.dynamic=0"],
    )
    curve = simulate(test, MPI.COMM_SELF, tube=tube).curve
    reference = pd.read_csv(DATA / "contact_neohooke_L1.csv").query("4 <= displacement_mm <= 6")
    # the others give the support's force, which ground springs of theirs lower
    reference = reference[reference["code"].str.contains("FElupe|Kratos")]
    assert len(reference) == 5
    force = np.interp(reference["displacement_mm"], curve["displacement_mm"], curve["force_N"])
    assert force == pytest.approx(reference["force_N"].to_numpy(), rel=0.02)

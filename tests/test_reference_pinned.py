"""The layered St. Venant-Kirchhoff tube against three other codes, to seven digits."""

from __future__ import annotations

from pathlib import Path

import gmsh
import numpy as np
import pandas as pd
import pytest
import ufl
from dolfinx import fem
from mpi4py import MPI

from ramiefenics import Elastic, Material
from ramiefenics.model.compat import mesh_from_gmsh
from ramiefenics.model.jit import compile_form
from ramiefenics.model.solid import Solid
from ramiefenics.model.tube import TubeMesh
from ramiefenics.solve.newton import Newton

pytestmark = pytest.mark.filterwarnings("ignore:G_XY_MPa")

DATA = Path(__file__).parent / "data" / "reference"


def _read() -> TubeMesh:
    gmsh.initialize(interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.open(str(DATA / "tube_L1.msh"))
        return TubeMesh(*mesh_from_gmsh(gmsh.model, MPI.COMM_SELF))
    finally:
        gmsh.finalize()


def test_pinned_tube() -> None:
    tube = _read()
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
        solid.symmetry(tube.facets.find(13), 0),
        solid.symmetry(tube.facets.find(14), 2),
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

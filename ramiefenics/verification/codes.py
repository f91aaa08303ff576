"""Layered tubes on a mesh from a file, compared with other codes."""

from __future__ import annotations

import warnings

import numpy as np
import pandas as pd
from dolfinx import fem
from mpi4py import MPI

from ramiefenics.model.solid import Solid
from ramiefenics.model.tube import SURFACES, TubeMesh, read_tube
from ramiefenics.solve.simulate import simulate
from ramiefenics.specification import (
    BendingTest,
    Elastic,
    Layer,
    Material,
    SpecificationWarning,
    Stalk,
    override,
)
from ramiefenics.verification.block import BoundaryValueProblem
from ramiefenics.verification.study import DATA, Array, Plot, Series, Study, at_least, at_most

TAGS = {11: "outer", 12: "inner", 13: "symmetry_x", 14: "symmetry_z", 15: "ends"}

VOID_MM, XYLEM_MM = 7.28, 12.84
"""Diameters of the void and of the xylem in the mesh."""

PINNED_TO_MM, PINNED_STEP_MM = 2.5, 0.25

GROUND_SPRINGS = {"CalculiX": 0.06, "GetFEM": 0.06}
"""Stiffness of soft springs to the ground in the models of other codes, N/mm.

They take a part of the supports' force, which is what these codes report. Their force is added here
to obtain that of the indenter.
"""

CLOSED_VOID_MM, CLOSED_RADIUS_MM, CLOSED_TRAVEL_MM = 11.0, 15.0, 12.0
"""Diameter of the void, radius of the cylinders, and travel, for the tube whose void closes."""

AGREE_FROM_MM = 4.0
"""Travel from which the other codes agree within 1.5 %.

Before it, the differences between their contact discretisations show.
"""


def tube() -> TubeMesh:
    """Read the mesh that all codes use."""
    return read_tube(DATA / "tube_L1.msh", MPI.COMM_SELF, TAGS)


def isotropic(void_mm: float) -> BendingTest:
    """Return a frictionless test of a tube of isotropic layers."""
    xylem, phloem = (Material(Elastic.isotropic(E, 0.3)) for E in (30.0, 120.0))
    layers = (Layer("xylem", XYLEM_MM, xylem), Layer("phloem", 14.23, phloem))
    frictionless = ["fixture.friction.static=0", "fixture.friction.dynamic=0"]
    return override(BendingTest(Stalk(180.0, void_mm, layers), law="isotropic"), frictionless)


def pinned_forces() -> dict[float, float]:
    """Return the force, N, by displacement, mm, of a tube pushed and held at whole sections."""
    mesh = tube()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SpecificationWarning)
        xylem = Material(Elastic(7.67, 320.0, 0.32, 0.04, 69.0, G_XY_MPa=2.95))
    phloem = Material(Elastic(2.27, 1919.08, 0.29, 0.004, 33.8))
    solid = Solid(mesh.mesh, mesh.cells, [xylem, phloem], "svk")
    vertical = solid.space.sub(1)
    scalar, _ = vertical.collapse()
    at = [
        fem.locate_dofs_geometrical((vertical, scalar), lambda x, z=z: np.isclose(x[2], z))
        for z in (0.0, 50.0)
    ]
    pushed = fem.Function(scalar)
    bcs = [
        solid.symmetry(mesh.facets.find(SURFACES["symmetry_x"]), 0),
        solid.symmetry(mesh.facets.find(SURFACES["symmetry_z"]), 2),
        fem.dirichletbc(pushed, at[0], vertical),
        fem.dirichletbc(fem.Function(scalar), at[1], vertical),
    ]
    problem = BoundaryValueProblem(solid, bcs)
    u, forces, previous = solid.displacement.x.array, {}, 0.0
    for d in np.arange(PINNED_STEP_MM, PINNED_TO_MM + 1e-9, PINNED_STEP_MM).tolist():
        u[:] *= d / previous if previous else 1.0  # linear prediction
        pushed.x.array[:] = -d
        problem.solve(1e-9, largest_update_mm=10.0)
        forces[d] = -4.0 * float(problem.reactions().reshape(-1)[at[0][0]].sum())
        previous = d
    return forces


def pinned() -> Study:
    """Compare a tube held at whole sections with three codes that agree to seven digits."""
    found = pinned_forces()
    table = pd.read_csv(DATA / "pinned_svk_L1.csv")
    table = table[table["displacement_mm"] <= PINNED_TO_MM]
    table = table.pivot(index="displacement_mm", columns="code", values="force_N")
    ours = np.array([found[float(d)] for d in table.index])
    miss = table.sub(ours, axis=0).abs().max().max()
    table.insert(0, "ramiefenics", list(ours))
    return Study(
        "Other codes: pinned tube",
        "The layered tube without contact, St. Venant-Kirchhoff, first-order cells: all nodes of "
        "the middle section are pushed down, and all of the section at the support are held. "
        "Forces in N.",
        (
            at_most(
                "largest difference to any code (N)", float(miss), 1.5e-5, "printed to five places"
            ),
        ),
        table.reset_index().rename(columns={"displacement_mm": "displacement (mm)"}),
    )


def _plot(curve: pd.DataFrame, others: pd.DataFrame) -> Plot:
    """Draw the curve of ramiefenics, and the points of other codes."""
    series = [
        Series(str(code), found["displacement_mm"].to_numpy(), found["force_N"].to_numpy(), True)
        for code, found in others.groupby("code")
    ]
    ours = Series("ramiefenics", curve["displacement_mm"], curve["force_N"])
    return Plot("travel (mm)", "force (N)", (ours, *series))


def pressed() -> Study:
    """Compare a tube bent between cylinders with four codes, up to 14 mm of travel."""
    curve = simulate(isotropic(VOID_MM), MPI.COMM_SELF, tube=tube()).curve
    travel, force = curve["displacement_mm"], curve["force_N"]
    others = pd.read_csv(DATA / "contact_neohooke_L1.csv")
    others["code"] = others["code"].str.split(",").str[0]
    springs = others["code"].str.split().str[0].map(GROUND_SPRINGS).fillna(0.0)
    others["force_N"] += springs * others["displacement_mm"]
    others["ramiefenics"] = np.interp(others["displacement_mm"], travel, force)
    late = others[others["displacement_mm"] >= AGREE_FROM_MM]
    miss = (late["force_N"] / late["ramiefenics"] - 1).abs().max()
    table = others.pivot_table(index="displacement_mm", columns="code", values="force_N")
    table.insert(0, "ramiefenics", list(np.interp(table.index, travel, force)))
    even = table.index % 2 == 0
    return Study(
        "Other codes: tube between cylinders",
        "Isotropic neo-Hookean layers, first-order cells, without friction. The others use "
        "penalties near 200 N/mm3, Kratos a mortar method. CalculiX and GetFEM give the force of "
        "the supports; that of the soft ground springs in their models, 0.06 N/mm, is added. "
        "Forces in N.",
        (
            at_most(
                f"largest relative difference to any code from {AGREE_FROM_MM:g} mm on",
                float(miss),
                0.02,
                "they agree with each other within 1.5 %",
            ),
        ),
        table[even].reset_index().rename(columns={"displacement_mm": "travel (mm)"}),
        _plot(curve, others),
    )


def pinched() -> pd.DataFrame:
    """Return the curve of the tube that is pinched until its void closes."""
    mesh = tube()
    at = mesh.mesh.geometry.x
    radius = np.hypot(at[:, 0], at[:, 1])
    share = 2.0 * np.maximum(XYLEM_MM / 2.0 - radius, 0.0) / (XYLEM_MM - VOID_MM)  # 1 at the void
    at[:, :2] *= 1.0 + (share * (CLOSED_VOID_MM - VOID_MM) / 2.0 / radius)[:, None]
    changes = {
        "fixture.span_mm": 0.0,
        "fixture.indenter_radius_mm": CLOSED_RADIUS_MM,
        "fixture.support_radius_mm": CLOSED_RADIUS_MM,
        "protocol.travel_mm": CLOSED_TRAVEL_MM,
        "protocol.save_every_mm": 0.25,  # where CalculiX has forces
        "numerics.acoustic_check": False,
    }
    return simulate(override(isotropic(CLOSED_VOID_MM), changes), MPI.COMM_SELF, tube=mesh).curve


def closed() -> Study:
    """Compare a tube that is pinched until its void closes, and beyond, with CalculiX."""
    curve = pinched()
    travel, force = curve["displacement_mm"], curve["force_N"]
    others = pd.read_csv(DATA / "closing_neohooke_L1.csv")
    table = others.pivot_table(index="displacement_mm", columns="code", values="force_N")
    soft, stiff = (table[f"CalculiX 2.20; {penalty} N/mm3"] for penalty in (500, 2000))
    table["CalculiX, rigid"] = stiff + (stiff - soft) / 3.0
    table.insert(0, "ramiefenics", list(np.interp(table.index, travel, force)))
    pressed: Array = np.interp(table.index, travel, curve["void_force_N"])
    table.insert(1, "through the void", list(pressed))
    ratio = (table["ramiefenics"] / table["CalculiX, rigid"])[pressed > 0.0]
    return Study(
        "Other codes: a void that closes",
        "The same layers and cells, the void widened to 11 mm, pinched without friction between "
        "two cylinders of 15 mm radius opposite each other, until the void closes and beyond. "
        "CalculiX has surface-to-surface penalties, for cylinders and walls alike. The error of a "
        "penalty is inversely proportional to it, which gives the limit of rigid contact. "
        "Forces in N.",
        (
            at_most(
                "largest relative difference to CalculiX once the void has closed",
                float((ratio - 1.0).abs().max()),
                0.02,
                "its two penalties differ by up to 15 %",
            ),
            at_least(
                "largest share of the force that goes through the void",
                float((pressed / table["ramiefenics"]).max()),
                0.5,
                "otherwise its contact would hardly be tested",
            ),
        ),
        table[table.index >= CLOSED_TRAVEL_MM - 2.0]
        .reset_index()
        .rename(columns={"displacement_mm": "travel (mm)"}),
        _plot(curve, others),
    )

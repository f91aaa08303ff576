"""A cylinder pressed on a block: Hertz's line contact, and the penalty method for comparison."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd
import ufl
from dolfinx import fem
from scipy.integrate import trapezoid

from ramiefenics.model.contact import Contact, Obstacle
from ramiefenics.model.jit import compile_form
from ramiefenics.model.laws.base import Expr
from ramiefenics.model.solid import Solid
from ramiefenics.specification import ContactMethod, Cylinder, Elastic, Friction, Material
from ramiefenics.verification.block import (
    BoundaryValueProblem,
    block,
    hold,
    layers,
    on_planes,
    second_order,
)
from ramiefenics.verification.study import DATA, Array, Check, Plot, Series, Study, at_most, near

SIZE = 10.0
"""Depth and half the width of the block, mm."""

YOUNG, POISSON = 10.0, 0.3
SLICE = 0.1
"""Thickness of the slice, mm."""

FINE_ZONE = 0.8
"""Width and depth of the zone with cells of equal size, mm."""

LEVELS = {2: (0.16, 0.08), 1: (0.16, 0.08, 0.04)}
"""Cell sizes under the cylinder, mm, by element order."""

PENALTIES = (30.0, 100.0, 300.0, 1000.0, 3000.0)
"""Penalties, N/mm3."""

MATERIAL = Material(Elastic.isotropic(YOUNG, POISSON))


@dataclass(frozen=True)
class Cylinders:
    """Cylinder that is pressed on the block.

    Attributes
    ----------
    radius_mm
        Radius of the cylinder.
    push_mm
        Distance by which it is pushed down from first touch.
    """

    radius_mm: float
    push_mm: float


AS_OTHERS = Cylinders(5.0, 0.05)
"""Cylinder of the other codes' problem, see `data/hertz.csv`."""

FLAT = Cylinders(25.0, 0.01)
"""Cylinder with nearly the same contact width at a fifth of the strain.

Hertz's theory is one of small strain.
"""


@dataclass(frozen=True)
class Pressed:
    """Solution of the contact problem.

    Attributes
    ----------
    force_N_per_mm
        Force on the whole block, from the reaction at the bottom.
    z_mm, pressure_MPa
        Z of the surface's vertices, ascending, and pressure at these: an average weighted by the
        shape function of the vertex, which is all that the weak form determines. Empty without
        Nitsche's method.
    """

    force_N_per_mm: float
    z_mm: Array
    pressure_MPa: Array

    @property
    def half_width_mm(self) -> float:
        """Half-width of contact, from a moment of the pressure.

        For an ellipse, a^2 = 4 int p z^2 / int p.
        """
        weight = trapezoid(self.pressure_MPa, self.z_mm)
        return float(2 * np.sqrt(trapezoid(self.pressure_MPa * self.z_mm**2, self.z_mm) / weight))


def grid(size: float) -> tuple[Array, Array]:
    """Return Y and Z of the nodes, mm: even near the contact, cells growing by a fifth outside."""
    steps: list[float] = []
    at = FINE_ZONE
    while at < SIZE:
        steps.append(min(size * 1.2 ** (len(steps) + 1), SIZE - at))
        at += steps[-1]
    fine = np.linspace(0.0, FINE_ZONE, round(FINE_ZONE / size) + 1)
    away = np.concatenate([fine, FINE_ZONE + np.cumsum(steps)])
    return SIZE - away[::-1], away


def press(size: float, order: int, by: Cylinders = FLAT, penalty: float | None = None) -> Pressed:
    """Solve the contact problem by Nitsche's method, or with a penalty, N/mm3.

    The model is a slice of one half of the block in plane strain; its bottom can slide.
    """
    y, z = grid(size)
    mesh = block(np.array([-SLICE / 2, SLICE / 2]), y, z)
    mesh = mesh if order == 1 else second_order(mesh)
    solid = Solid(mesh, layers(mesh), [MATERIAL], "svk")
    sides, bottom = on_planes(mesh, 0, -SLICE / 2, SLICE / 2), on_planes(mesh, 1, 0.0)
    top, middle = on_planes(mesh, 1, SIZE), on_planes(mesh, 2, 0.0)
    bcs = [hold(solid, sides, 0), hold(solid, bottom, 1), hold(solid, middle, 2)]
    cylinder = Cylinder("cylinder", "above", True, 0.0, by.radius_mm)
    obstacle = Obstacle(cylinder, SIZE, top)
    contact = Contact(solid, (obstacle,), Friction(0.0, 0.0), ContactMethod(), size)
    contact.place(-by.push_mm)

    def by_penalty(v: Expr) -> Expr:
        x = ufl.SpatialCoordinate(mesh) + solid.displacement
        across = ufl.as_vector((0, x[1] - (SIZE + by.radius_mm - by.push_mm), x[2]))
        distance = ufl.sqrt(ufl.dot(across, across))
        overlap = ufl.max_value(by.radius_mm - distance, 0)
        strength = fem.Constant(mesh, penalty)
        return -strength * overlap * ufl.dot(across / distance, v) * contact.ds

    if penalty is None:
        problem = BoundaryValueProblem(solid, bcs, terms=[contact.term()])
    else:
        problem = BoundaryValueProblem(solid, bcs, by_penalty)
    problem.solve(1e-9)
    held = bcs[1].dof_indices()[0]
    force = 2 / SLICE * abs(problem.reactions().reshape(-1)[held].sum())
    if penalty is not None:
        return Pressed(force, np.empty(0), np.empty(0))
    return Pressed(force, *_pressure_at_vertices(contact))


def _pressure_at_vertices(contact: Contact) -> tuple[Array, Array]:
    """Return z, mm, and pressure, MPa, along one edge of the surface, where cells are even."""
    mesh = contact.solid.mesh
    vertices = fem.functionspace(mesh, ("Lagrange", 1))
    w = ufl.TestFunction(vertices)
    area, force = (
        fem.assemble_vector(compile_form(amount * w * contact.ds)).array
        for amount in (fem.Constant(mesh, 1.0), contact.pressure)
    )
    points = vertices.tabulate_dof_coordinates()
    edge = np.flatnonzero((area > 0) & (points[:, 0] < 0) & (points[:, 2] < FINE_ZONE))
    edge = edge[np.argsort(points[edge, 2])]
    return points[edge, 2], force[edge] / area[edge]


def theory(radius_mm: float, force_N_per_mm: float) -> tuple[float, float]:
    """Return half-width, mm, and largest pressure, MPa (Johnson 1985, Eqs. 4.43 and 4.45)."""
    modulus = YOUNG / (1 - POISSON**2)
    half_width = np.sqrt(4 * force_N_per_mm * radius_mm / (np.pi * modulus))
    return float(half_width), float(2 * force_N_per_mm / (np.pi * half_width))


def hertz() -> Study:
    """Refine meshes of both element orders, and compare with theory and other codes."""
    rows = []
    for order, sizes in LEVELS.items():
        for size in sizes:
            found = press(size, order)
            half_width, peak = theory(FLAT.radius_mm, found.force_N_per_mm)
            rows.append(
                {
                    "order": order,
                    "cell (mm)": size,
                    "force (N/mm)": found.force_N_per_mm,
                    "half-width (mm)": found.half_width_mm,
                    "by theory (mm)": half_width,
                    "peak pressure (MPa)": found.pressure_MPa.max(),
                    "by theory (MPa)": peak,
                }
            )
    table = pd.DataFrame(rows)
    last = table.iloc[-1]
    others = press(LEVELS[2][-1], 2, AS_OTHERS).force_N_per_mm
    inside = np.linspace(0.0, half_width, 50)
    checks = (
        near(
            "force of the other codes' problem (N/mm)",
            others,
            pd.read_csv(DATA / "hertz.csv")["force_N_per_mm"].mean(),
            0.005,
            "CalculiX and GetFEM, cells of 0.02 mm",
        ),
        near(
            "half-width (mm)",
            last["half-width (mm)"],
            half_width,
            0.02,
            "Hertz's half-space and small strain",
        ),
        near("peak pressure (MPa)", last["peak pressure (MPa)"], peak, 0.02, "Hertz's half-space"),
        _profile(found, half_width, peak),
    )
    return Study(
        "Hertz's line contact",
        f"A rigid cylinder of radius {FLAT.radius_mm:g} mm is pressed {FLAT.push_mm:g} mm into a "
        f"block of {2 * SIZE:g} x {SIZE:g} mm in plane strain (E = {YOUNG:g} MPa, nu = "
        f"{POISSON:g}), without friction. Half-width and pressure by theory are those for the "
        "force found (Johnson 1985, section 4.2). CalculiX and GetFEM had a radius of 5 mm and a "
        "push of 0.05 mm, where strains of some per cent already widen the contact; the force of "
        "that problem is compared too.",
        checks,
        table,
        Plot(
            "distance from the middle (mm)",
            "pressure (MPa)",
            (
                Series("Hertz", inside, peak * np.sqrt(1 - (inside / half_width) ** 2)),
                Series(
                    f"order {order}, cells of {size:g} mm",
                    found.z_mm,
                    found.pressure_MPa,
                    points=True,
                ),
            ),
        ),
    )


def _profile(found: Pressed, half_width: float, peak: float) -> Check:
    inside = found.z_mm < 0.9 * half_width
    exact = peak * np.sqrt(1 - (found.z_mm[inside] / half_width) ** 2)
    return at_most(
        "largest error of the pressure within 90 % of the half-width, over the peak",
        float(np.abs(found.pressure_MPa[inside] - exact).max() / peak),
        0.02,
        "half-space; vertex averages over cells of an eighth of the half-width",
    )


def penalty() -> Study:
    """Increase the penalty, and compare with the force by Nitsche's method."""
    size, order = LEVELS[1][-1], 1
    nitsche = press(size, order).force_N_per_mm
    forces = [press(size, order, FLAT, value).force_N_per_mm for value in PENALTIES]
    gaps = [1 - force / nitsche for force in forces]
    rate = np.log(gaps[-2] / gaps[-1]) / np.log(PENALTIES[-1] / PENALTIES[-2])
    return Study(
        "Penalty method",
        "The same block with contact by a penalty on the overlap, implemented independently: as "
        "the penalty grows, its force approaches that of Nitsche's method from below, and the "
        "difference is inversely proportional to the penalty (Kikuchi and Oden 1988).",
        (
            near("order at which the difference falls", float(rate), 1.0, 0.15, "asymptotic"),
            at_most(
                "difference at the largest penalty, relative",
                gaps[-1],
                0.005,
                "the last of a sequence that is still falling",
            ),
        ),
        pd.DataFrame(
            {"penalty (N/mm3)": PENALTIES, "force (N/mm)": forces, "below Nitsche's": gaps}
        ),
        Plot(
            "penalty (N/mm3)",
            "difference to Nitsche's force, relative",
            (Series("penalty", PENALTIES, gaps, points=True, slope=-1),),
            log=True,
        ),
    )

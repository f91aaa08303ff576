"""A block pulled along a plane: it sticks, breaks loose, and slides."""

from __future__ import annotations

import math

import numpy as np
import pandas as pd
from dolfinx import fem
from scipy.optimize import brentq

from ramiefenics.model.contact import Contact, Obstacle
from ramiefenics.model.jit import compile_form
from ramiefenics.model.solid import Solid
from ramiefenics.specification import ContactMethod, Cylinder, Elastic, Friction, Material
from ramiefenics.verification.block import BoundaryValueProblem, block, hold, layers, on_planes
from ramiefenics.verification.study import (
    Array,
    Check,
    Plot,
    Series,
    Study,
    at_least,
    at_most,
    near,
)

FRICTION = Friction(0.59, 0.12, weakening_mm=0.1)
"""Friction that weakens more slowly than the spring relaxes, so that equilibrium always exists."""

SIZE, WIDTH = 4.0, 1.0

PRESS, PULL = 0.02, 1.0
"""Displacements by which the block is pressed against the plane and pulled along it, mm."""

STEP, LONG_STEP = 0.005, 0.1
"""Steps of the pull, mm; the behaviour of the block must not depend on them."""

SPRING = 0.25
"""Stiffness of the elastic bed that pulls the sliding surface along, MPa/mm.

A bed on that surface leaves the pressure uniform.
"""

MATERIAL = Material(Elastic.isotropic(10.0, 0.0))
METHOD = ContactMethod(presliding_mm=2e-5)
"""Contact method with sharp friction, which builds up over a small part of the weakening slip."""


def pull(step_mm: float) -> pd.DataFrame:
    """Press a block against a plane, pull it along by a spring, and return a table of the steps."""
    even = np.linspace(-SIZE / 2, SIZE / 2, 5)
    mesh = block(np.array([-WIDTH / 2, WIDTH / 2]), even + SIZE / 2, even)
    solid = Solid(mesh, layers(mesh), [MATERIAL], "svk")
    top, bottom = on_planes(mesh, 1, SIZE), on_planes(mesh, 1, 0.0)
    sides = on_planes(mesh, 0, -WIDTH / 2, WIDTH / 2)
    bcs = [hold(solid, sides, 0), hold(solid, bottom, 1)]
    plane = Obstacle(Cylinder("plane", "above", True, 0.0, math.inf), SIZE, top)
    contact = Contact(solid, (plane,), FRICTION, METHOD, SIZE / 4)
    pulled = fem.Constant(mesh, 0.0)
    tension = SPRING * (pulled - solid.displacement[2])
    problem = BoundaryValueProblem(
        solid, bcs, lambda v: -tension * v[2] * contact.ds, [contact.term()]
    )
    spring_force = compile_form(tension * contact.ds)
    rows = []
    for step in range(round(PULL / step_mm) + 1):
        pulled.value = step * step_mm
        contact.place(0.0 if step else -PRESS)
        problem.solve(1e-8)
        (sums,) = contact.sums()
        tangential = float(fem.assemble_scalar(spring_force))
        slipped = float(solid.displacement.x.array.reshape(-1, 3)[:, 2].mean())
        rows.append((step * step_mm, slipped, -sums.force_y_N, tangential, sums.friction_work_Nmm))
        contact.advance()
        contact.update_stabilisation()
    names = ["pulled (mm)", "slipped (mm)", "normal (N)", "tangential (N)", "friction work (N mm)"]
    table = pd.DataFrame(rows, columns=names)
    table["ratio"] = table["tangential (N)"] / table["normal (N)"]
    return table


def exact_slip(pulled_mm: float, normal_N: float) -> float:
    """Return the slip, mm, at which the spring balances the friction ``mu(slip) normal``."""

    def surplus(slip: float) -> float:
        return SPRING * SIZE * WIDTH * (pulled_mm - slip) - coefficient(slip) * normal_N

    return float(brentq(surplus, 0.0, pulled_mm)) if surplus(0.0) > 0.0 else 0.0


def coefficient(slip_mm: float) -> float:
    """Return the coefficient of friction after a slip."""
    weakened = float(np.exp(-slip_mm / FRICTION.weakening_mm))
    return FRICTION.dynamic + (FRICTION.static - FRICTION.dynamic) * weakened


def exact_work(slid_mm: float, normal_N: float) -> float:
    """Return the work of friction along a slip, N mm: the integral of its force."""
    L = FRICTION.weakening_mm
    surplus = (FRICTION.static - FRICTION.dynamic) * L * (1.0 - np.exp(-slid_mm / L))
    return float(normal_N * (FRICTION.dynamic * slid_mm + surplus))


def sliding() -> Study:
    """Compare slip, forces and work with their exact values, in short and in long steps."""
    tables = {step: pull(step) for step in (STEP, LONG_STEP)}
    normal = float(tables[STEP]["normal (N)"].iloc[-1])
    exact = {
        step: np.array([exact_slip(at, normal) for at in found["pulled (mm)"]])
        for step, found in tables.items()
    }
    return Study(
        "Stick and slip",
        f"A block of {SIZE:g} x {SIZE:g} mm in plane strain is pressed against a plate "
        f"and pulled along it by a spring, with Coulomb coefficients "
        f"{FRICTION.static:g} at rest and {FRICTION.dynamic:g} in motion, from the former to the "
        f"latter by exp(-slip / {FRICTION.weakening_mm:g} mm). At the exact slip, spring and "
        f"friction are in balance; steps of {STEP:g} and of {LONG_STEP:g} mm must both find it.",
        _checks(tables, exact, normal),
        tables[STEP].iloc[::10],
        _plot(tables, exact[STEP], normal),
    )


def _checks(
    tables: dict[float, pd.DataFrame], exact: dict[float, Array], normal_N: float
) -> tuple[Check, ...]:
    """Compare the tables with the exact slips, both by step size."""
    table, slid = tables[STEP], float(exact[STEP][-1])
    ratio, work = table["ratio"], table["friction work (N mm)"]
    loose = int(np.flatnonzero(exact[STEP])[0])
    stuck = table["slipped (mm)"][loose - 1] / table["pulled (mm)"][loose - 1]
    slips = (
        at_most(
            f"largest error of the slip, in steps of {step:g} mm (mm)",
            float(np.abs(found["slipped (mm)"] - exact[step]).max()),
            3e-4,
            "a few presliding lengths",
        )
        for step, found in tables.items()
    )
    return (
        near(
            "ratio of forces when the block breaks loose",
            float(ratio.max()),
            FRICTION.static,
            0.045,
            "Coulomb's law; a step of the pull changes the ratio by 0.025",
        ),
        near("ratio at the end", float(ratio.iloc[-1]), coefficient(slid), 1e-3, "friction law"),
        at_most(
            "slip before the block breaks loose, over the pull",
            float(stuck),
            0.01,
            "the block sticks, but for the regularisation",
        ),
        *slips,
        near(
            "friction work (N mm)",
            float(work.iloc[-1]),
            exact_work(slid, normal_N),
            1e-3,
            "force along the slip",
        ),
        at_least(
            "smallest friction work of a step (N mm)",
            float(work.diff().min()),
            0.0,
            "friction dissipates",
        ),
    )


def _plot(tables: dict[float, pd.DataFrame], exact: Array, normal_N: float) -> Plot:
    """Draw the ratio of forces; `exact` has the exact slips in short steps, mm."""
    pulled = tables[STEP]["pulled (mm)"]
    found = (
        Series(f"steps of {step:g} mm", table["pulled (mm)"], table["ratio"], points=True)
        for step, table in tables.items()
    )
    return Plot(
        "pulled (mm)",
        "tangential / normal force",
        (
            Series("exact", pulled, SPRING * SIZE * WIDTH * (pulled - exact) / normal_N),
            *found,
            Series("static coefficient", [0.0, PULL], [FRICTION.static] * 2),
            Series("dynamic coefficient", [0.0, PULL], [FRICTION.dynamic] * 2),
        ),
    )

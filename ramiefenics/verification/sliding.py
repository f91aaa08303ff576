"""A block pulled along a plane: it sticks, breaks loose, and slides."""

from __future__ import annotations

import numpy as np
import pandas as pd
from dolfinx import fem

from ramiefenics.model.contact import Contact, Cylinder
from ramiefenics.model.jit import compile_form
from ramiefenics.model.solid import Solid
from ramiefenics.specification import ContactMethod, Elastic, Friction, Material
from ramiefenics.verification.block import BoundaryValueProblem, block, hold, layers, on_planes
from ramiefenics.verification.study import Plot, Series, Study, at_least, at_most, near

FRICTION = Friction(0.59, 0.12)
SIZE = 4.0
PLANE_MM = 1e6
"""Radius of the cylinder that stands for a plane: it sinks by a nanometre over the block."""

PRESS, STEP, STEPS = 0.02, 0.005, 60
"""Pressed together by, and pulled along by, mm."""

SPRING = 0.25
"""Of the bed that pulls the sliding surface along, MPa/mm; a bed there leaves the pressure even."""

MATERIAL = Material(Elastic.isotropic(10.0, 0.0))
METHOD = ContactMethod(slip_tolerance=5e-5)
"""Sharp: the regularisation gives way to Coulomb's law at a small part of the pull."""


def pull() -> pd.DataFrame:
    """Press a block against a plane, then pull it along by a spring; return forces per step, N."""
    even = np.linspace(-SIZE / 2, SIZE / 2, 5)
    mesh = block(np.array([-0.5, 0.5]), even + SIZE / 2, even)
    solid = Solid(mesh, layers(mesh), [MATERIAL], "svk")
    top, bottom = on_planes(mesh, 1, SIZE), on_planes(mesh, 1, 0.0)
    sides = on_planes(mesh, 0, -0.5, 0.5)
    bcs = [hold(solid, sides, 0), hold(solid, bottom, 1)]
    plane = Cylinder("plane", SIZE + PLANE_MM, 0.0, PLANE_MM, top)
    contact = Contact(solid, (plane,), FRICTION, METHOD, SIZE / 4)
    pulled = fem.Constant(mesh, 0.0)
    tension = SPRING * (pulled - solid.displacement[2])
    problem = BoundaryValueProblem(
        solid, bcs, lambda v: contact.residual(v) - tension * v[2] * contact.ds
    )
    spring_force = compile_form(tension * contact.ds)
    rows = []
    for step in range(STEPS + 1):
        pulled.value = step * STEP
        contact.place("plane", 0.0 if step else -PRESS, STEP)
        problem.solve(1e-8)
        sums = contact.sums()["plane"]
        tangential = float(fem.assemble_scalar(spring_force))
        slipped = float(solid.displacement.x.array.reshape(-1, 3)[:, 2].mean())
        rows.append((step * STEP, slipped, -sums.force_y_N, tangential, sums.friction_work_Nmm))
        contact.advance()
        contact.update_stabilisation()
    names = ["pulled (mm)", "slipped (mm)", "normal (N)", "tangential (N)", "friction work (N mm)"]
    table = pd.DataFrame(rows, columns=names)
    table["ratio"] = table["tangential (N)"] / table["normal (N)"]
    return table


def sliding() -> Study:
    """Compare the ratio of forces with both coefficients, and the work with the force."""
    table = pull()
    pulled, ratio, work = (table[key] for key in ("pulled (mm)", "ratio", "friction work (N mm)"))
    loose = int(ratio.to_numpy().argmax())
    after = ratio.iloc[loose + 3 :]
    farthest = float(after.iloc[int(np.abs(after - FRICTION.dynamic).argmax())])
    force = FRICTION.dynamic * float(table["normal (N)"].iloc[-1])
    return Study(
        "Stick and slip",
        f"A block of {SIZE:g} x {SIZE:g} mm in plane strain is pressed against a plane (a cylinder "
        f"of a kilometre) and pulled along it by a spring, in steps of {STEP:g} mm, with Coulomb "
        f"coefficients {FRICTION.static:g} at rest and {FRICTION.dynamic:g} in motion. The exact "
        "ratio of tangential to normal force grows to the former, and is the latter from then on.",
        (
            near(
                "ratio when it breaks loose",
                float(ratio.max()),
                FRICTION.static,
                1e-3,
                "Coulomb's law",
            ),
            near(
                "ratio in motion, farthest from the law",
                farthest,
                FRICTION.dynamic,
                1e-3,
                "the same",
            ),
            at_most(
                "slip before it breaks loose, over the pull",
                float(table["slipped (mm)"][loose - 1] / pulled[loose - 1]),
                0.01,
                "it sticks, up to the regularisation",
            ),
            near(
                "friction work of the last step (N mm)",
                float(work.iloc[-1]),
                force * STEP,
                1e-3,
                "force times the pull",
            ),
            at_least(
                "smallest friction work of a step (N mm)", float(work.min()), 0.0, "it dissipates"
            ),
        ),
        table.iloc[::5],
        Plot(
            "pulled (mm)",
            "tangential / normal force",
            (
                Series("block", pulled, ratio, points=True),
                Series("static coefficient", [0.0, pulled.max()], [FRICTION.static] * 2),
                Series("dynamic coefficient", [0.0, pulled.max()], [FRICTION.dynamic] * 2),
            ),
        ),
    )

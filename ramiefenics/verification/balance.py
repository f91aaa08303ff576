"""Energy balance of a whole bending test, and how much of the travel is crushing."""

from __future__ import annotations

import numpy as np
import pandas as pd
from mpi4py import MPI

from ramiefenics.solve.simulate import simulate
from ramiefenics.specification import override, published_test
from ramiefenics.verification.beam import LayeredTube
from ramiefenics.verification.study import Plot, Series, Study, at_least, at_most

FORCES_N = (2.0, 5.0, 10.0, 20.0, 40.0, 60.0, 80.0, 100.0)


def balance() -> Study:
    """Bend the calibration stalk to 14 mm in steps short enough for the trapezoidal rule."""
    test = override(
        published_test("table3"),
        [
            "numerics.mesh=screening",
            "numerics.stepping.first_step_mm=0.1",
            "numerics.stepping.max_step_mm=0.5",
        ],
    )
    result = simulate(test, MPI.COMM_SELF)
    curve = result.curve
    work, friction = curve["indenter_work_Nmm"], curve["friction_work_Nmm"]
    kept = curve["stored_energy_Nmm"] + friction
    miss = (work - kept) / work.iloc[-1]
    bearing = (curve["support_force_N"] - curve["force_N"]).abs().max()
    stiffness = LayeredTube.of(test.stalk).three_point_stiffness(test.fixture.span_mm)
    rising = curve.iloc[: int(curve["force_N"].to_numpy().argmax()) + 1]
    travel = np.interp(FORCES_N, rising["force_N"], rising["displacement_mm"])
    beam = np.array(FORCES_N) / stiffness
    table = {
        "force (N)": FORCES_N,
        "travel (mm)": travel,
        "of it bending (mm)": beam,
        "share of crushing": 1 - beam / travel,
    }
    return Study(
        "Energy balance and crushing",
        "The calibration stalk to 14 mm, screening mesh, friction 0.59 at rest and 0.12 in motion. "
        "What the indenter works (trapezoidal rule) must be stored or rubbed off. The table "
        "divides the travel into the deflection of a layered Timoshenko beam of the same span, "
        f"{test.fixture.span_mm:g} mm, whose stiffness is {stiffness:.1f} N/mm, and the rest: the "
        "section crushed under the indenter and at the supports.",
        (
            at_most(
                "largest miss of the energy balance, over the final work",
                float(miss.abs().max()),
                0.005,
                "trapezoidal rule with steps of 0.5 mm",
            ),
            at_least(
                "smallest friction work of a step (N mm)",
                float(friction.diff().min()),
                0.0,
                "friction dissipates",
            ),
            at_most(
                "indenter's force less supports' (N)",
                float(bearing),
                0.01,
                "equilibrium, to the tolerance of Newton's method",
            ),
        ),
        pd.DataFrame(table),
        Plot(
            "travel (mm)",
            "energy (N mm)",
            (
                Series("work of the indenter", curve["displacement_mm"], work, points=True),
                Series("stored and rubbed off", curve["displacement_mm"], kept),
                Series("rubbed off", curve["displacement_mm"], friction),
            ),
        ),
    )

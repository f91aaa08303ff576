"""Energy balance of whole bending tests, and the share of crushing in the travel."""

from __future__ import annotations

import numpy as np
import pandas as pd
from mpi4py import MPI

from ramiefenics.published import published_test
from ramiefenics.published.stalks import FIXTURE
from ramiefenics.solve.result import BendingResult
from ramiefenics.solve.simulate import simulate
from ramiefenics.specification import override
from ramiefenics.verification.beam import LayeredTube
from ramiefenics.verification.study import Check, Plot, Series, Study, at_least, at_most

FORCES_N = (2.0, 5.0, 10.0, 20.0, 40.0, 60.0, 80.0, 100.0)

SHORT_STEPS = (
    "numerics.mesh=screening",
    "numerics.stepping.first_step_mm=0.1",
    "numerics.stepping.max_step_mm=0.5",
)

YIELDING = (
    "law=fibre_plasticity",
    "stalk.layers.phloem.material.law_constants.tensile_yield_strain=0.002",
    "protocol.travel_mm=4",
    "protocol.then=[{to_mm=2}]",
)
"""Changes for a stalk whose fibres yield early, and which is bent and partly unloaded."""


def balance() -> Study:
    """Bend the calibration stalk in steps short enough for the trapezoidal rule."""
    test = override(published_test("table3"), SHORT_STEPS)
    elastic = simulate(test, MPI.COMM_SELF)
    yielding = simulate(override(test, YIELDING), MPI.COMM_SELF)
    stiffness = LayeredTube.of(test.stalk).three_point_stiffness(FIXTURE.span_mm)
    return Study(
        "Energy balance and crushing",
        "The calibration stalk is bent to 14 mm on the screening mesh, with friction 0.59 at rest "
        "and 0.12 in motion; and to 4 mm and back to 2 mm, with phloem fibres that yield in "
        "tension beyond a strain of 0.002 (`fibre_plasticity`). The indenter's work, by the "
        "trapezoidal rule, must equal the energy stored and that dissipated by friction and the "
        "material; the figure shows the stalk that yields. The table divides the elastic stalk's "
        "travel into the deflection "
        "of a layered Timoshenko beam of the same span, "
        f"{FIXTURE.span_mm:g} mm, whose stiffness is {stiffness:.1f} N/mm, and the rest: the "
        "section crushed under the indenter and at the supports.",
        (
            *_checks("elastic", elastic),
            at_least(
                "elastic: smallest friction work of a step (N mm)",
                float(elastic.curve["friction_work_Nmm"].diff().min()),
                0.0,
                "friction dissipates",
            ),
            *_checks("yielding", yielding),
            *_dissipation_checks(yielding),
        ),
        _crushing(elastic, stiffness),
        _plot(yielding),
    )


def _checks(which: str, result: BendingResult) -> tuple[Check, ...]:
    """Check the balances of energy and force."""
    curve = result.curve
    miss = curve["indenter_work_Nmm"] - _spent(curve)
    bearing = (curve["support_force_N"] - curve["force_N"]).abs().max()
    return (
        at_most(
            f"{which}: largest error of the energy balance, over the largest work",
            float(miss.abs().max() / curve["indenter_work_Nmm"].max()),
            0.005,
            "trapezoidal rule with steps of 0.5 mm",
        ),
        at_most(
            f"{which}: difference of the indenter's and the supports' force (N)",
            float(bearing),
            0.01,
            "equilibrium, within the tolerance of Newton's method",
        ),
    )


def _spent(curve: pd.DataFrame) -> pd.Series[float]:
    """Return the energy stored, and dissipated by friction and the material so far, N mm."""
    kinds = ["stored_energy_Nmm", "friction_work_Nmm", "dissipated_Nmm"]
    return curve[kinds].sum(axis=1)


def _dissipation_checks(result: BendingResult) -> tuple[Check, ...]:
    dissipated, work = result.curve["dissipated_Nmm"], result.curve["indenter_work_Nmm"]
    return (
        at_least(
            "yielding: smallest dissipation of a step, over all of it",
            float(dissipated.diff().min() / dissipated.iloc[-1]),
            -1e-9,
            "second law of thermodynamics, within rounding errors",
        ),
        at_least(
            "yielding: dissipated by the material, over the largest work",
            float(dissipated.iloc[-1] / work.max()),
            0.1,
            "otherwise the balance would not test it",
        ),
    )


def _crushing(result: BendingResult, stiffness_N_per_mm: float) -> pd.DataFrame:
    """Tabulate the travel, and the share that a beam of given stiffness does not explain."""
    curve = result.curve
    rising = curve.iloc[: int(curve["force_N"].to_numpy().argmax()) + 1]
    travel = np.interp(FORCES_N, rising["force_N"], rising["displacement_mm"])
    beam = np.array(FORCES_N) / stiffness_N_per_mm
    return pd.DataFrame(
        {
            "force (N)": FORCES_N,
            "travel (mm)": travel,
            "bending (mm)": beam,
            "share of crushing": 1 - beam / travel,
        }
    )


def _plot(result: BendingResult) -> Plot:
    curve = result.curve
    travel, dissipated = curve["displacement_mm"], curve["dissipated_Nmm"]
    lost = curve["friction_work_Nmm"] + dissipated
    return Plot(
        "travel (mm)",
        "energy (N mm)",
        (
            Series("work of the indenter", travel, curve["indenter_work_Nmm"], points=True),
            Series("stored and dissipated", travel, _spent(curve)),
            Series("dissipated by friction and material", travel, lost),
            Series("dissipated by the material", travel, dissipated),
        ),
    )

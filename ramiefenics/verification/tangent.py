"""Taylor test of the tangent of a bent stalk, with active contact and friction."""

from __future__ import annotations

import numpy as np
import pandas as pd
from mpi4py import MPI

from ramiefenics.model.bending import BendingProblem
from ramiefenics.model.equations import Equations
from ramiefenics.model.observables import Observer
from ramiefenics.published import published_test
from ramiefenics.solve.quasistatic import QuasiStatic
from ramiefenics.specification import override
from ramiefenics.verification.study import Plot, Series, Study, near, observed_orders

TRAVEL, STEP = 3.0, 0.2
SIZES = 1e-3 * 0.5 ** np.arange(8)
"""Sizes of the disturbance, mm."""


def remainders() -> list[float]:
    """Return the norms of R(u + s w) - R(u) - s K w, N, in the middle of a step."""
    test = override(
        published_test("table3"),
        [
            "numerics.mesh=ladder_q2_1",
            f"protocol.travel_mm={TRAVEL}",
            "numerics.acoustic_check=false",
        ],
    )
    problem = BendingProblem(test, MPI.COMM_SELF)
    observer = Observer(problem)
    stepper = QuasiStatic(problem, observer.observe, test.protocol, test.numerics.stepping)
    for _ in stepper.steps():
        pass
    problem.place(STEP, STEP)  # friction acts only once the cylinders have moved
    stepper.newton.solve(1e-3, STEP)
    u = problem.displacement
    here = u.x.array.copy()
    w = np.random.default_rng(3).standard_normal(len(here))
    free = Equations(u, problem.terms, [])
    free.assemble()
    direction = u.x.petsc_vec.duplicate()
    direction.array[:] = w
    linear = (free.matrix.petsc * direction).array.copy()
    forces = u.x.petsc_vec.duplicate()
    free.residual(forces)
    residual = forces.array.copy()
    norms = []
    for size in SIZES:
        u.x.array[:] = here + size * w
        free.residual(forces)
        changed = forces.array - residual
        norms.append(float(np.linalg.norm(changed - size * linear)))
    return norms


def tangent() -> Study:
    """Compare the residual with its linearisation under ever smaller disturbances."""
    norms = remainders()
    orders = observed_orders(list(SIZES), norms)
    return Study(
        "Tangent",
        f"The calibration stalk at {TRAVEL:g} mm of travel, in a step of {STEP:g} mm, with all "
        "nodes disturbed at random in all directions by s: the residual less its linearisation, "
        "contact and friction included, must fall with the square of s (Taylor's theorem). Points "
        "that begin to touch under a disturbance cause a kink, so s is small.",
        (near("last observed order", orders[-1], 2.0, 0.05, "Taylor's theorem"),),
        pd.DataFrame({"s (mm)": SIZES, "remainder (N)": norms}),
        Plot(
            "disturbance (mm)",
            "remainder (N)",
            (Series("remainder", SIZES, norms, points=True, slope=2),),
            log=True,
        ),
    )

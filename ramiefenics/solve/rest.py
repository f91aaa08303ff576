"""Equilibrium of a stalk with growth stress before anything touches it."""

from __future__ import annotations

from ramiefenics.model.bending import BendingProblem
from ramiefenics.model.equations import Equations
from ramiefenics.solve.newton import Newton
from ramiefenics.solve.quasistatic import SMALLEST_SCALE_N
from ramiefenics.specification import SpecificationError


def come_to_rest(problem: BendingProblem) -> None:
    """Bring a stalk to equilibrium; one without growth stress is in equilibrium already.

    Its cut ends are free, and the stress decays towards them.

    Raises
    ------
    SpecificationError
        If there is no equilibrium nearby.
    """
    strain = problem.test.stalk.tissue.growth_strain
    if strain == 0.0:
        return
    solid, _, *bond = problem.terms
    settings = problem.test.numerics.stepping
    equations = Equations(problem.displacement, (solid, *bond), problem.bcs)
    newton = Newton(equations, settings.max_iterations, settings.linear_solver)
    tolerance_N = settings.relative_tolerance * SMALLEST_SCALE_N
    outcome = newton.solve(tolerance_N, problem.test.stalk.outer_diameter_mm)
    if not outcome.converged:
        allowed = f"must allow an equilibrium without load: {outcome.reason}"
        raise SpecificationError("stalk.tissue.growth_strain", strain, allowed)
    problem.begin_at_rest()

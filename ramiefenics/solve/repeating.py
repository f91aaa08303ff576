"""Nonlinear solves, replaced by solutions of an earlier run where these are known."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

import numpy as np

from ramiefenics.model.compat import geometry_nodes
from ramiefenics.solve.driven import Driven
from ramiefenics.solve.newton import Newton, NewtonOutcome
from ramiefenics.solve.solutions import Array, Solution, Solutions

Solve: TypeAlias = Callable[[Callable[[], None]], NewtonOutcome]
"""Function that solves; it calls its argument before friction and material store a state."""


class Repeating:
    """Solves attempted steps, or repeats them from stored solutions.

    Parameters
    ----------
    problem, newton
        The structure, and the solver of its equations.
    solutions
        Stored solutions, to which new ones are added; none by default.
    """

    def __init__(self, problem: Driven, newton: Newton, solutions: Solutions | None) -> None:
        self._problem, self._newton, self._solutions = problem, newton, solutions
        self._u = problem.displacement.x.array
        self._begun = False
        if solutions is not None:
            space = problem.displacement.function_space
            mesh = space.mesh
            solutions.start([space.dofmap.list, geometry_nodes(mesh), mesh.geometry.x])

    def solved(self, solve: Solve) -> NewtonOutcome:
        """Return the outcome of an attempt; the problem is left in the state that it found."""
        if self._solutions is None:
            return solve(lambda: None)
        known = self._solutions.next()
        if known is not None:
            return self._repeat(*known)
        path: list[Array] = []
        tangent = self._newton.tangent
        before = tangent.factorised_at
        outcome = solve(lambda: path.append(self._u.copy()))
        path.append(self._u)
        made = tangent.factorised and tangent.factorised_at is not before
        self._solutions.add(
            Solution(
                outcome=outcome,
                path=np.array(path if outcome.converged else path[:0]),
                linear_iterations=tangent.iterations,
                factorised=tangent.factorised,
                factorised_at=tangent.factorised_at if made else np.zeros(0),
            )
        )
        return outcome

    def _repeat(self, solution: Solution, factorise: bool) -> NewtonOutcome:
        """Repeat an attempt; if the run is to continue with its factors, make them again."""
        tangent = self._newton.tangent
        if not self._begun:
            tangent.begin()
            self._begun = True
        if factorise and not np.array_equal(tangent.factorised_at, solution.factorised_at):
            self._u[:] = solution.factorised_at
            tangent.factorise()
        for number, displacement in enumerate(solution.path):
            if number > 0:  # the last state is stored when the step is accepted
                self._problem.remember()
            self._u[:] = displacement
        tangent.iterations = solution.linear_iterations
        if not solution.factorised:
            tangent.forget()
        return solution.outcome

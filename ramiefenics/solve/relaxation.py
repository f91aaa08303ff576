"""Dynamic relaxation at a fixed position of the drive, from one equilibrium path to the next.

Where a path turns back, no equilibrium is left nearby, and a real structure jumps. The motion is
followed by ``M u'' + R(u) = 0`` and the backward Euler method, with time steps that grow as long as
they converge easily. Inertia keeps the solution of each step near the last one, the method
dissipates the kinetic energy, and the limit of long steps is equilibrium. Time steps are
proportional to the structure's own periods, so only the distribution of the mass matters, not its
amount. The path of the jump is one of many, but it ends in an equilibrium like any other.
"""

from __future__ import annotations

import math
from collections.abc import Callable

from mpi4py import MPI

from ramiefenics.solve.driven import Driven
from ramiefenics.solve.mass import lumped_mass
from ramiefenics.solve.newton import Inertia, Newton, NewtonOutcome

FIRST_SHARE = 1.0
"""Ratio of inertia to stiffness in the diagonal of the first time step's matrix. The step is so
short that it does not leap over a barrier to a farther equilibrium."""

EASY_ITERATIONS = 5
"""Largest number of iterations of a time step after which the next one is twice as long."""

MAX_TIME_STEPS = 100
"""Number of time steps, failed ones included, after which the relaxation fails."""

ENERGY_ERROR = 1e-3
"""Relative rise of the energy that does not yet count as motion uphill. Contact by Nitsche's method
conserves energy only up to what the mesh can resolve."""


class DynamicRelaxation:
    """Lets a structure move until it comes to rest.

    Parameters
    ----------
    problem
        The structure; its displacement is updated in place.
    newton
        Solver of its equations.
    """

    def __init__(self, problem: Driven, newton: Newton) -> None:
        self._problem, self._newton = problem, newton
        u = problem.displacement.x.petsc_vec
        self._mass = u.duplicate()
        self._mass.array = lumped_mass(problem)
        self._before, self._velocity, self._predicted, self._work = (
            u.duplicate() for _ in range(4)
        )

    def relax(
        self, tolerance_N: float, largest_update_mm: float, on_way: Callable[[], None]
    ) -> NewtonOutcome:
        """Move from rest until the residual without inertia meets the tolerance.

        Parameters
        ----------
        tolerance_N, largest_update_mm
            As for `Newton.solve`.
        on_way
            Called before friction and material store a state on the way.
        """
        u = self._problem.displacement.x.petsc_vec
        self._velocity.set(0.0)
        mean_mass = self._mass.sum() / self._mass.size
        first = time_step = math.sqrt(mean_mass / (FIRST_SHARE * self._newton.mean_stiffness()))
        energy, iterations, residual = math.inf, 0, math.inf
        for _ in range(MAX_TIME_STEPS):
            u.copy(self._before)
            self._predicted.waxpy(time_step, self._velocity, u)
            inertia = Inertia(self._mass, self._predicted, time_step)
            outcome = self._newton.solve(tolerance_N, largest_update_mm, inertia)
            iterations += outcome.iterations
            self._work.waxpy(-1.0, self._before, u)
            after = self._energy(time_step)
            # the energy of contact is not counted: where it pushes, even short steps show a rise
            uphill = time_step > first and after > energy * (1.0 + ENERGY_ERROR)
            if not outcome.converged or uphill:
                self._before.copy(u)
                self._problem.displacement.x.scatter_forward()
                time_step /= 4.0
                continue
            energy = after
            self._work.copy(self._velocity)
            self._velocity.scale(1.0 / time_step)
            if outcome.iterations <= EASY_ITERATIONS:
                time_step *= 2.0
            residual = self._newton.residual_norm()
            if residual <= tolerance_N:
                return NewtonOutcome(True, iterations, residual, "at rest")
            on_way()
            self._problem.remember()  # friction follows the path of the motion
        return NewtonOutcome(False, iterations, residual, "dynamic relaxation did not come to rest")

    def _energy(self, time_step: float) -> float:
        """Return stored plus kinetic energy after a time step, whose motion is in `_work`."""
        stored = self._problem.stored_energy()
        stored = self._mass.comm.tompi4py().allreduce(stored, op=MPI.SUM)
        self._predicted.pointwiseMult(self._mass, self._work)
        return float(stored + self._predicted.dot(self._work) / (2.0 * time_step**2))

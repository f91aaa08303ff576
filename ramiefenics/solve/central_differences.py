"""Central differences: motion of a structure with lumped mass under its own forces.

    M (v+ - v-) / dt = -R(u + beta dt v-),        u+ = u + dt v+

with the time step dt, the residual R, and velocities v half-way between the displacements u
(Belytschko, Liu and Moran 2000, section 6.2). The forces are those at the position that the
structure will reach after ``beta dt``. In a linear structure this adds the viscosity
``beta dt dR/du``, which damps a mode of the angular frequency omega by the share
``beta omega dt / 2`` of its critical damping, at no cost. With ``Omega = omega dt`` its amplitudes
obey

    u+ = (2 - Omega^2 (1 + beta)) u - (1 - Omega^2 beta) u-,

which stays bounded while ``Omega^2 (1 + 2 beta) <= 4``: the longest stable step is
``2 / (omega_max sqrt(1 + 2 beta))``, with the highest frequency omega_max, and Courant's for
``beta = 0``.

This hardly damps slow vibrations. They are damped instead by a drag ``c_v M (v - v_m)`` on the
difference between the velocity and its mean v_m over the past time T_m, which follows from the rate
``v_m' = (v - v_m) / T_m``. The drag acts on vibrations that are faster than T_m, and hardly on
slower motion (selective frequency damping: Akervik and others 2006, Physics of Fluids 18, 068102).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from dolfinx import fem
from mpi4py import MPI
from numpy.typing import NDArray

from ramiefenics.solve.tangent import DIFFERENCE_MM

LEAST_ITERATIONS, MOST_ITERATIONS = 12, 60
"""Least and greatest number of products with the tangent in one estimate of the highest frequency.
The least number lets a mode emerge that was not the highest before."""

RITZ_TOLERANCE = 0.02
"""Tolerance on the residual of the highest eigenvalue, omega_max^2, relative to that value. The
estimate is the sum of value and residual."""

Array = NDArray[np.float64]


class CentralDifferences:
    """Moves a structure step by step; collective.

    Parameters
    ----------
    u
        Displacement, mm; updated in place. Held components stay as they are.
    mass
        Lumped mass M, tonne, shape (n,): one entry per component that this rank owns.
    bcs
        Dirichlet conditions; their components are held.
    residual
        Function that returns the residual R at the current displacement, N, shape (n,). The next
        call may overwrite the array.
    viscosity
        Viscosity beta of the module's description.
    drag_per_s, smoothing_s
        Drag c_v and averaging time T_m of the module's description.

    Attributes
    ----------
    velocity
        Velocity before the next step, mm/s, shape (n,); may be set before the first one.
    time_s
        Time at the current displacement.
    kinetic_energy_Nmm
        Kinetic energy at the beginning of the last step.
    damping_work_Nmm
        Energy dissipated by viscosity and drag so far.
    evaluations
        Number of evaluations of the residual so far.
    """

    def __init__(
        self,
        u: fem.Function,
        mass: Array,
        bcs: list[fem.DirichletBC],
        residual: Callable[[], Array],
        viscosity: float = 0.0,
        drag_per_s: float = 0.0,
        smoothing_s: float = 1.0,
    ) -> None:
        self._u, self._mass, self._residual = u, mass, residual
        self.viscosity = viscosity
        self._drag, self._smoothing = drag_per_s, smoothing_s
        self._comm = u.function_space.mesh.comm
        self._inverse_mass = 1.0 / mass
        for bc in bcs:
            dofs, owned = bc.dof_indices()
            self._inverse_mass[dofs[:owned]] = 0.0
        self.velocity: Array = np.zeros_like(mass)
        self._smooth: Array = np.zeros_like(mass)
        self.time_s = self.kinetic_energy_Nmm = self.damping_work_Nmm = 0.0
        self.evaluations = 0
        self._last_step_s = 0.0  # the initial velocity is at the time of the displacement
        self._forces: Array | None = None
        self._ritz = np.random.default_rng(self._comm.rank).standard_normal(len(mass))

    def step(self, length_s: float, drive: Callable[[float], None] | None = None) -> None:
        """Take one time step.

        Parameters
        ----------
        length_s
            Length of the time step.
        drive
            Sets what acts on the structure to a time, s; called once, at non-decreasing times.
        """
        ahead = self.viscosity * length_s
        if drive is not None:
            drive(self.time_s + ahead)
        here = self._u.x.array.copy()
        self._move(ahead)
        forces = self._evaluate()
        self._u.x.array[:] = here
        before = self.velocity
        span = (self._last_step_s + length_s) / 2.0
        half = span * self._drag / 2.0  # drag acts on the velocity at mid-step
        pushed = span * (self._drag * self._smooth - self._inverse_mass * forces)
        self.velocity = np.asarray(((1.0 - half) * before + pushed) / (1.0 + half))
        middle = (before + self.velocity) / 2.0
        self.kinetic_energy_Nmm = self._sum(self._mass * middle**2) / 2.0
        if self._drag:
            fast = middle - self._smooth
            self.damping_work_Nmm += span * self._drag * self._sum(self._mass * middle * fast)
            self._smooth += min(span / self._smoothing, 1.0) * fast
        if self._forces is not None:  # the force changes by dt dR/du v, to first order
            self.damping_work_Nmm += ahead * self._sum(middle * (forces - self._forces))
        self._forces = forces
        self._move(length_s)
        self.time_s += length_s
        self._last_step_s = length_s

    def longest_step(self) -> float:
        """Return the longest stable step, s, from the highest frequency at the current state."""
        frequency = self.highest_frequency()
        return 2.0 / (frequency * math.sqrt(1.0 + 2.0 * self.viscosity))

    def highest_frequency(self) -> float:
        """Estimate the highest angular frequency omega_max at the current state, 1/s.

        The method is Arnoldi's (1951), as the tangent of contact is not symmetric. It starts from
        the result of the last estimate, and applies the tangent as a difference quotient of the
        residual. The residual of the largest Ritz value is added to that value; in a symmetric
        matrix it bounds the distance to the nearest eigenvalue (Parlett 1998, theorem 4.5.1).
        """
        scale = np.sqrt(self._inverse_mass)
        here, forces = self._u.x.array.copy(), self._evaluate()
        basis = np.zeros((MOST_ITERATIONS + 1, len(scale)))
        projected = np.zeros((MOST_ITERATIONS + 1, MOST_ITERATIONS))
        basis[0] = self._start(scale)
        for k in range(MOST_ITERATIONS):
            product = scale * self._tangent(scale * basis[k], here, forces)
            for _ in range(2):  # twice, to remove rounding errors
                share = self._sums(basis[: k + 1] @ product)
                projected[: k + 1, k] += share
                product -= share @ basis[: k + 1]
            size = projected[k + 1, k] = math.sqrt(self._sum(product**2))
            values, vectors = np.linalg.eig(projected[: k + 1, : k + 1])
            highest = int(np.argmax(np.abs(values)))
            value, error = abs(values[highest]), size * abs(vectors[k, highest])
            exhausted = size <= 1e-9 * value
            if exhausted or (k + 1 >= LEAST_ITERATIONS and error <= RITZ_TOLERANCE * value):
                break
            basis[k + 1] = product / size
        self._ritz = np.real(vectors[:, highest]) @ basis[: k + 1]
        self._u.x.array[:] = here
        return math.sqrt(value + error)

    def _start(self, scale: Array) -> Array:
        """Return the last Ritz vector plus half as much noise, which contains all modes."""
        seed = (self.evaluations, self._comm.rank)
        noise = np.random.default_rng(seed).standard_normal(len(scale)) * (scale > 0.0)
        last = self._ritz * (scale > 0.0)
        start = last / math.sqrt(self._sum(last**2)) + noise / math.sqrt(4.0 * self._sum(noise**2))
        return np.asarray(start / math.sqrt(self._sum(start**2)))

    def _tangent(self, direction: Array, here: Array, forces: Array) -> Array:
        """Apply the tangent at the state `here`, where `forces` act."""
        largest = self._comm.allreduce(np.abs(direction).max(initial=0.0), op=MPI.MAX)
        step = DIFFERENCE_MM / largest
        self._u.x.array[:] = here
        self._u.x.array[: len(direction)] += step * direction
        self._u.x.scatter_forward()
        return (self._evaluate() - forces) / step

    def _move(self, duration_s: float) -> None:
        """Advance the displacement with the current velocity."""
        if duration_s:
            self._u.x.array[: len(self.velocity)] += duration_s * self.velocity
            self._u.x.scatter_forward()

    def _evaluate(self) -> Array:
        self.evaluations += 1
        return self._residual().copy()

    def _sum(self, values: Array) -> float:
        return float(self._comm.allreduce(values.sum(), op=MPI.SUM))

    def _sums(self, values: Array) -> Array:
        total: Any = self._comm.allreduce(values, op=MPI.SUM)
        return np.asarray(total)

"""Bending test with inertia in explicit time steps, as a check of the quasi-static result.

The indenter's velocity rises by the smooth step ``10 x^3 - 15 x^4 + 6 x^5``, where x is the time
over that of the rise, and then stays constant. So many steps are needed that its travel in one of
them is far below any length of the problem.
"""

from __future__ import annotations

import dataclasses
import logging
import time
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
from dolfinx import la
from mpi4py import MPI

from ramiefenics.model.bending import BendingProblem
from ramiefenics.model.observables import Observer
from ramiefenics.model.tube import TubeMesh
from ramiefenics.solve.central_differences import Array, CentralDifferences
from ramiefenics.solve.explicit_result import (
    START,
    ExplicitResult,
    ExplicitStatistics,
    Point,
    tabulate,
)
from ramiefenics.solve.interrupt import StopRequest, stop_on_interrupt
from ramiefenics.solve.mass import lumped_mass
from ramiefenics.solve.quasistatic import Ending
from ramiefenics.solve.rest import come_to_rest
from ramiefenics.specification import SpecificationError
from ramiefenics.specification.sources import Source, as_test

log = logging.getLogger(__name__)

INTERVAL_MM = 0.1
"""Travel between the points of the curve, at which the longest stable step and the stabilisation of
contact are updated."""

SMOOTHING = 0.05
"""Share of the test over which the velocity is averaged; drag acts on deviations from the mean."""

SAMPLED_STEPS = 20
"""Number of steps between two checks for an interrupt by the user."""

START_ENERGY_ERROR = 0.5
"""Share of the energy that may appear or vanish at the start. There is little energy then, and
contact stores part of it, uncounted, in the gaps that it leaves. An instability soon produces more
energy than there was."""


ROUNDING_NMM = 1e-9
"""Energy that may result from rounding of a stalk's stress at rest, before anything touches it."""


class SmoothStart:
    """Travel of the indenter over time.

    Parameters
    ----------
    travel_mm, duration_s
        Travel and duration of the whole test.
    ramp
        Share of the duration in which the velocity rises.

    Attributes
    ----------
    speed_mm_per_s
        Velocity after the rise.
    """

    def __init__(self, travel_mm: float, duration_s: float, ramp: float) -> None:
        self._ramp_s = ramp * duration_s
        self.speed_mm_per_s = travel_mm / (duration_s - self._ramp_s / 2.0)

    def travel(self, time_s: float) -> float:
        """Return the travel at a time, mm: the integral of the smooth step, then linear."""
        x = min(time_s / self._ramp_s, 1.0)
        rising = self._ramp_s * x**4 * (2.5 - 3.0 * x + x**2)
        return self.speed_mm_per_s * (rising + max(time_s - self._ramp_s, 0.0))


class ExplicitTest:
    """A stalk between its cylinders, moved by central differences.

    Parameters
    ----------
    problem
        The problem, at rest.

    Attributes
    ----------
    mass
        Lumped and scaled mass, tonne, as `CentralDifferences` takes it.
    motion, drive
        Motion of the stalk, and of the indenter.
    steps, time_steps_s
        Number of steps so far, and their lengths between successive points of the curve.
    ending
        Why the test ended; None until then.
    """

    def __init__(self, problem: BendingProblem) -> None:
        self._problem, self._protocol = problem, problem.test.protocol
        self._settings = settings = problem.test.numerics.explicit
        self._observer = Observer(problem)
        self._solid, self._contact, *self._others = problem.terms
        self._total = la.vector(
            problem.solid.space.dofmap.index_map, problem.solid.space.dofmap.index_map_bs
        )
        self._nodes = [
            (obstacle.cylinder.moves, nodes)
            for obstacle, nodes in zip(
                problem.contact.obstacles, problem.contact.nodes(), strict=True
            )
        ]
        self.mass = settings.mass_factor * lumped_mass(problem)
        self.motion = CentralDifferences(
            problem.displacement,
            self.mass,
            problem.bcs,
            self._residual,
            settings.viscosity,
            settings.drag / settings.duration_s,
            SMOOTHING * settings.duration_s,
        )
        self.drive = SmoothStart(self._protocol.travel_mm, settings.duration_s, settings.ramp)
        self._pushed_mm = self._push_mm = 0.0  # total so far, and in this step
        self._pushed_s = 0.0
        # forces of the moving and of the fixed cylinders: as last evaluated, at the last step, and
        # integrated over the travel
        self._evaluated_N: Array = np.zeros(2)
        self._forces_N: Array = np.zeros(2)
        self._integrals_Nmm: Array = np.zeros(2)
        self._stored_Nmm = self._stored_energy()  # at rest
        self._energy_Nmm = 0.0  # largest so far, to which errors refer
        self.steps = 0
        self.time_steps_s: list[float] = []
        self.ending: Ending | None = None

    def points(self, request: StopRequest) -> Iterator[Point]:
        """Yield the state at rest, then the points of the curve, until `ending` is set."""
        yield self._measure(0.0)
        total = self._protocol.travel_mm
        for target in np.linspace(0.0, total, max(4, round(total / INTERVAL_MM)) + 1)[1:]:
            self._problem.contact.update_stabilisation()
            length = self._settings.step_share * self.motion.longest_step()
            self.time_steps_s.append(length)
            stopped = self._advance(target - 1e-9 * total, length, request)
            point = self._measure(length)
            self.ending = self._ending(point, stopped)
            yield point
            if self.ending is not None:
                return

    def _advance(self, target: float, length: float, request: StopRequest) -> bool:
        """Take steps until a travel is reached; return whether the user asked to stop."""
        while self.drive.travel(self.motion.time_s) < target:
            left = self._settings.duration_s - self.motion.time_s
            with np.errstate(all="ignore"):  # an unstable run is detected by its energy
                self.motion.step(min(length, left), self._push)
                self._sum_up()
            if self.steps % SAMPLED_STEPS == 0 and request.agreed():
                return True
        return False

    def _push(self, time_s: float) -> None:
        """Move the indenter to its position at a given time."""
        self._push_mm = self.drive.travel(time_s) - self._pushed_mm
        self._pushed_mm += self._push_mm
        self._problem.remember()
        self._problem.place(self._push_mm, time_s - self._pushed_s)
        self._pushed_s = time_s

    def _residual(self) -> Array:
        """Evaluate the residual and, on the way, this rank's part of the cylinders' forces."""
        self._total.array[:] = 0.0
        self._contact.add_forces(self._total.array)
        vertical = self._total.array.reshape(-1, 3)[:, 1]
        pressed, borne = 0.0, 0.0
        for moves, nodes in self._nodes:
            force = float(vertical[nodes].sum())
            pressed, borne = (pressed + force, borne) if moves else (pressed, borne - force)
        self._evaluated_N = self._problem.factor * np.array([pressed, borne])
        for term in (self._solid, *self._others):
            term.add_forces(self._total.array)
        self._total.scatter_reverse(la.InsertMode.add)
        return self._total.array[: len(self.mass)]

    def _sum_up(self) -> None:
        """Add the work of the last step; its forces are those of the last residual evaluated."""
        self.steps += 1
        before, self._forces_N = self._forces_N, self._evaluated_N
        mean = (before + self._forces_N) / 2.0
        self._integrals_Nmm = self._integrals_Nmm + mean * self._push_mm

    def _stored_energy(self) -> float:
        stored = self._problem.tube.mesh.comm.allreduce(self._problem.stored_energy(), op=MPI.SUM)
        return float(stored * self._problem.factor)

    def _measure(self, time_step_s: float) -> Point:
        comm, factor = self._problem.tube.mesh.comm, self._problem.factor
        measured, travel = self._observer.observe(), self.drive.travel(self.motion.time_s)
        rest = self._forces_N * (travel - self._pushed_mm)  # since the last push
        work, supports = comm.allreduce(self._integrals_Nmm + rest, op=MPI.SUM)
        kinetic = factor * self.motion.kinetic_energy_Nmm
        damping = factor * self.motion.damping_work_Nmm
        held = kinetic + measured.stored_energy_Nmm - self._stored_Nmm
        scales = self._energy_Nmm, abs(work), abs(held), abs(measured.force_N) * travel
        self._energy_Nmm = float(np.max(scales))  # NaN stays NaN
        spent = measured.friction_work_Nmm + measured.dissipated_Nmm
        missing = work - held - spent - damping
        felt = not self._energy_Nmm <= ROUNDING_NMM  # NaN included
        return Point(
            time_s=self.motion.time_s,
            travel_mm=travel,
            time_step_s=time_step_s,
            observables=measured,
            kinetic_energy_Nmm=kinetic,
            indenter_work_Nmm=float(work),
            support_integral_Nmm=float(supports),
            damping_work_Nmm=damping,
            energy_error=float(missing) / self._energy_Nmm if felt else 0.0,
        )

    def _ending(self, point: Point, stopped: bool) -> Ending | None:
        at = f"at {point.travel_mm:.3f} mm of travel"
        started = point.travel_mm > START * self._protocol.travel_mm
        limit = self._settings.max_energy_error if started else START_ENERGY_ERROR
        if not abs(point.energy_error) <= limit:  # NaN included
            what = "vanished" if point.energy_error > 0.0 else "appeared"
            share = f"{100 * abs(point.energy_error):.3g} % of the energy has {what} {at}"
            cause = "the time steps are too long, or the viscosity is too small"
            return Ending("energy", f"{share}, more than the {100 * limit:g} % allowed: {cause}")
        measured = point.observables
        if measured.overhang_mm <= 0.0:
            return Ending("physical", f"{measured.physical_end()}, {at}")
        if stopped:
            return Ending("interrupted", f"interrupted {at}")
        reached = point.travel_mm >= self._protocol.travel_mm * (1.0 - 1e-9)
        return Ending("completed") if reached else None


def simulate_explicitly(
    test: Source = "table3",
    comm: MPI.Comm | None = None,
    on_point: Callable[[Point], None] | None = None,
    tube: TubeMesh | None = None,
    **changes: Any,
) -> ExplicitResult:
    """Simulate the bending of a stalk with inertia, with the settings in ``numerics.explicit``.

    The first Ctrl-C ends the run, and the result holds everything up to there. Only `simulate`
    searches for a loss of ellipticity.

    Parameters
    ----------
    test
        The specification, its TOML file, or the name of a published one.
    comm
        MPI communicator, all of whose ranks call; the world by default.
    on_point
        Called at every point of the curve, on all ranks.
    tube
        Mesh of the stalk to use in place of the recipe's.
    changes
        Changes to the specification, see `as_test`.

    Raises
    ------
    SpecificationError
        If the law cannot take a layer's constants, the path is more than a single loading, or the
        bond of the layers is not perfect.
    """
    comm = MPI.COMM_WORLD if comm is None else comm
    test = as_test(test, **changes).alone
    test.protocol.check_loading_only("explicit runs")
    if not test.stalk.bond.perfect:
        compliance = test.stalk.bond.compliance_mm_per_MPa
        allowed = "must be 0 for explicit runs, because a thin film requires very short time steps"
        raise SpecificationError("stalk.bond.compliance_mm_per_MPa", compliance, allowed)
    start = time.perf_counter()
    unsearched = dataclasses.replace(test.numerics, acoustic_check=False)
    problem = BendingProblem(dataclasses.replace(test, numerics=unsearched), comm, tube)
    come_to_rest(problem)
    moving = ExplicitTest(problem)
    log.info("%d unknowns, law %s, %d ranks", problem.unknowns, test.law, comm.size)
    points: list[Point] = []
    with stop_on_interrupt(comm) as request:
        for point in moving.points(request):
            points.append(point)
            force = point.observables.force_N
            log.info("%.6f s, %.4f mm: %.4f N", point.time_s, point.travel_mm, force)
            if on_point is not None:
                on_point(point)
    assert moving.ending is not None  # otherwise the points would go on
    cells = problem.tube.mesh.topology.index_map(problem.tube.mesh.topology.dim)
    tonnes = problem.factor * float(comm.allreduce(moving.mass.sum(), op=MPI.SUM)) / 3.0
    mass_g = 1e6 * tonnes
    statistics = ExplicitStatistics(
        dofs=problem.unknowns,
        cells=int(cells.size_global),
        steps=moving.steps,
        evaluations=moving.motion.evaluations,
        least_time_step_s=min(moving.time_steps_s),
        greatest_time_step_s=max(moving.time_steps_s),
        speed_mm_per_s=moving.drive.speed_mm_per_s,
        mass_g=mass_g,
        added_mass_g=mass_g * (1.0 - 1.0 / test.numerics.explicit.mass_factor),
        wall_s=time.perf_counter() - start,
        ranks=comm.size,
    )
    return ExplicitResult(test, tabulate(test, points), statistics, moving.ending)

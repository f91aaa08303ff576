"""Jumps: the von Mises truss, whose solution is known, and bends whose material collapses."""

from __future__ import annotations

import gc
import weakref
from dataclasses import dataclass

import basix.ufl
import numpy as np
import pytest
import ufl
from dolfinx import fem
from dolfinx import mesh as dmesh
from mpi4py import MPI

from ramiefenics import BendingTest, SpecificationError, override, sensitivities, simulate
from ramiefenics.model.bending import BendingProblem
from ramiefenics.model.equations import Equations, FormTerm
from ramiefenics.model.observables import Observer
from ramiefenics.solve.mass import lumped_mass
from ramiefenics.solve.newton import Newton
from ramiefenics.solve.quasistatic import QuasiStatic, Step
from ramiefenics.solve.relaxation import DynamicRelaxation
from ramiefenics.specification import Protocol, Stepping

RISE, HALF_SPAN, AXIAL_STIFFNESS_N = 1.0, 10.0, 4000.0
LENGTH = np.hypot(RISE, HALF_SPAN)
SCALE = AXIAL_STIFFNESS_N / (2 * LENGTH**3)
SPRING = 0.2 * SCALE * RISE**2  # a fifth of the stiffness that would prevent a jump


def truss_force(w: np.ndarray) -> np.ndarray:
    """Return the force on a bar's apex at descent w; Green strain is (w^2 - 2 h w) / (2 L^2)."""
    return SCALE * w * (w - 2 * RISE) * (w - RISE)


def energy(w: float, d: float) -> float:
    strain = (w**2 - 2 * RISE * w) / (2 * LENGTH**2)
    return AXIAL_STIFFNESS_N * LENGTH * strain**2 / 2 + SPRING * (d - w) ** 2 / 2


@dataclass(frozen=True)
class Reading:
    """Observed state of the truss and its spring."""

    force_N: float
    stored_energy_Nmm: float
    apex_mm: float
    friction_work_Nmm: float = 0.0
    dissipated_Nmm: float = 0.0
    misses_contact: bool = False

    def physical_end(self) -> str | None:
        return None


class Truss:
    """Half of a von Mises truss, pushed down by a spring soft enough for it to snap through."""

    factor = 1.0

    def __init__(self) -> None:
        line = basix.ufl.element("Lagrange", "interval", 1, shape=(2,))
        points = np.array([[0.0, 0.0], [HALF_SPAN, RISE]])
        cells = np.array([[0, 1]], dtype=np.int64)
        mesh = dmesh.create_mesh(MPI.COMM_SELF, cells, x=points, e=line)
        space = fem.functionspace(mesh, ("Lagrange", 1, (2,)))
        self.displacement = u = fem.Function(space)
        apex = dmesh.locate_entities(mesh, 0, lambda x: x[0] > HALF_SPAN / 2)
        base = dmesh.locate_entities(mesh, 0, lambda x: x[0] < HALF_SPAN / 2)
        tags = dmesh.meshtags(mesh, 0, apex, np.ones(len(apex), dtype=np.int32))
        at_apex = ufl.ds(mesh, subdomain_data=tags)(1)
        self.target, self.last = fem.Constant(mesh, 0.0), 0.0
        along = ufl.as_vector((HALF_SPAN / LENGTH, RISE / LENGTH))
        change = ufl.grad(u) * along
        strain = ufl.dot(along, change) + ufl.dot(change, change) / 2
        spring = SPRING / 2 * (self.target + u[1]) ** 2 * at_apex
        stored = AXIAL_STIFFNESS_N / 2 * strain**2 * ufl.dx + spring
        v, du = ufl.TestFunction(space), ufl.TrialFunction(space)
        self._energy = fem.form(stored)
        self.mass = fem.form(1e-6 * ufl.inner(du, v) * ufl.dx)
        fixed = fem.locate_dofs_topological(space, 0, base)
        guided = fem.locate_dofs_topological(space.sub(0), 0, apex)
        self._apex = fem.locate_dofs_topological(space.sub(1), 0, apex)
        bcs = [
            fem.dirichletbc(np.zeros(2), fixed, space),
            fem.dirichletbc(np.array(0.0), guided, space.sub(0)),
        ]
        self.equations = Equations(u, [FormTerm(ufl.derivative(stored, u, v), u)], bcs)

    def place(self, travel: float, duration_s: float) -> None:
        self.target.value = self.last + travel

    def first_guess(self, travel: float) -> None:
        pass

    def remember(self) -> None:
        pass

    def stored_energy(self) -> float:
        return float(fem.assemble_scalar(self._energy))

    def accept(self) -> None:
        self.last = float(self.target.value)

    def observe(self) -> Reading:
        w = -float(self.displacement.x.array[self._apex[0]])
        force = SPRING * (float(self.target.value) - w)
        return Reading(force, self.stored_energy(), w)


def test_truss_snaps_through_where_and_as_far_as_it_must() -> None:
    """d = w + F(w)/k has a fold at w1; the jump ends at the cubic's other root w2 = 3 h - 2 w1."""
    share = SPRING / SCALE
    w1 = RISE - np.sqrt((RISE**2 - share) / 3)
    w2 = 3 * RISE - 2 * w1
    fold = w1 + truss_force(w1) / SPRING
    assert w2 + truss_force(w2) / SPRING == pytest.approx(fold)
    released = energy(w1, fold) - energy(w2, fold)

    truss = Truss()
    stepping = Stepping(0.02, 0.05, 0.002, relative_tolerance=1e-6)
    travel = Protocol(travel_mm=round(fold + 0.5, 1), save_every_mm=1.0)
    stepper = QuasiStatic(truss, truss.observe, travel, stepping)
    steps: list[Step[Reading]] = list(stepper.steps())

    assert stepper.ending is not None
    assert stepper.ending.kind == "completed"
    for step in steps:  # each is an equilibrium
        w = step.observables.apex_mm
        assert w + truss_force(w) / SPRING == pytest.approx(step.travel_mm, abs=1e-5)
    (jump,) = [step.jump for step in steps if step.jump is not None]
    # found to within the smallest step, at most twice min_step_mm
    assert fold < jump.displacement_mm < fold + 0.004
    # up to that step beyond the fold: the energy grows by the force drop times the overshoot
    assert jump.energy_released_Nmm == pytest.approx(released, rel=0.02)
    apex = {step.travel_mm: step.observables.apex_mm for step in steps}
    before = [w for d, w in apex.items() if d < jump.displacement_mm]
    after = [w for d, w in apex.items() if d >= jump.displacement_mm]
    assert max(before) < w1
    assert min(after) > w2


class PushedTruss(Truss):
    """A truss whose stored energy leaves out the spring, as a bend's leaves out the contact."""

    def stored_energy(self) -> float:
        return super().stored_energy() - SPRING * self.stretch() ** 2 / 2

    def stretch(self) -> float:
        return float(self.target.value) + float(self.displacement.x.array[self._apex[0]])


def test_dynamic_relaxation_lets_itself_be_pushed() -> None:
    """It starts at rest, pushed far down: external work must not be mistaken for a barrier."""
    truss, push = PushedTruss(), 2.7
    truss.place(push, 1.0)
    newton = Newton(truss.equations, max_iterations=20)
    outcome = DynamicRelaxation(truss, newton).relax(1e-8, 4.0, lambda: None)
    assert outcome.converged, outcome.reason
    w = push - truss.stretch()
    assert w + truss_force(w) / SPRING == pytest.approx(push, abs=1e-6)
    assert w > 2 * RISE  # through the snap


@pytest.mark.slow
def test_published_law_gets_beyond_its_first_collapse(screening: BendingTest) -> None:
    """Its phloem collapses under the indenter at 2 mm, and the run goes on."""
    changes = ["law=svk", "numerics.mesh=ladder_q1_1", "protocol.travel_mm=3"]
    result = simulate(override(screening, changes), MPI.COMM_SELF)
    assert result.completed, result.ending
    curve = result.curve
    assert np.abs(curve["force_N"] - curve["support_force_N"]).max() < 1e-3 * result.max_force_N


@pytest.mark.slow
def test_derivatives_may_refuse_a_jump(screening: BendingTest) -> None:
    """If jumps are not allowed, an error gives the displacement of the first."""
    changes = ["law=svk", "numerics.mesh=ladder_q1_1", "protocol.travel_mm=3"]
    with pytest.raises(SpecificationError, match=r"displacement_mm = .*jump"):
        sensitivities(override(screening, changes), {}, MPI.COMM_SELF, jumps=False)


@pytest.mark.slow
def test_collapsing_bend_jumps_and_relaxes(screening: BendingTest) -> None:
    """With the neo-Hookean law the phloem kinks suddenly; when it does depends on the mesh."""
    changes = ["law=neo_hookean", "numerics.mesh=ladder_q1_1", "numerics.mesh.contact_size=0.015"]
    result = simulate(override(screening, changes), MPI.COMM_SELF)
    assert result.completed
    assert result.jumps
    largest = max(result.jumps, key=lambda jump: jump.energy_released_Nmm)
    assert largest.force_after_N < 0.95 * largest.force_before_N
    curve = result.curve
    assert np.abs(curve["force_N"] - curve["support_force_N"]).max() < 1e-3 * result.max_force_N
    assert result.losses_mm["ellipticity"] < largest.displacement_mm


@pytest.mark.slow
def test_stick_and_slip_relaxes_on_serendipity_elements(screening: BendingTest) -> None:
    """Friction that weakens faster than the stalk unloads breaks loose; the stalk comes to rest.

    The row sums of the mass matrix of these elements are negative at their corners.
    """
    changes = [
        "fixture.friction.weakening_mm=0.1",
        "numerics.contact.presliding_mm=0.005",
        "numerics.stepping.max_step_mm=0.25",
        "numerics.stepping.first_step_mm=0.25",
        "numerics.acoustic_check=false",
        "protocol.travel_mm=12.5",
    ]
    result = simulate(override(screening, changes), MPI.COMM_SELF)
    assert result.completed
    curve = result.curve
    assert np.abs(curve["force_N"] - curve["support_force_N"]).max() < 1e-3 * result.max_force_N
    assert curve["friction_work_Nmm"].diff().min() >= 0.0


def test_stepper_and_its_factors_are_freed() -> None:
    """PETSc's Python matrices could hide reference cycles from the garbage collector."""
    truss = Truss()
    stepper = QuasiStatic(truss, truss.observe, Protocol(travel_mm=0.1), Stepping())
    assert len(list(stepper.steps())) > 1
    left = weakref.ref(truss)
    del stepper, truss
    gc.collect()
    assert left() is None


@pytest.mark.mpi
def test_dynamic_relaxation_ends_where_newton_arrives(coarse: BendingTest) -> None:
    """Pushed by 0.5 mm from rest, the stalk reaches its only equilibrium.

    There is no friction, with which the equilibrium would depend on the path.
    """
    smooth = ["fixture.friction.static=0", "fixture.friction.dynamic=0"]
    coarse = override(coarse, smooth)
    problem = BendingProblem(coarse, MPI.COMM_WORLD)
    newton = Newton(problem.equations, max_iterations=20)
    problem.place(0.5, 0.5)
    problem.first_guess(0.5)
    tolerance = 1e-6
    outcome = DynamicRelaxation(problem, newton).relax(tolerance, 4.0, lambda: None)
    assert outcome.converged
    assert newton.residual_norm() <= tolerance
    relaxed = Observer(problem).observe().force_N
    usual = simulate(override(coarse, ["protocol.travel_mm=0.5"])).curve["force_N"].iloc[-1]
    assert relaxed == pytest.approx(usual, rel=1e-4)


def test_mass_is_density_times_volume(coarse: BendingTest) -> None:
    problem = BendingProblem(coarse, MPI.COMM_SELF)
    per_direction = lumped_mass(problem).reshape(-1, 3).sum(axis=0)
    stalk = coarse.stalk
    areas = np.pi * np.diff(np.array(stalk.radii_mm) ** 2)
    densities = [1e-9 * layer.material.density_g_per_cm3 for layer in stalk.layers]
    exact = np.dot(areas, densities) * stalk.length_mm / problem.factor
    # 6 straight edges along half the circumference miss 4.5 % of the circle
    assert per_direction == pytest.approx(exact, rel=0.05)

"""Rejected steps leave no trace in the memory of the material, here a bar of plastic fibres."""

from __future__ import annotations

import dataclasses
from collections import Counter
from collections.abc import Callable, Mapping

import numpy as np
import pytest
import ufl
from dolfinx import fem

from ramiefenics.model.equations import Equations, FormTerm
from ramiefenics.model.jit import compile_form
from ramiefenics.model.laws import LAWS, Law, Memory
from ramiefenics.model.laws.base import Expr, State
from ramiefenics.model.laws.saint_venant_kirchhoff import SAINT_VENANT_KIRCHHOFF as SVK
from ramiefenics.model.solid import Solid
from ramiefenics.published.stalks import XYLEM
from ramiefenics.solve.newton import NewtonOutcome
from ramiefenics.solve.quasistatic import QuasiStatic
from ramiefenics.specification import Protocol, Stepping
from ramiefenics.specification.protocol import Target
from ramiefenics.verification.block import block, hold, layers, on_planes

YIELD, MIDDLE = 0.01, (0.5, 0.5, 0.5)
SHORTEST_MM = 1e-4

BED = 1e5
"""Stiffness of the bed that presses the bar, MPa/mm."""


def strain(F: Expr) -> Expr:
    """Return Green's strain along the fibres."""
    return (ufl.dot(F[:, 2], F[:, 2]) - 1) / 2


def energy(F: Expr, p: Mapping[str, Expr], state: State) -> Expr:
    e = strain(F)
    return SVK.energy(F, p) + p["G_XZ"] * ((e - state["plastic"]) ** 2 - e**2)


def update(F: Expr, p: Mapping[str, Expr], last: State, duration: Expr) -> State:
    elastic = ufl.max_value(ufl.min_value(strain(F) - last["plastic"], YIELD), -YIELD)
    return {"plastic": strain(F) - elastic}


PLASTIC = Law("plastic", SVK.parameters, energy, memory=Memory({"plastic": 0.0}, update))


@dataclasses.dataclass(frozen=True)
class Reading:
    """Observed state of the bar and the bed."""

    force_N: float
    stored_energy_Nmm: float
    dissipated_Nmm: float
    friction_work_Nmm: float = 0.0
    misses_contact: bool = False

    def missed_contact(self) -> str:
        return ""

    def physical_end(self) -> str | None:
        return None


class Bar:
    """A cube of 1 mm on a plane, pressed along its fibres."""

    factor = 1.0

    def __init__(self) -> None:
        mesh = block(*(np.array([0.0, 1.0]),) * 3)
        self.solid = solid = Solid(mesh, layers(mesh), [XYLEM], "plastic")
        bcs = [hold(solid, on_planes(mesh, axis, 0.0), axis) for axis in range(3)]
        self.target, self.last_mm = fem.Constant(mesh, 0.0), 0.0
        self.displacement = u = solid.displacement
        v, du = ufl.TestFunction(solid.space), ufl.TrialFunction(solid.space)
        up = ufl.conditional(ufl.gt(ufl.FacetNormal(mesh)[2], 0.5), 1.0, 0.0)
        pressure = BED * up * (self.target + u[2])
        self.equations = Equations(u, [solid.term(), FormTerm(pressure * v[2] * ufl.ds, u)], bcs)
        self._bed = compile_form(BED / 2 * up * (self.target + u[2]) ** 2 * ufl.ds)
        self.mass = compile_form(solid.density * ufl.inner(du, v) * solid.dx)
        self._force = compile_form(pressure * ufl.ds)
        self.accepted = [self.remembered]

    def place(self, travel: float, duration_s: float) -> None:
        self.solid.duration.value = duration_s
        self.target.value = self.last_mm + travel

    def first_guess(self, travel: float) -> None:
        pass

    def remember(self) -> None:
        self.solid.remember()

    def accept(self) -> None:
        self.remember()
        self.last_mm = float(self.target.value)
        self.accepted.append(self.remembered)

    def observe(self) -> Reading:
        force = float(fem.assemble_scalar(self._force))
        return Reading(force, self.stored_energy(), self.solid.energies()[1])

    def stored_energy(self) -> float:
        return self.solid.energies()[0] + float(fem.assemble_scalar(self._bed))

    @property
    def remembered(self) -> bytes:
        """Memory of the material from before the step."""
        assert self.solid._memory is not None
        return self.solid._memory.numbers.tobytes()

    def plastic(self, *points: tuple[float, float, float]) -> np.ndarray:
        """Return the plastic strain of the current state."""
        values = self.solid.internal_variables(np.array(points), np.zeros(1, dtype=np.int32))
        assert list(values) == ["plastic", "dissipated_Nmm_per_mm3"]
        return values["plastic"][0]


@dataclasses.dataclass(frozen=True)
class Pressed:
    """A bar at the end of its path, the readings on the way, and the number of cut-backs."""

    bar: Bar
    readings: list[Reading]
    cut_backs: int


@pytest.fixture
def press(monkeypatch: pytest.MonkeyPatch) -> Callable[[int], Pressed]:
    """Press and partly unload a bar; report a number of solves of each step as failed."""
    monkeypatch.setitem(LAWS, "plastic", PLASTIC)

    def run(refusals: int) -> Pressed:
        bar = Bar()
        path = Protocol(0.06, save_every_mm=0.06, then=(Target(to_mm=0.03),))
        settings = Stepping(first_step_mm=0.02, max_step_mm=0.02, min_step_mm=SHORTEST_MM)
        stepper = QuasiStatic(bar, bar.observe, path, settings)
        solve, tried = stepper.newton.solve, Counter[int]()

        def solve_and_refuse(*arguments: float) -> NewtonOutcome:
            outcome = solve(*arguments)
            assert outcome.converged
            assert bar.remembered == bar.accepted[-1]
            tried[len(bar.accepted)] += 1
            # a step that cannot be cut is relaxed dynamically, which advances the material
            push = abs(float(bar.target.value) - bar.last_mm)
            refused = tried[len(bar.accepted)] <= refusals and push > 10 * SHORTEST_MM
            return dataclasses.replace(outcome, converged=not refused)

        monkeypatch.setattr(stepper.newton, "solve", solve_and_refuse)
        readings = []
        for step in stepper.steps():
            assert bar.remembered == bar.accepted[-1]
            readings.append(step.observables)
        assert stepper.ending is not None
        assert stepper.ending.kind == "completed"
        return Pressed(bar, readings, stepper.cut_backs)

    return run


def test_the_state_advances_with_accepted_steps_alone(press: Callable[[int], Pressed]) -> None:
    """`press` asserts this to the last bit after every solve, refused or not."""
    smooth, cut = press(0), press(1)
    assert cut.cut_backs > smooth.cut_backs + 5
    # a bar pressed in one direction follows its path exactly, in steps of any length
    assert cut.readings[-1].force_N == pytest.approx(smooth.readings[-1].force_N, rel=1e-4)
    assert cut.bar.plastic(MIDDLE) == pytest.approx(smooth.bar.plastic(MIDDLE), rel=1e-4)
    # backward Euler with a force that changes by hardening: first order in the steps
    lost = smooth.readings[-1].dissipated_Nmm
    assert cut.readings[-1].dissipated_Nmm == pytest.approx(lost, rel=0.05)
    assert np.diff([one.dissipated_Nmm for one in cut.readings]).min() >= 0.0


def test_fields_show_the_state_between_the_quadrature_points(
    press: Callable[[int], Pressed],
) -> None:
    pressed = press(0)
    # back at the stretch 0.97, except for the compliance of the bed, it has yielded in tension
    strain = (0.97**2 - 1) / 2
    values = pressed.bar.plastic(MIDDLE, (0.1, 0.9, 0.3))
    assert values == pytest.approx(strain - YIELD, rel=0.005)
    assert np.ptp(values) < 1e-9

"""Generated C code, against UFL's own derivatives and the form compiler, for every law."""

from __future__ import annotations

import logging
import math
import operator
from collections.abc import Callable
from pathlib import Path
from typing import Any

import basix.ufl
import numpy as np
import pytest
import ufl
from dolfinx import fem
from dolfinx import mesh as dmesh
from mpi4py import MPI
from numpy.typing import NDArray
from ufl.algorithms.apply_algebra_lowering import apply_algebra_lowering
from ufl.algorithms.apply_derivatives import apply_derivatives
from ufl.utils.stacks import StackDict

from ramiefenics import BendingTest, Material, override
from ramiefenics.model.bending import BendingProblem
from ramiefenics.model.equations import Equations, FormTerm, Term
from ramiefenics.model.jit import compile_form
from ramiefenics.model.kernels.lowering import Lowering
from ramiefenics.model.kernels.points import PointKernel
from ramiefenics.model.kernels.scalars import Graph
from ramiefenics.model.kernels.term import KernelTerm
from ramiefenics.model.laws import LAWS, Law, law_named
from ramiefenics.model.laws.saturating_fibre import SATURATING_FIBRE
from ramiefenics.model.local_law import FIBRE_X, FIBRE_Y, STIFFNESS, STRETCH, WIDTH
from ramiefenics.model.material_memory import point_element
from ramiefenics.model.observables import Observer
from ramiefenics.model.solid import Solid
from ramiefenics.published.stalks import XYLEM
from ramiefenics.solve.quasistatic import QuasiStatic
from ramiefenics.solve.rest import come_to_rest
from ramiefenics.specification import Elastic
from ramiefenics.verification.block import all_around, block, layers, second_order

Array = NDArray[np.float64]

ROUNDING = 1e-12
"""Tolerance of results, relative to the largest of them."""

OWN = """
import ufl
from ramiefenics.model.laws import Law
from ramiefenics.model.laws.neo_hookean import NEO_HOOKEAN


def energy(F, p):
    C = F.T * F
    oddities = ufl.atan(C[0, 1]) ** 2 + ufl.tanh(C[0, 2]) * ufl.sin(C[1, 2]) + ufl.erf(C[0, 1]) ** 2
    larger = ufl.max_value(C[0, 0], C[1, 1]) ** 2.5 + ufl.cosh(C[0, 2]) + ufl.sign(C[2, 2] - 2)
    return NEO_HOOKEAN.energy(F, p) + p["mu"] * (oddities + larger + abs(C[0, 0] - C[2, 2]) ** 3)


MINE = Law("mine", NEO_HOOKEAN.parameters, energy)
"""


LONG = "inelastic_viscoelasticity"
"""Law that takes ten seconds without C; its parts occur in the other laws."""


@pytest.fixture(
    params=[pytest.param(x, marks=pytest.mark.slow if x == LONG else ()) for x in (*LAWS, "own")]
)
def law(request: pytest.FixtureRequest, tmp_path: Path) -> str:
    if request.param != "own":
        return str(request.param)
    (tmp_path / "mine.py").write_text(OWN)
    return str(tmp_path / "mine.py")


def material_for(law: str) -> Material:
    return Material(Elastic.isotropic(10.0, 0.3)) if law == "isotropic" else XYLEM


FUNCTIONS: dict[str, Callable[..., float]] = {
    **{name: getattr(operator, name) for name in ("add", "lt", "gt", "le", "ge", "eq", "ne")},
    **{"multiply": operator.mul, "power": operator.pow, "inverse": lambda x: 1.0 / x},
    **{
        "abs": abs,
        "sign": lambda x: float(np.sign(x)),
        "not": operator.not_,
        "and": operator.and_,
        "or": operator.or_,
    },
    **{"select": lambda condition, a, b: a if condition else b},
}


def numbers(graph: Graph, ends: list[int], given: dict[str, float]) -> list[float]:
    """Evaluate a graph without C."""
    values: dict[int, float] = {}
    for node in graph.ancestors(ends):
        operation, *_ = graph.nodes[node]
        operands = [values[operand] for operand in graph.operands(node)]
        if operation in ("constant", "input", "label"):
            values[node] = operands[0] if operands else _terminal(graph.nodes[node], given)
        else:
            evaluate = FUNCTIONS.get(operation) or getattr(math, operation)
            values[node] = evaluate(*operands)
    return [values[end] for end in ends]


def _terminal(node: tuple[Any, ...], given: dict[str, float]) -> float:
    return float(node[1]) if node[0] == "constant" else given[node[1]]


class Reference:
    """A law at a point, differentiated by UFL and evaluated without C."""

    def __init__(self, law: Law, given: Array, p: dict[str, float], last: dict[str, Array]) -> None:
        self._graph, self._terminals = Graph(), {}
        self._given: dict[str, float] = {}
        self.values: dict[Any, Any] = {}  # for UFL's own evaluation
        self.F = ufl.variable(self._constant(given))
        names = {name: self._constant(np.asarray(value)) for name, value in p.items()}
        before = {name: self._constant(value) for name, value in last.items()}
        step = self.F, names, before, self._constant(np.asarray(0.7))
        self.state = law.state(*step)
        self.stress = law.stress(*step)
        self.stored = law.stored(self.F, names, self.state)
        self.lost = law.dissipated(self.F, names, before, self.state, step[3])

    def _constant(self, value: Array) -> Any:
        domain = ufl.Mesh(basix.ufl.element("Lagrange", "hexahedron", 1, shape=(3,)))
        constant = ufl.Constant(domain, shape=value.shape)
        nodes = np.empty(value.shape, dtype=int)
        for index in np.ndindex(*value.shape):
            name = f"x{len(self._given)}"
            nodes[index], self._given[name] = self._graph.input(name), float(value[index])
        self._terminals[constant], self.values[constant] = nodes, value.tolist()
        return constant

    def of(self, expression: Any) -> list[float]:
        lowering = Lowering(self._graph, self._terminals)
        nodes = lowering.lower(differentiated(expression))
        return numbers(self._graph, nodes, self._given)


def differentiated(expression: Any) -> Any:
    return apply_derivatives(apply_algebra_lowering(ufl.as_ufl(expression)))


def remembered(law: Law, rng: np.random.Generator) -> dict[str, Array]:
    """Return random internal variables near rest; tensors are symmetric."""
    start = {} if law.memory is None else law.memory.start
    found = {}
    for name, value in start.items():
        change = 0.01 * rng.standard_normal(np.shape(value))
        found[name] = np.asarray(value) + (change if change.ndim < 2 else change + change.T)
    return found


def test_at_a_point_it_is_what_ufl_differentiates(law: str) -> None:
    found, rng = law_named(law), np.random.default_rng(2)
    p = found.parameters_of(material_for(law))
    F, last = np.eye(3) + 0.1 * rng.standard_normal((3, 3)), remembered(found, rng)
    expected = Reference(found, F, p, last)
    before = np.array([x for value in last.values() for x in value.ravel()] + [5.0])
    kernel = PointKernel(found, tuple(p))

    def result(which: str) -> Array:
        return kernel.evaluate(which, F, np.array(list(p.values())), before, 0.7)

    lost = 5.0 if last else 0.0  # dissipated before
    pairs = [
        (result("stress"), expected.of(expected.stress)),
        (result("tangent"), expected.of(ufl.diff(expected.stress, expected.F))),
        (
            result("energies") - (0.0, lost),
            expected.of(expected.stored) + expected.of(expected.lost),
        ),
        (result("update")[:-1], [x for name in last for x in expected.of(expected.state[name])]),
    ]
    for one, other in pairs:
        assert one == pytest.approx(other, abs=ROUNDING * np.abs(other).max(initial=1.0))


def test_lowering_is_what_ufl_evaluates() -> None:
    law, F = SATURATING_FIBRE, np.eye(3) + 0.1 * np.random.default_rng(4).standard_normal((3, 3))
    expected = Reference(law, F, law.parameters_of(XYLEM), {})
    lowered = differentiated(expected.stress)
    values = [lowered.evaluate((), expected.values, at, StackDict()) for at in np.ndindex(3, 3)]
    assert expected.of(expected.stress) == pytest.approx(values, rel=1e-10)


def deformed(order: int, serendipity: bool, law: str, differs: bool = False) -> Solid:
    """Return two distorted cells at random displacements, with a step in their memory.

    Moduli, fibres and their stretch at rest may differ from point to point.
    """
    axis = np.array([0.0, 1.0])
    mesh = block(np.array([0.0, 1.0, 1.8]), axis, axis)
    mesh = second_order(mesh) if order == 2 else mesh
    rng = np.random.default_rng(5)
    mesh.geometry.x[:] += 0.05 * rng.standard_normal(mesh.geometry.x.shape)
    local = random_fields(mesh, order, rng) if differs else {}
    solid = Solid(mesh, layers(mesh), [material_for(law)], law, serendipity, local)
    for amount in (0.02, 0.03):
        u = solid.displacement.x.array
        u[:] = amount * rng.standard_normal(len(u))
        if amount == 0.02:
            solid.duration.value = 0.4
            solid.remember()
    solid.duration.value = 0.7
    return solid


def random_fields(
    mesh: dmesh.Mesh, order: int, rng: np.random.Generator
) -> dict[str, fem.Function]:
    space = fem.functionspace(mesh, point_element(mesh, order))
    fields = {}
    for name in (STIFFNESS, FIBRE_X, FIBRE_Y, STRETCH, WIDTH):
        fields[name] = fem.Function(space)
        mean = 0.0 if name in (FIBRE_X, FIBRE_Y) else 1.0
        fields[name].x.array[:] = mean + rng.uniform(-0.1, 0.1, len(fields[name].x.array))
    return fields


def compare(by_kernel: Term, by_form: Term, u: fem.Function, bcs: list[fem.DirichletBC]) -> None:
    results = []
    for term in (by_kernel, by_form):
        forces = np.zeros(len(u.x.array))
        term.add_forces(forces)
        equations = Equations(u, [term], bcs)
        equations.assemble()
        results.append((forces, equations.matrix.petsc.convert("dense").getDenseArray().copy()))
    for one, other in zip(*results, strict=True):
        assert np.abs(one - other).max() < ROUNDING * np.abs(other).max()


def check_cells(solid: Solid) -> None:
    """Compare forces, stiffness with held components, and energies with the form compiler's."""
    u = solid.displacement
    bcs = [solid.symmetry(all_around(solid.mesh)[:4], axis=1)]
    by_kernel, by_form = (
        KernelTerm(solid.kernel),
        FormTerm(solid.virtual_work(ufl.TestFunction(solid.space)), u),
    )
    compare(by_kernel, by_form, u, bcs)
    stored, lost = solid.kernel.energies()
    assert stored == pytest.approx(assembled(solid.energy()), rel=ROUNDING)
    assert lost == pytest.approx(assembled(solid.dissipation()), rel=ROUNDING, abs=1e-15)


def assembled(functional: Any) -> float:
    return 0.0 if functional is None else float(fem.assemble_scalar(compile_form(functional)))


@pytest.mark.parametrize("serendipity", [True, pytest.param(False, marks=pytest.mark.slow)])
def test_on_cells_it_is_what_the_form_compiler_integrates(serendipity: bool) -> None:
    """These cells are of second order; first order is tested below, with every law."""
    check_cells(deformed(2, serendipity, "svk"))


@pytest.mark.parametrize("order", [1, pytest.param(2, marks=pytest.mark.slow)])
def test_values_that_differ_from_point_to_point_are_where_they_belong(order: int) -> None:
    check_cells(deformed(order, False, "svk", differs=True))


@pytest.mark.slow
def test_on_cells_every_law_takes_them(law: str) -> None:
    check_cells(deformed(1, False, law, differs=True))


@pytest.mark.slow
def test_on_cells_every_law_is_what_the_form_compiler_makes_of_it(law: str) -> None:
    solid = deformed(1, False, law)
    check_cells(solid)
    memory = solid._memory
    if memory is not None:
        found, expected = solid.kernel.updated(), memory.evaluate(solid._now)
        assert found == pytest.approx(expected, abs=ROUNDING * np.abs(expected).max())


def test_a_law_beyond_it_is_left_to_the_form_compiler(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    strange = OWN.replace("ufl.sign(C[2, 2] - 2)", "ufl.bessel_J(0, C[0, 0])")
    (tmp_path / "mine.py").write_text(strange)
    with caplog.at_level(logging.INFO):
        solid = deformed(1, False, str(tmp_path / "mine.py"))
        assert solid.kernel is None
    assert "the law mine is compiled by the form compiler" in caplog.text
    assert "BesselJ" in caplog.text
    assert isinstance(solid.term(), FormTerm)
    assert solid.energies()[0] == pytest.approx(assembled(solid.energy()))


def test_inverted_cells_are_told_by_nan() -> None:
    solid = deformed(1, False, "saturating_fibre")
    solid.displacement.interpolate(lambda x: -2.0 * x)
    forces = np.zeros(len(solid.displacement.x.array))
    solid.term().add_forces(forces)
    assert np.isnan(forces).all()


def check_contact(test: BendingTest) -> None:
    """Compare forces and stiffness of contact, after some steps and off equilibrium, by form."""
    problem = BendingProblem(test, MPI.COMM_SELF)
    come_to_rest(problem)
    observer = Observer(problem)
    stepper = QuasiStatic(problem, observer.observe, test.protocol, test.numerics.stepping)
    assert [step.travel_mm for step in stepper.steps()][-1] == pytest.approx(0.5)
    u = problem.displacement
    u.x.array[:] += 1e-3 * np.random.default_rng(4).standard_normal(len(u.x.array))
    problem.place(0.1, 0.05)
    by_kernel = problem.contact.term()
    assert isinstance(by_kernel, KernelTerm)
    by_form = FormTerm(problem.contact.residual(ufl.TestFunction(problem.solid.space)), u)
    compare(by_kernel, by_form, u, problem.bcs)


def test_contact_is_what_the_form_compiler_integrates(coarse: BendingTest) -> None:
    check_contact(override(coarse, ["law=svk", "protocol.travel_mm=0.5"]))


@pytest.mark.slow
@pytest.mark.parametrize(
    "settings",
    [
        ["numerics.mesh=ladder_q2_1"],
        ["law=inelastic_viscoelasticity"],
        ["numerics.domain=full", "stalk.tissue.fibre_angle_deg=5"],
    ],
)
def test_contact_of_every_kind_is(coarse: BendingTest, settings: list[str]) -> None:
    check_contact(override(coarse, [*settings, "protocol.travel_mm=0.5"]))

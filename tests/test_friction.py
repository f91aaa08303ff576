"""Friction with memory: the law alone, at the points of a surface, and in a bend."""

from __future__ import annotations

import numpy as np
import pytest
import ufl
from dolfinx import fem
from dolfinx import mesh as dmesh
from mpi4py import MPI
from scipy.integrate import solve_ivp

from ramiefenics import BendingTest, override, simulate
from ramiefenics.model.facet_memory import FacetMemory
from ramiefenics.model.friction import FrictionLaw, Grip
from ramiefenics.specification import Friction

FRICTION = Friction(0.6, 0.1, weakening_mm=0.05)
PRESLIDING_MM = 0.02
POINT = dmesh.create_unit_cube(MPI.COMM_SELF, 1, 1, 1, dmesh.CellType.hexahedron)


def slide(path: np.ndarray) -> tuple[np.ndarray, float, float]:
    """Follow a path of slips, shape (n, 3), mm; return b, the length slid, and the coefficient."""
    law = FrictionLaw(POINT, FRICTION, PRESLIDING_MM)
    b, slid, slip = (fem.Constant(POINT, v) for v in (np.zeros(3), 0.0, np.zeros(3)))
    after = law.slip(Grip(b, slid), slip)
    numbers = ufl.as_vector((*after.mobilised, after.slid_mm, law.coefficient(after)))
    value = fem.Expression(numbers, np.full((1, 3), 0.5))
    found = np.zeros(5)
    for step in path:
        b.value, slid.value, slip.value = found[:3], found[3], step
        found = value.eval(POINT, np.array([0], dtype=np.int32)).reshape(-1)
    return found[:3], float(found[3]), float(found[4])


def exact(directions: list[np.ndarray], length: float) -> np.ndarray:
    """Return b and the length slid, by integrating the law along straight pieces."""
    state = np.zeros(4)
    for direction in directions:

        def rate(_: float, y: np.ndarray, direction: np.ndarray = direction) -> np.ndarray:
            b_rate = (direction - y[:3]) / PRESLIDING_MM
            slid = np.linalg.norm(direction - PRESLIDING_MM * b_rate)
            return np.array([*b_rate, slid])

        state = solve_ivp(rate, (0.0, length), state, rtol=1e-9, atol=1e-12).y[:, -1]
    return state


X, Z = np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0])


@pytest.mark.parametrize("turn", [Z, -X, X])
def test_law_follows_its_differential_equations(turn: np.ndarray) -> None:
    """Paths turn a corner, go back, or go on, in steps of one or a tenth of a presliding length."""
    length, wanted = 0.06, exact([X, turn], 0.06)
    for steps, tolerance in ((3, 0.1), (30, 0.02)):
        path = np.repeat([length / steps * X, length / steps * turn], steps, axis=0)
        b, slid, coefficient = slide(path)
        # b is exact along straight pieces, except for the smoothing of the slip's magnitude
        assert b == pytest.approx(wanted[:3], abs=2e-3)
        assert slid == pytest.approx(wanted[3], rel=tolerance)
        fallen = np.exp(-slid / FRICTION.weakening_mm)
        assert coefficient == pytest.approx(0.1 + 0.5 * fallen, rel=1e-12)


def test_friction_does_not_depend_on_steps() -> None:
    """One step or a hundred give the same straight slip, up to the smoothing of its magnitude."""
    at_once, slowly = (slide(np.repeat([0.1 / n * Z], n, axis=0)) for n in (1, 100))
    assert at_once[0] == pytest.approx(slowly[0], abs=2e-3)
    assert at_once[1] == pytest.approx(slowly[1], rel=2e-2)


def test_small_slip_springs_back() -> None:
    """Slip forth and back by a hundredth of the presliding length leaves no friction."""
    b, slid, _ = slide(0.01 * PRESLIDING_MM * np.array([X, -X]))
    assert np.abs(b).max() < 2e-4  # the square of the share
    assert slid < 1e-3 * PRESLIDING_MM


def test_dissipation_is_what_slip_does_not_give_back() -> None:
    """It is the work minus the elastic part, ``d |b|^2 / 2``, on any path; never negative."""
    law = FrictionLaw(POINT, FRICTION, PRESLIDING_MM)
    b, slip = fem.Constant(POINT, np.zeros(3)), fem.Constant(POINT, np.zeros(3))
    grip = Grip(b, fem.Constant(POINT, 0.0))
    after = law.slip(grip, slip).mobilised
    value = fem.Expression(
        ufl.as_vector((*after, law.opposed_slip(grip, slip))), np.full((1, 3), 0.5)
    )
    lengths = PRESLIDING_MM * np.array([0.003, 0.4, 3.0])
    for direction in (X, Z, -X, -X, X):
        for length in lengths:
            start, slip.value = b.value.copy(), length * direction

            def rate(_: float, y: np.ndarray, direction: np.ndarray = direction) -> np.ndarray:
                return np.array([*(direction - y[:3]) / PRESLIDING_MM, y[:3] @ direction])

            *end, work = solve_ivp(rate, (0.0, length), [*start, 0.0], rtol=1e-9, atol=1e-14).y[
                :, -1
            ]
            kept = PRESLIDING_MM * (np.dot(end, end) - start @ start) / 2
            found = value.eval(POINT, np.array([0], dtype=np.int32)).reshape(-1)
            # the slip's magnitude is smoothed over 1e-6 presliding lengths
            assert found[3] == pytest.approx(work - kept, abs=1e-5 * PRESLIDING_MM)
            assert found[3] >= 0.0
            b.value = found[:3]


def test_friction_never_gives_work_back(coarse: BendingTest) -> None:
    """In loading and unloading; sticking points spring back at the reversal."""
    changes = ["protocol.travel_mm=0.6", "protocol.then=[{to_mm=0.3}]"]
    curve = simulate(override(coarse, [*changes, "numerics.acoustic_check=false"])).curve
    assert curve["friction_work_Nmm"].diff().min() >= 0.0
    assert curve["friction_work_Nmm"].iloc[-1] > 0.0


@pytest.mark.parametrize("degree", [4, 6])
def test_points_remember_exactly_what_they_are_told(degree: int) -> None:
    """This holds for any face of a cell at the boundary."""
    mesh = dmesh.create_unit_cube(MPI.COMM_SELF, 2, 1, 2, dmesh.CellType.hexahedron)
    x = ufl.SpatialCoordinate(mesh)
    for axis, at in ((0, 0.0), (1, 1.0), (2, 1.0)):
        facets = dmesh.locate_entities_boundary(
            mesh, 2, lambda p, a=axis, v=at: np.isclose(p[a], v)
        )
        tags = dmesh.meshtags(mesh, 2, facets, np.ones(len(facets), dtype=np.int32))
        ds = ufl.Measure("ds", mesh, subdomain_data=tags, metadata={"quadrature_degree": degree})(1)
        memory = FacetMemory(mesh, ds, degree, 2)
        told = ufl.as_vector((ufl.sin(3 * x[0] + x[1] + 2 * x[2]), x[0] * x[1] + x[2]))
        memory.remember(memory.compile(told))
        memory.remember(memory.compile(2 * memory.function + told))
        miss = memory.function - 3 * told
        size = fem.assemble_scalar(fem.form(ufl.dot(told, told) * ds))
        assert fem.assemble_scalar(fem.form(ufl.dot(miss, miss) * ds)) < 1e-26 * size


@pytest.mark.slow
def test_peak_plateau_and_work_do_not_depend_on_steps(screening: BendingTest) -> None:
    """Steps of 1 to 0.1 mm agree on the peak to 0.2 %, and on the plateau's ends to 0.25 mm."""
    peaks, works = [], []
    for step in (1.0, 0.5, 0.25, 0.1):
        changes = [f"numerics.stepping.{name}_step_mm={step}" for name in ("max", "first")]
        if step == 1.0:
            changes = []
        result = simulate(override(screening, [*changes, "numerics.acoustic_check=false"]))
        assert result.completed
        peaks.append(result.peak)
        works.append(float(result.curve["friction_work_Nmm"].iloc[-1]))
    best = peaks[-1]
    for peak in peaks:
        assert peak.force_N == pytest.approx(best.force_N, rel=0.002)
        assert peak.plateau_mm == pytest.approx(best.plateau_mm, abs=0.25)
        assert abs(peak.force_N - best.force_N) < 2.0 * (peak.step_error_N + best.step_error_N)
    # the work converges as the step decreases
    assert works == pytest.approx([works[-1]] * 4, rel=0.05)

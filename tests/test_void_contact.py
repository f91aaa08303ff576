"""Contact between the walls of the void once it closes."""

from __future__ import annotations

import numpy as np
import pytest
from conftest import Simulate
from mpi4py import MPI
from petsc4py import PETSc

from ramiefenics import BendingTest, override, simulate
from ramiefenics.model.bending import BendingProblem
from ramiefenics.model.void_contact import VoidContact

THIN = [
    "stalk.void_diameter_mm=11",
    "fixture.indenter_radius_mm=15",
    "fixture.support_radius_mm=15",
    "fixture.friction.static=0",
    "fixture.friction.dynamic=0",
    "numerics.acoustic_check=false",
]
"""Settings of a stalk with a thin soft wall, which flattens long before it fails."""


@pytest.fixture(scope="module")
def thin(coarse: BendingTest) -> BendingTest:
    return override(coarse, [*THIN, "protocol.travel_mm=26", "numerics.stepping.max_step_mm=0.5"])


def test_a_run_goes_on_beyond_the_closing_of_the_void(
    thin: BendingTest, simulated: Simulate
) -> None:
    """Contact between the walls conserves energy, and keeps them apart."""
    result = simulated(thin)
    assert result.ending.kind == "completed"
    curve = result.curve
    closed = curve["void_force_N"] > 0.0
    assert closed.sum() > 5
    at = curve["displacement_mm"][closed].iloc[0]
    assert any(f"the void has closed at {at:.2f} mm" in note for note in result.notes())
    # corners of the mesh, between which the penalty acts, overlap by a fifth of a cell
    assert curve["void_height_mm"].min() > -0.2
    assert 0.2 < curve["void_force_N"].iloc[-1] / curve["force_N"].iloc[-1] < 1.0
    # forces that do not derive from the stored energy would leave a gap; the steps leave 0.1 %
    work, stored = curve["indenter_work_Nmm"].iloc[-1], curve["stored_energy_Nmm"].iloc[-1]
    assert stored == pytest.approx(work, rel=2e-3)


def test_walls_carry_load(thin: BendingTest, simulated: Simulate) -> None:
    """Beyond the closing the stalk is stiffer than one whose walls pass through each other."""
    curve = simulated(thin).curve
    force = curve["force_N"].iloc[-1]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(VoidContact, "refresh", lambda self: False)
        free = simulate(thin, MPI.COMM_SELF).curve
    assert free["void_height_mm"].iloc[-1] < -0.8
    assert force > 1.03 * free["force_N"].iloc[-1]
    open_ = curve["void_height_mm"] > 0.5
    # to the tolerance of Newton's method
    assert np.allclose(curve["force_N"][open_], free["force_N"][: open_.sum()], rtol=1e-4)


@pytest.fixture(scope="module", params=[1, 2])
def pressed(request: pytest.FixtureRequest, coarse: BendingTest) -> BendingProblem:
    """A stalk whose roof has been pushed through its floor."""
    recipe = "ladder_q1_1" if request.param == 1 else "screening"
    test = override(coarse, [*THIN, f"numerics.mesh={recipe}"])
    problem = BendingProblem(test, MPI.COMM_SELF)
    assert problem.walls is not None

    def flattened(x: np.ndarray, height: float) -> np.ndarray:
        """Flatten the bore to an ellipse of a given height; sections far away stay round."""
        share = (1.0 - height) * np.exp(-((x[2] / 15.0) ** 2))
        sunk = np.where(x[1] > 0.0, 0.05, 0.0) * np.exp(-((x[2] / 15.0) ** 2))
        return np.stack([0.02 * x[0] * share, -share * x[1] - sunk, 0.01 * x[1] * share])

    # walls are paired when they are close, and then overlap within the step
    problem.displacement.interpolate(lambda x: flattened(x, 0.02))
    problem.accept()
    problem.displacement.interpolate(lambda x: flattened(x, 0.004))
    return problem


def forces(walls: VoidContact, problem: BendingProblem) -> np.ndarray:
    found = np.zeros_like(problem.displacement.x.array)
    walls.add_forces(found)
    return found


def test_forces_are_the_slope_of_the_energy(pressed: BendingProblem) -> None:
    walls, u = pressed.walls, pressed.displacement.x.array
    assert walls is not None
    assert walls.energy() > 0.0
    kept, direction = u.copy(), np.random.default_rng(3).normal(size=len(u))
    step = 1e-7
    energies = []
    for sign in (-1.0, 1.0):
        u[:] = kept + sign * step * direction
        energies.append(walls.energy())
    u[:] = kept
    slope = (energies[1] - energies[0]) / (2 * step)
    assert forces(walls, pressed) @ direction == pytest.approx(slope, rel=1e-5)


def test_stiffness_is_the_slope_of_the_forces(pressed: BendingProblem) -> None:
    walls, u = pressed.walls, pressed.displacement.x.array
    assert walls is not None
    matrix = pressed.equations.matrix
    matrix.petsc.zeroEntries()
    walls.add_stiffness(matrix, [])
    matrix.petsc.assemble()
    kept, direction = u.copy(), np.random.default_rng(4).normal(size=len(u))
    u[:] = kept + 1e-8 * direction
    after = forces(walls, pressed)
    u[:] = kept
    slope = (after - forces(walls, pressed)) / 1e-8
    vector = PETSc.Vec().createWithArray(direction, comm=PETSc.COMM_SELF)
    product = vector.duplicate()
    matrix.petsc.mult(vector, product)
    assert np.allclose(product.array, slope, atol=1e-5 * np.abs(slope).max())


def test_walls_are_in_balance(pressed: BendingProblem) -> None:
    """The virtual work of translations, and of rotations of the current state, vanishes."""
    walls, u = pressed.walls, pressed.displacement
    assert walls is not None
    found = forces(walls, pressed)
    pushed = np.abs(found).sum()
    now = u.copy()
    rigid = u.copy()
    for axis in np.eye(3):
        rigid.interpolate(lambda x, axis=axis: np.outer(axis, np.ones(x.shape[1])))
        assert abs(found @ rigid.x.array) < 1e-9 * pushed
    # points on roof and floor have moved apart sideways by 1e-2 mm since they were paired
    place = u.copy()
    place.interpolate(lambda x: x)
    place.x.array[:] += now.x.array
    for axis in np.eye(3):
        turned = np.cross(axis, place.x.array.reshape(-1, 3)).ravel()
        assert abs(found @ turned) < 0.02 * pushed


@pytest.mark.mpi
def test_walls_meet_on_ranks_as_on_one(thin: BendingTest) -> None:
    """A pair may span two ranks; Newton's tolerance is 1e-4 of the residual, and less is left."""
    test = override(thin, ["protocol.travel_mm=22", "numerics.stepping.max_step_mm=1"])
    alone, together = (simulate(test, comm).curve for comm in (MPI.COMM_SELF, MPI.COMM_WORLD))
    assert alone["void_force_N"].iloc[-1] > 0.0
    for name in ("force_N", "void_force_N"):
        scale = alone[name].max()
        assert np.abs(together[name] - alone[name]).max() < 1e-5 * scale


@pytest.mark.slow
def test_the_force_beyond_the_closing_converges(screening: BendingTest) -> None:
    """Two recipes differ no more beyond it than before: a few per cent for so thin a wall."""
    forces = []
    for recipe in ("screening", "standard"):
        test = override(screening, [*THIN, f"numerics.mesh={recipe}", "protocol.travel_mm=22"])
        curve = simulate(test, MPI.COMM_SELF).curve
        assert curve["void_force_N"].iloc[-1] > 1.0
        forces.append(np.interp([4.0, 22.0], curve["displacement_mm"], curve["force_N"]))
    before, beyond = forces[0] / forces[1] - 1.0
    assert abs(beyond) < abs(before)

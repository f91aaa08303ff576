"""Matrix factorisation in single precision."""

from __future__ import annotations

import numpy as np
import pytest
from mpi4py import MPI

from ramiefenics import BendingTest, override, simulate
from ramiefenics.model.bending import BendingProblem
from ramiefenics.solve.factors import SingleFactors, single_factors


@pytest.fixture
def problem(coarse: BendingTest) -> BendingProblem:
    return BendingProblem(coarse, MPI.COMM_SELF)


@pytest.fixture(params=[False, True], ids=["any", "symmetric"])
def factors(problem: BendingProblem, request: pytest.FixtureRequest) -> SingleFactors:
    """Factors of a stalk without contact, whose tangent is symmetric."""
    found = single_factors(problem.equations.matrix, request.param)
    if found is None:
        pytest.skip("there is no MUMPS in single precision here")
    return found


def test_they_solve_to_single_precision_and_follow_the_matrix(
    problem: BendingProblem, factors: SingleFactors
) -> None:
    matrix = problem.equations.matrix
    expected, b = matrix.petsc.createVecs()
    expected.array[:] = 1e-30 * np.random.default_rng(1).standard_normal(expected.size)
    for stiffness in (1.0, 7.0):
        problem.equations.assemble()
        diagonal = matrix.petsc.getDiagonal()
        diagonal.shift(stiffness * diagonal.norm() / diagonal.size**0.5)
        matrix.petsc.setDiagonal(diagonal)
        matrix.petsc.mult(expected, b)
        factors.setUp(None)
        found = expected.duplicate()
        factors.apply(None, b, found)
        # single precision times a condition number of some hundreds
        assert found.array == pytest.approx(expected.array, abs=1e-4 * np.abs(expected.array).max())


def test_a_matrix_without_inverse_gives_no_number(
    problem: BendingProblem, factors: SingleFactors
) -> None:
    matrix = problem.equations.matrix
    x, b = matrix.petsc.createVecs()
    b.set(1.0)
    matrix.petsc.zeroEntries()
    factors.setUp(None)
    factors.apply(None, b, x)
    assert np.isnan(x.array).all()


def test_several_right_hand_sides_are_solved_for_at_once(
    problem: BendingProblem, factors: SingleFactors
) -> None:
    """Their sizes do not matter: each is scaled separately into the range of single precision."""
    problem.equations.assemble()
    factors.setUp(None)
    rng = np.random.default_rng(2)
    sides = rng.standard_normal((4, problem.unknowns)) * np.array([[1e-40], [0.0], [1.0], [1e40]])
    together = factors.solve(sides)
    each = np.array([factors.solve(side[None])[0] for side in sides])
    scale = np.abs(each).max(axis=1, keepdims=True)
    assert not together[1].any()
    assert np.all(np.abs(together - each) <= 1e-4 * scale)
    assert np.all(scale[[0, 2, 3]] > 0.0)


@pytest.mark.mpi
def test_ranks_solve_together(coarse: BendingTest) -> None:
    problem = BendingProblem(coarse, MPI.COMM_WORLD)
    factors = single_factors(problem.equations.matrix)
    if factors is None:
        pytest.skip("there is no MUMPS in single precision here")
    matrix = problem.equations.matrix.petsc
    problem.equations.assemble()
    diagonal = matrix.getDiagonal()
    diagonal.shift(diagonal.max()[1])
    matrix.setDiagonal(diagonal)
    factors.setUp(None)
    expected, b = matrix.createVecs()
    sides, solutions = [], []
    for power in (-40.0, 40.0):
        first, behind = expected.getOwnershipRange()
        numbers = np.random.default_rng(1).standard_normal(expected.getSize())
        expected.array[:] = 10.0**power * numbers[first:behind]
        matrix.mult(expected, b)
        sides.append(b.array.copy())
        solutions.append(expected.array.copy())
    found = factors.solve(np.array(sides))
    assert found / [[1e-40], [1e40]] == pytest.approx(
        np.array(solutions) / [[1e-40], [1e40]],
        abs=1e-4,  # as on one rank
    )
    factors.destroy(None)


@pytest.mark.mpi
def test_ranks_free_the_factors_of_a_simulation(
    coarse: BendingTest, monkeypatch: pytest.MonkeyPatch
) -> None:
    made, freed = [], []
    for name, noted in (("setUp", made), ("destroy", freed)):
        method = getattr(SingleFactors, name)

        def noting(self, pc, noted=noted, method=method):
            noted.append(id(self))
            method(self, pc)

        monkeypatch.setattr(SingleFactors, name, noting)
    simulate(override(coarse, ["protocol.travel_mm=0.5"]), MPI.COMM_WORLD)
    assert set(made) <= set(freed)

"""Derivatives of the force curve, against differences of whole simulations."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from mpi4py import MPI

from ramiefenics import (
    BendingTest,
    Parameter,
    SpecificationError,
    override,
    sensitivities,
    simulate,
)

E_Z = "stalk.layers.phloem.material.elastic.E_Z_MPa"
RADIUS, VOID = "fixture.indenter_radius_mm", "stalk.void_diameter_mm"
FRICTION = "fixture.friction.dynamic"
STRENGTH = "stalk.layers.phloem.material.large_strain.fibre_strength"

TYPICAL = {E_Z: 200.0, RADIUS: 0.5, VOID: 0.5, FRICTION: 0.05, STRENGTH: 0.01}
AT_REST = {E_Z: 1919.08, RADIUS: 5.0, VOID: 7.28, FRICTION: 0.12, STRENGTH: 0.1}


def _adding_to(key: str) -> Callable[[BendingTest, float], BendingTest]:
    return lambda test, amount: override(test, [f"{key}={AT_REST[key] + amount!r}"])


@pytest.fixture
def short(coarse: BendingTest) -> BendingTest:
    """Short test, solved to a tight tolerance so that differences of runs are accurate."""
    return override(coarse, ["protocol.travel_mm=0.5", "numerics.stepping.relative_tolerance=1e-8"])


def test_constants_coordinates_and_fixture(short: BendingTest) -> None:
    """Central differences over a hundredth of the typical size are exact to about 1e-5."""
    parameters = {key: Parameter(_adding_to(key), size) for key, size in TYPICAL.items()}
    found = sensitivities(short, parameters, MPI.COMM_SELF)
    assert found.by_differences == ()
    for key, size in TYPICAL.items():
        low, high = (
            simulate(parameters[key].change(short, sign * 1e-2 * size), MPI.COMM_SELF).curve
            for sign in (-1, 1)
        )
        travel = found.curve["displacement_mm"]
        assert np.array_equal(low["displacement_mm"], travel)
        assert np.array_equal(high["displacement_mm"], travel)
        expected = (high["force_N"] - low["force_N"]) / (2e-2 * size)
        error = np.abs(found.curve[key] - expected).max()
        assert error < 1e-4 * np.abs(expected).max(), key


@pytest.mark.slow
def test_other_topology_falls_back_to_differences(short: BendingTest) -> None:
    """A positive amount adds two elements; the derivative is the change that these make."""

    def finer(test: BendingTest, amount: float) -> BendingTest:
        return override(test, [f"numerics.mesh.angular_elements={8 if amount > 0 else 6}"])

    found = sensitivities(short, {"finer": Parameter(finer, 10.0)}, MPI.COMM_SELF)
    assert found.by_differences == ("finer",)
    force = [
        simulate(finer(short, amount), MPI.COMM_SELF).curve["force_N"].iloc[-1]
        for amount in (-1, 1)
    ]
    # 0.1 of the typical size on either side
    assert found.curve["finer"].iloc[-1] == pytest.approx((force[1] - force[0]) / 2.0)


@pytest.mark.slow
def test_a_side_that_ends_early_leaves_the_difference_on_the_other(short: BendingTest) -> None:
    """A larger radius comes with another mesh, and a test that ends halfway."""

    def ending(test: BendingTest, amount: float) -> BendingTest:
        bent = _adding_to(RADIUS)(test, amount)
        return early(bent, amount) if amount > 0.0 else bent

    def early(test: BendingTest, amount: float) -> BendingTest:
        mesh = "numerics.mesh.angular_elements=8"
        return override(test, [mesh, "protocol.travel_mm=0.25"] if amount else [])

    parameters = {
        "ending": Parameter(ending, TYPICAL[RADIUS]),
        "whole": Parameter(_adding_to(RADIUS), TYPICAL[RADIUS]),
    }
    found = sensitivities(short, parameters, MPI.COMM_SELF)
    assert found.by_differences == ("ending",)
    with pytest.raises(SpecificationError, match="must be reached by a simulation with a changed"):
        sensitivities(short, {"early": Parameter(early, 10.0)}, MPI.COMM_SELF)
    late = found.curve[found.curve["displacement_mm"] > 0.26]
    # a difference over a twentieth of a millimetre, one-sided
    assert late["ending"].to_numpy() == pytest.approx(late["whole"].to_numpy(), rel=0.05)


def test_one_sided_where_negative_amounts_are_refused(short: BendingTest) -> None:
    """Friction cannot be less than zero."""
    smooth = override(short, ["fixture.friction.static=0", "fixture.friction.dynamic=0"])

    def rub(test: BendingTest, amount: float) -> BendingTest:
        pair = [f"fixture.friction.static={amount!r}", f"fixture.friction.dynamic={amount!r}"]
        return override(test, pair)

    found = sensitivities(smooth, {"friction": Parameter(rub, 0.1)}, MPI.COMM_SELF)
    assert found.by_differences == ()
    step = 1e-3
    rise = simulate(rub(smooth, step), MPI.COMM_SELF).curve["force_N"].iloc[-1]
    expected = (rise - simulate(smooth, MPI.COMM_SELF).curve["force_N"].iloc[-1]) / step
    # both are one-sided, over 1e-5 and 1e-3; the second derivative is of the order of the first
    assert found.curve["friction"].iloc[-1] == pytest.approx(expected, rel=5e-3)


def test_one_sided_where_positive_amounts_are_refused(short: BendingTest) -> None:
    """The dynamic coefficient equals the static one, and cannot be larger."""
    equal = override(short, ["fixture.friction.static=0.12", "fixture.friction.dynamic=0.12"])
    parameter = Parameter(_adding_to(FRICTION), TYPICAL[FRICTION])
    found = sensitivities(equal, {"friction": parameter}, MPI.COMM_SELF)
    assert found.by_differences == ()
    less = 1e-2 * TYPICAL[FRICTION]
    here, low = (
        simulate(parameter.change(equal, amount), MPI.COMM_SELF).curve for amount in (0.0, -less)
    )
    expected = ((here["force_N"] - low["force_N"]) / less).to_numpy()
    error = np.abs(found.curve["friction"].to_numpy() - expected).max()
    assert error < 2e-3 * np.abs(expected).max()  # error of one-sided differences


@pytest.mark.mpi
def test_ranks_agree(short: BendingTest) -> None:
    parameters = {VOID: Parameter(_adding_to(VOID), TYPICAL[VOID])}
    # partitions of the mesh vary between runs and often force differences: 1 % apart
    alone = sensitivities(short, parameters, MPI.COMM_SELF)
    together = sensitivities(short, parameters)
    assert together.curve[VOID].iloc[-1] == pytest.approx(alone.curve[VOID].iloc[-1], rel=0.01)

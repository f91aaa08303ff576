"""The bending simulation: balance of forces and energy, symmetry, robustness, failures."""

from __future__ import annotations

import dolfinx
import numpy as np
import pytest
from conftest import Simulate
from mpi4py import MPI

from ramiefenics import BendingResult, BendingTest, override, published_test, simulate
from ramiefenics.model import jit
from ramiefenics.model.bending import BendingProblem
from ramiefenics.model.observables import Observables
from ramiefenics.model.tube import build_tube
from ramiefenics.solve.quasistatic import Step


def _force(result: BendingResult, travel_mm: float) -> float:
    curve = result.curve
    return float(np.interp(travel_mm, curve["displacement_mm"], curve["force_N"]))


def test_reaches_the_end_of_the_travel(bent: BendingResult) -> None:
    assert bent.completed
    assert bent.curve["displacement_mm"].iloc[-1] == 14.0
    assert np.all(np.diff(bent.curve["displacement_mm"]) > 0)


def test_supports_bear_what_the_indenter_presses(bent: BendingResult) -> None:
    force, support = bent.curve["force_N"], bent.curve["support_force_N"]
    assert force.iloc[1:].min() > 0
    assert np.abs(force - support).max() < 1e-3 * force.max()


def test_indenter_works_for_what_is_stored_and_rubbed_off(bent: BendingResult) -> None:
    end = bent.curve.iloc[-1]
    spent = end["stored_energy_Nmm"] + end["friction_work_Nmm"]
    # the trapezoidal rule over steps of 1 mm errs by about 0.3 % on this curve
    assert spent == pytest.approx(end["indenter_work_Nmm"], rel=0.01)
    assert np.all(np.diff(bent.curve["friction_work_Nmm"]) >= 0)


def test_softer_than_the_beam_and_not_by_orders(bent: BendingResult) -> None:
    """Crushing adds to the beam's compliance, so Timoshenko's stiffness bounds the slope.

    It follows from 48 EI / L^3 with the layers' EI, and 4 G A / L without a shear coefficient.
    """
    stalk, span = bent.test.stalk, bent.test.fixture.span_mm
    radii = np.array(stalk.radii_mm)
    elastic = [layer.material.elastic for layer in stalk.layers]
    second_moment = np.pi / 4 * np.diff(radii**4)
    bending = 48 * np.dot([e.E_Z_MPa for e in elastic], second_moment) / span**3
    shear = 4 * np.dot([e.G_XZ_MPa for e in elastic], np.pi * np.diff(radii**2)) / span
    beam = 1 / (1 / bending + 1 / shear)
    assert 0.1 * beam < bent.slope_N_per_mm < beam


def test_section_flattens_and_widens_under_the_indenter(bent: BendingResult) -> None:
    curve, stalk = bent.curve, bent.test.stalk
    assert curve["section_height_mm"].iloc[0] == pytest.approx(stalk.outer_diameter_mm)
    assert np.all(np.diff(curve["section_height_mm"]) < 0)
    assert curve["section_width_mm"].iloc[-1] > stalk.outer_diameter_mm
    assert 0 < curve["void_height_mm"].iloc[-1] < stalk.void_diameter_mm


@pytest.mark.parametrize("domain", ["half", "full"])
@pytest.mark.parametrize("friction", [0.12, pytest.param(0.0, marks=pytest.mark.slow)])
def test_half_and_full_model_give_the_quarter_models_force(
    coarse: BendingTest, simulated: Simulate, domain: str, friction: float
) -> None:
    """Without friction only the tangent's shift holds the full stalk in place."""
    # with a looser tolerance, a step on so coarse a mesh may converge with another contact
    exactly = "numerics.stepping.relative_tolerance=1e-8"
    coefficients = [f"fixture.friction.{kind}={friction}" for kind in ("static", "dynamic")]
    test = override(coarse, [exactly, *coefficients])
    whole = override(test, [f"numerics.domain={domain}"])
    quarter, other = simulated(test), simulated(whole)
    assert other.completed
    # the same discrete problem: equal to the Newton tolerance, far below the 0.5 % required
    assert other.curve["force_N"].to_numpy() == pytest.approx(
        quarter.curve["force_N"].to_numpy(), rel=1e-6
    )
    for column in ("indenter_contact_width_mm", "indenter_contact_length_mm", "stored_energy_Nmm"):
        expected = quarter.curve[column].iloc[-1]
        assert expected > 0
        assert other.curve[column].iloc[-1] == pytest.approx(expected, rel=1e-4)


def test_friction_stiffens_little(coarse: BendingTest, simulated: Simulate) -> None:
    """The contact forces are nearly vertical: friction 0.12 changes the force by a few per cent."""
    none = override(coarse, ["fixture.friction.static=0", "fixture.friction.dynamic=0"])
    some = override(coarse, ["fixture.friction.static=0.12", "fixture.friction.dynamic=0.12"])
    slick, rough = simulated(none), simulated(some)
    assert 1.0 < rough.max_force_N / slick.max_force_N < 1.05
    assert slick.curve["friction_work_Nmm"].iloc[-1] == 0.0
    assert rough.curve["friction_work_Nmm"].iloc[-1] > 0.0


@pytest.mark.parametrize("stabilisation", [10.0, 500.0])
def test_force_hardly_feels_the_stabilisation(
    coarse: BendingTest, simulated: Simulate, stabilisation: float
) -> None:
    """Nitsche's method is consistent: the influence of gamma vanishes with the mesh size."""
    changed = override(coarse, [f"numerics.contact.stabilisation={stabilisation}"])
    usual, other = simulated(coarse), simulated(changed)
    # two elements through the wall, and a factor 50 between the extremes
    assert other.max_force_N == pytest.approx(usual.max_force_N, rel=0.02)


def test_solid_core_is_stiffer_than_the_tube(coarse: BendingTest, simulated: Simulate) -> None:
    result = simulated(override(coarse, ["stalk.void_diameter_mm=0"]))
    assert result.completed
    assert result.max_force_N > simulated(coarse).max_force_N
    assert result.curve["void_height_mm"].isna().all()


def test_snapshots_are_taken_where_the_protocol_says(bent: BendingResult) -> None:
    assert [s.travel_mm for s in bent.snapshots] == [0.0, 2.0, 4.0, 6.0, 8.0, 10.0, 12.0, 14.0]
    assert bent.snapshots[-1].body.cell_data["min_volume_ratio"].min() > 0


def test_giving_up_has_a_reason_and_keeps_the_curve(coarse: BendingTest) -> None:
    """With one iteration per solve even dynamic relaxation makes no progress."""
    fine = "numerics.mesh.contact_size=0.012"  # or no node feels the cylinder at first
    test = override(coarse, ["numerics.stepping.max_iterations=1", fine])
    result = simulate(test, MPI.COMM_SELF)
    assert result.ending.kind == "not converged"
    reached = result.curve["displacement_mm"].iloc[-1]
    assert reached < 3.0
    assert f"beyond {reached:.3f} mm" in result.ending.reason
    assert result.statistics.cut_backs > 0
    assert any("ellipticity was not checked beyond 0.00 mm" in note for note in result.notes())


def test_run_ends_where_the_stalk_slips_off(coarse: BendingTest, simulated: Simulate) -> None:
    result = simulated(override(coarse, ["stalk.length_mm=100.2", "protocol.travel_mm=21"]))
    assert result.ending.kind == "physical"
    assert "slipped off" in result.ending.reason
    last = result.snapshots[-1].body
    end = np.isclose(last.points[:, 2], 50.1) & (last.points[:, 1] < 0)
    z = (last.points + last.point_data["displacement_mm"])[end, 2]
    # the middle of the contact is inside the support's axis by at most the slope times its radius
    assert 45.0 < z.min() < 50.0
    assert result.curve["overhang_mm"].iloc[1] > 0.0


def test_interrupt_keeps_what_was_done(coarse: BendingTest) -> None:
    import os
    import signal

    def interrupt(step: Step[Observables]) -> None:
        if step.travel_mm >= 1.0:
            os.kill(os.getpid(), signal.SIGINT)

    before = signal.getsignal(signal.SIGINT)
    result = simulate(coarse, MPI.COMM_SELF, on_step=interrupt)
    assert not result.completed
    assert result.ending.kind == "interrupted"
    assert 1.0 <= result.curve["displacement_mm"].iloc[-1] < 3.0
    assert signal.getsignal(signal.SIGINT) is before


def test_one_compilation_serves_all_specifications(
    coarse: BendingTest, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Geometry and constants are data: another stalk finds all forms compiled, on any mesh."""
    test = override(coarse, ["protocol.travel_mm=0.3"])
    simulate(test, MPI.COMM_SELF)
    other = override(
        test,
        [
            "stalk.layers.phloem.outer_diameter_mm=15",
            "stalk.layers.phloem.material.elastic.E_Z_MPa=1500",
            "fixture.support_radius_mm=8",
            "numerics.mesh.angular_elements=8",
        ],
    )
    monkeypatch.delattr(dolfinx.jit, "ffcx_jit")
    assert simulate(other, MPI.COMM_SELF).completed
    # the compiler is indeed unavailable
    monkeypatch.setattr(jit, "_forms", {})
    with pytest.raises(AttributeError, match="ffcx_jit"):
        simulate(other, MPI.COMM_SELF)


@pytest.mark.parametrize(("theta", "stabilisation"), [(-1, 20), (1, 60)])
def test_variants_of_nitsches_method_agree(
    coarse: BendingTest, simulated: Simulate, theta: int, stabilisation: float
) -> None:
    """The influence of theta vanishes with the mesh size, as that of gamma; 1 needs a larger gamma.

    The law is the one whose forms take the least time to compile.
    """
    usual = override(coarse, ["law=neo_hookean"])
    settings = [
        f"numerics.contact.theta={theta}",
        f"numerics.contact.stabilisation={stabilisation}",
    ]
    other = simulated(override(usual, settings))
    assert other.completed
    assert other.max_force_N == pytest.approx(simulated(usual).max_force_N, rel=0.02)
    imbalance = (other.curve["force_N"] - other.curve["support_force_N"]).abs().max()
    assert imbalance < 1e-3 * other.max_force_N


@pytest.mark.parametrize("radius", [2.0, 1.0, 0.5])
def test_small_indenter_is_felt_and_presses_less(
    coarse: BendingTest, simulated: Simulate, radius: float
) -> None:
    """The mesh is the coarsest of second order, whose cells are far longer than the contact."""
    changes = ["numerics.mesh=ladder_q2_1", "protocol.travel_mm=1.0"]
    usual, small = (
        simulated(override(coarse, [*changes, f"fixture.indenter_radius_mm={r}"]))
        for r in (5.0, radius)
    )
    assert small.completed
    # a knife edge indents by a few per cent more than a cylinder
    assert 0.75 < small.max_force_N / usual.max_force_N < 1.0
    assert small.curve["penetration_mm"].max() < 0.05


def test_unfelt_indenter_ends_the_run(coarse: BendingTest) -> None:
    """The mesh is the user's own and too coarse for the cylinder, whatever the test's recipe."""
    blunt = override(coarse, ["numerics.mesh=ladder_q2_1", "numerics.mesh.contact_size=0.09"])
    sharp = override(blunt, ["fixture.indenter_radius_mm=0.05"])
    tube = build_tube(blunt, MPI.COMM_SELF)
    result = simulate(sharp, MPI.COMM_SELF, tube=tube)
    assert result.ending.kind == "physical"
    assert "without force" in result.ending.reason
    assert "contact_size" in result.ending.reason


def test_same_run_gives_the_same_bits(coarse: BendingTest) -> None:
    """This holds on one rank, wherever things lie in memory."""
    test = override(coarse, ["protocol.travel_mm=0.5"])
    curves, kept = [], []
    for size in (0, 1001, 30003):
        kept.append(np.empty(size))  # shifts later allocations
        curves.append(simulate(test, MPI.COMM_SELF).curve)
    for curve in curves[1:]:
        assert curve.equals(curves[0])


def test_rounding_does_not_choose_what_a_cylinder_may_touch() -> None:
    """The standard recipe has cells exactly midway between indenter and support."""
    test = override(published_test("table3"), ["numerics.mesh=standard"])
    wider = override(test, ["stalk.layers.phloem.outer_diameter_mm=14.2301"])
    one, other = (BendingProblem(t, MPI.COMM_SELF).contact.obstacles for t in (test, wider))
    for a, b in zip(one, other, strict=True):
        assert np.array_equal(a.facets, b.facets)

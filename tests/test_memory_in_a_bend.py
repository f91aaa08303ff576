"""Bent stalks of a material with memory: permanent deflection, and the energy balance."""

from __future__ import annotations

import numpy as np
import pytest
from mpi4py import MPI

from ramiefenics import BendingTest, Parameter, override, sensitivities, simulate
from ramiefenics.model.bending import BendingProblem
from ramiefenics.model.observables import Observables, Observer
from ramiefenics.solve.explicit import simulate_explicitly
from ramiefenics.solve.explicit_figures import explicit_figure
from ramiefenics.solve.quasistatic import QuasiStatic

YIELD = "stalk.layers.phloem.material.law_constants.tensile_yield_strain"


@pytest.fixture(scope="module")
def yielding(coarse: BendingTest) -> BendingTest:
    changes = ["law=fibre_plasticity", f"{YIELD}=0.002", "numerics.acoustic_check=false"]
    return override(coarse, changes)


def _unloaded(test: BendingTest) -> tuple[list[Observables], float, float]:
    """Bend and unload to zero force; return the observables, the work, and the final travel."""
    problem = BendingProblem(test, MPI.COMM_SELF)
    observer = Observer(problem)
    stepper = QuasiStatic(problem, observer.observe, test.protocol, test.numerics.stepping)
    steps = list(stepper.steps())
    assert all(step.jump is None for step in steps)
    seen, travel = [step.observables for step in steps], [step.travel_mm for step in steps]
    while seen[-1].force_N > 0.02 * steps[-1].observables.force_N:
        problem.place(-0.05, 0.05)
        assert stepper.newton.solve(1e-5, 1.0).converged
        seen.append(observer.observe())
        travel.append(travel[-1] - 0.05)
        problem.accept()
    return seen, float(np.trapezoid([one.force_N for one in seen], travel)), travel[-1]


@pytest.mark.slow
def test_fibres_that_have_yielded_leave_a_bent_stalk(
    coarse: BendingTest, yielding: BendingTest
) -> None:
    seen, work, left_mm = _unloaded(yielding)
    _, _, elastic_mm = _unloaded(coarse)
    dissipated = [one.dissipated_Nmm for one in seen]
    assert np.diff(dissipated).min() >= -1e-9 * dissipated[-1]
    assert dissipated[-1] > 0.2 * work
    spent = seen[-1].stored_energy_Nmm + seen[-1].friction_work_Nmm + dissipated[-1]
    most = max(one.stored_energy_Nmm for one in seen)
    # the trapezoidal rule over steps of up to 0.5 mm has an error relative to the largest energy
    assert spent == pytest.approx(work, abs=0.02 * most)
    assert left_mm > elastic_mm + 0.2


@pytest.mark.slow
def test_derivatives_by_a_constant_of_the_law(yielding: BendingTest) -> None:
    """They agree with central differences of whole simulations, solved to a tight tolerance."""
    test = override(yielding, ["numerics.stepping.relative_tolerance=1e-8"])

    def change(test: BendingTest, amount: float) -> BendingTest:
        return override(test, [f"{YIELD}={0.002 + amount!r}"])

    found = sensitivities(test, {"yield": Parameter(change, 2e-4)}, MPI.COMM_SELF)
    assert found.by_differences == ()
    low, high = (simulate(change(test, a), MPI.COMM_SELF).curve for a in (-2e-6, 2e-6))
    expected = (high["force_N"] - low["force_N"]) / 4e-6
    # points begin to yield on the way, and there the derivative of the force has a kink
    error = np.abs(found.curve["yield"] - expected).max()
    assert error < 0.02 * np.abs(expected).max()


@pytest.mark.slow
def test_explicit_steps_account_for_what_the_material_dissipates(yielding: BendingTest) -> None:
    short = ["protocol.travel_mm=1", "numerics.explicit.duration_s=0.02"]
    result = simulate_explicitly(override(yielding, short), MPI.COMM_SELF)
    assert result.completed
    assert result.curve["dissipated_Nmm"].iloc[-1] > 0.0
    assert result.energy_error < 0.05
    _, energies = explicit_figure(result).axes
    assert "dissipated by the material" in energies.get_legend_handles_labels()[1]


@pytest.mark.mpi
def test_ranks_agree(yielding: BendingTest) -> None:
    changes = ["numerics.stepping.relative_tolerance=1e-9", "protocol.travel_mm=2"]
    test = override(yielding, changes)
    alone, together = simulate(test, MPI.COMM_SELF), simulate(test, MPI.COMM_WORLD)
    for column in ("force_N", "stored_energy_Nmm", "dissipated_Nmm"):
        one, two = alone.curve[column].to_numpy(), together.curve[column].to_numpy()
        assert np.abs(one).max() > 0.0
        assert np.abs(one - two).max() <= 1e-7 * np.abs(one).max(), column
    if MPI.COMM_WORLD.rank == 0:
        first, second = (
            np.sort(result.snapshots[-1].body.cell_data["plastic_strain"])
            for result in (alone, together)
        )
        assert first[-1] > 0.0
        assert np.abs(first - second).max() <= 1e-6 * first[-1]

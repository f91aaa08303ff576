"""Errors of the machine, against springs in series and the expected record of a spring."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

import ramiefenics as rf
from ramiefenics.calibration.responses import response
from ramiefenics.discovery.curves.observed import recorded
from ramiefenics.effects.combining import with_effects

STIFFNESS_N_PER_MM = 20.0
TRAVEL_MM = np.linspace(0.0, 5.0, 201)
FORCE_N = STIFFNESS_N_PER_MM * TRAVEL_MM


def with_(test: rf.BendingTest, **amplitudes: float) -> rf.BendingTest:
    return with_effects(test, [(rf.EFFECTS[name], a) for name, a in amplitudes.items()])


def test_a_bedding_fixture_is_as_stiff_as_its_force(coarse: rf.BendingTest) -> None:
    """The stiffness grows linearly, and has doubled at `bedding_force_N` (Persson 2007)."""
    machine = with_(coarse, nonlinear_compliance=0.02).machine
    displacement, force = machine.recorded(TRAVEL_MM, FORCE_N)
    assert np.array_equal(force, FORCE_N)
    middle = (FORCE_N[1:] + FORCE_N[:-1]) / 2
    softness = np.diff(displacement - TRAVEL_MM) / np.diff(FORCE_N)
    # differences over 0.5 N on a curve that bends over a range of 10 N
    assert 1 / softness == pytest.approx((1 + middle / machine.bedding_force_N) / 0.02, rel=1e-3)
    assert machine.recorded(0.0, -5.0)[0] == -machine.recorded(0.0, 5.0)[0]


def test_the_record_of_a_spring_is_one_in_series_on_wrong_scales(coarse: rf.BendingTest) -> None:
    compliance, gap, scale, offset, stretch = 0.01, 0.3, 0.1, -2.0, 0.05
    test = with_(
        coarse,
        load_scale=scale,
        machine_compliance=compliance,
        seating_gap=gap,
        load_offset=offset,
        displacement_scale=stretch,
    )
    curve = pd.DataFrame({"displacement_mm": TRAVEL_MM, "force_N": FORCE_N})
    at = np.array([0.1, 0.3, 1.0, 2.5, 5.0])
    series = 1 / (1 / STIFFNESS_N_PER_MM + compliance)
    expected = offset + (1 + scale) * series * np.maximum(at - gap, 0.0) / (1 + stretch)
    assert recorded(test, curve, at) == pytest.approx(expected, rel=1e-9)


def test_a_record_that_goes_back_is_refused(coarse: rf.BendingTest) -> None:
    test = with_(coarse, nonlinear_compliance=0.1)
    falling = np.minimum(FORCE_N, 60.0 - FORCE_N)
    curve = pd.DataFrame({"displacement_mm": TRAVEL_MM, "force_N": 4.0 * falling})
    with pytest.raises(rf.SpecificationError, match=r"machine\.bedding_compliance.* low enough"):
        recorded(test, curve, np.array([1.0]))


def test_simulations_are_recorded_and_reduced_as_the_machine_has_them(
    coarse: rf.BendingTest,
) -> None:
    plain = rf.override(coarse, ["protocol.travel_mm=0.5", "numerics.acoustic_check=false"])
    scales = {"load_scale": 0.2, "displacement_scale": -0.1, "nonlinear_compliance": 0.02}
    test = with_(plain, **scales)
    curve = rf.simulate(test).curve
    assert np.allclose(curve["recorded_force_N"], 1.2 * curve["force_N"], rtol=1e-12)
    bedded = 0.2 * np.log1p(curve["force_N"] / 10.0)
    driven = 0.9 * (curve["displacement_mm"] + bedded)
    assert np.allclose(curve["recorded_displacement_mm"], driven, rtol=1e-12)


def test_responses_are_those_of_the_record(coarse: rf.BendingTest, as_result) -> None:
    test = with_(coarse, load_scale=0.2, displacement_scale=-0.1, load_offset=1.0)
    result = as_result(test, TRAVEL_MM, FORCE_N)
    assert response("max_force_N").of_result(result) == pytest.approx(1.2 * 100.0 + 1.0)
    assert response("displacement_at_max_mm").of_result(result) == pytest.approx(4.5)
    assert response("slope_N_per_mm").of_result(result) == pytest.approx(20.0 * 1.2 / 0.9)
    assert response("force_3mm_N").of_result(result) == pytest.approx(1.0 + 80.0)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ("load_scale=0", r"machine\.load_scale = 0 must be a number above 0"),
        ("displacement_scale=-1", r"displacement_scale = -1 must be a number above 0"),
        ("bedding_force_N=0", r"bedding_force_N = 0 must be a number above 0 N"),
        ("bedding_compliance_mm_per_N=-0.1", "must be a number at least 0 mm/N"),
    ],
)
def test_impossible_machines_are_told(coarse: rf.BendingTest, change: str, message: str) -> None:
    with pytest.raises(rf.SpecificationError, match=message):
        rf.override(coarse, [f"machine.{change}"])

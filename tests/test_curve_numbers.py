"""Noise, slope, zero, peak, energy and drop of curves with known values."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

import ramiefenics as rf
from ramiefenics.calibration.responses import response
from ramiefenics.measured import initial_slope, noise, seat
from ramiefenics.reduction import reduce_curve

SLOPE, TOE, LINEAR_TO, SOFTENING = 20.0, 0.6, 4.0, 2.0
"""Slope, N/mm, length of the toe, end of the linear part, and length of the softening part, mm.

The slope grows to its value over the toe, and falls to zero after the linear part."""

PEAK_AT, PEAK = LINEAR_TO + SOFTENING, SLOPE * (LINEAR_TO - TOE / 2 + SOFTENING / 2)


def exact(travel: np.ndarray) -> np.ndarray:
    toe = SLOPE * travel**2 / (2 * TOE)
    linear = SLOPE * (travel - TOE / 2)
    past = travel - LINEAR_TO
    softening = SLOPE * (LINEAR_TO - TOE / 2 + past - past**2 / (2 * SOFTENING))
    broken = PEAK * np.maximum(1 - 1.2 * (travel - PEAK_AT), 0.4)
    return np.select(
        [travel < TOE, travel < LINEAR_TO, travel <= PEAK_AT], [toe, linear, softening], broken
    )


def measured(sd: float = 0.2, number: int = 1600, seed: int = 1) -> pd.DataFrame:
    travel = np.linspace(0.0, 8.0, number)
    force = exact(travel) + sd * np.random.default_rng(seed).standard_normal(number)
    return pd.DataFrame({"displacement_mm": travel, "force_N": force})


@pytest.mark.parametrize("spacing", ["even", "uneven"])
def test_noise_is_that_of_the_draws(spacing: str) -> None:
    rng = np.random.default_rng(2)
    travel = np.linspace(0, 8, 4000) if spacing == "even" else np.sort(rng.uniform(0, 8, 4000))
    force = exact(travel) + 0.3 * rng.standard_normal(4000)
    curve = pd.DataFrame({"displacement_mm": travel, "force_N": force})
    # a median of 4000 correlated terms has a standard error of about 2 %
    assert noise(curve) == pytest.approx(0.3, rel=0.06)
    curve.loc[2000:, "force_N"] -= 30.0  # a crack
    assert noise(curve) == pytest.approx(0.3, rel=0.06)


def test_noise_is_seen_where_displacement_is_recorded_in_steps() -> None:
    curve = measured(0.3, 4000)
    curve["displacement_mm"] = (curve["displacement_mm"] / 0.05).round() * 0.05  # 25 rows each
    assert noise(curve) == pytest.approx(0.3, rel=0.06)


def test_noise_needs_three_rows() -> None:
    assert np.isnan(noise(pd.DataFrame({"displacement_mm": [0.0, 1.0], "force_N": [0.0, 1.0]})))


@pytest.mark.parametrize(("sd", "within"), [(0.0, 1e-6), (0.2, 0.01), (1.0, 0.02)])
def test_slope_is_that_of_the_linear_part(sd: float, within: float) -> None:
    found = initial_slope(measured(sd))
    # the window includes some of the toe and softening, which move the median only with noise
    assert found.N_per_mm == pytest.approx(SLOPE, rel=within)
    assert found.stable
    assert 0.2 * TOE < found.from_mm < TOE + 0.2
    assert LINEAR_TO - 0.5 < found.to_mm < LINEAR_TO + 0.5 * SOFTENING
    # an error of the slope turns the line about the window's middle, 2.5 mm from the zero
    assert found.zero_mm == pytest.approx(TOE / 2, abs=0.01 + 2.5 * within)


def test_wild_points_do_not_carry_the_slope_away() -> None:
    curve = measured()
    curve.loc[100:700:20, "force_N"] += 25.0
    assert initial_slope(curve).N_per_mm == pytest.approx(SLOPE, rel=0.02)


def test_interval_of_the_slope_covers_the_true_one_as_often_as_it_says() -> None:
    """For a straight line with white noise, 95 % of 200 minus three standard errors is 180."""
    travel = np.linspace(0.0, 5.0, 300)
    covered = 0
    for seed in range(200):
        force = SLOPE * travel + np.random.default_rng(seed).standard_normal(300)
        found = initial_slope(pd.DataFrame({"displacement_mm": travel, "force_N": force}))
        covered += found.low_N_per_mm <= SLOPE <= found.high_N_per_mm
    assert covered >= 180


def test_a_curve_without_linear_part_says_so() -> None:
    travel = np.linspace(0.0, 8.0, 800)
    bent = pd.DataFrame({"displacement_mm": travel, "force_N": 50 * (1 - np.exp(-2 * travel))})
    found = initial_slope(bent)
    assert not found.stable
    assert found.to_mm < 0.5  # 1 - exp(-2 d) has risen by 0.63 there
    assert 60 < found.N_per_mm < 100  # between the slope at zero and that somewhat later


def test_peak_energy_and_drop() -> None:
    found = reduce_curve(measured(0.0, 16001))
    toe = SLOPE * TOE**2 / 6
    linear = SLOPE / 2 * ((LINEAR_TO - TOE / 2) ** 2 - (TOE / 2) ** 2)
    force = SLOPE * (LINEAR_TO - TOE / 2)
    to_peak = toe + linear + force * SOFTENING + SLOPE * SOFTENING**2 / 3
    assert found.peak_N == pytest.approx(PEAK)
    assert found.peak_at_mm == pytest.approx(PEAK_AT, abs=1e-3)
    # the error of the trapezoidal rule scales with the square of 0.5 um
    assert found.energy_to_peak_Nmm == pytest.approx(to_peak, rel=1e-6)
    broken = PEAK * (0.5 * (1.0 + 0.4) * 0.5 + 0.4 * 1.5)
    assert found.energy_Nmm == pytest.approx(to_peak + broken, rel=1e-6)
    assert found.drop == pytest.approx(0.6)
    assert found.drop_N == pytest.approx(0.6 * PEAK)
    assert not found.still_rising


def test_a_record_that_ends_before_the_peak_is_told() -> None:
    curve = measured(0.0)
    assert reduce_curve(curve[curve["displacement_mm"] < 4.0]).still_rising


def test_a_sudden_break_on_the_last_rows_is_a_peak() -> None:
    curve = measured(0.0)
    curve = curve[curve["displacement_mm"] < 4.0].copy()
    curve.iloc[-1, 1] = 5.0
    assert not reduce_curve(curve).still_rising


def test_toe_compensation_moves_zero_to_where_the_line_has_no_force() -> None:
    found = seat(measured(), rf.Seating("toe"))
    assert found["displacement_mm"].iloc[0] == pytest.approx(0.0, abs=0.02)
    assert reduce_curve(found).peak_at_mm == pytest.approx(PEAK_AT - TOE / 2, abs=0.15)
    line = found[(found["displacement_mm"] > 1.0) & (found["displacement_mm"] < 3.0)]
    assert (line["force_N"] / line["displacement_mm"]).mean() == pytest.approx(SLOPE, rel=0.01)


@pytest.mark.parametrize("tared", [False, True])
def test_a_preload_counts_with_the_displacement_it_took(tared: bool) -> None:
    """A preload of 3 N at 20 N/mm takes 0.15 mm that the machine did not record."""
    travel = np.linspace(0.0, 8.0, 1600)
    force = exact(travel + TOE / 2 + LINEAR_TO / 4) - 20.0 + 3.0 * (not tared)
    curve = pd.DataFrame({"displacement_mm": travel, "force_N": force})
    found = seat(curve, rf.Seating("toe", preload_N=3.0 * tared))
    assert found["displacement_mm"].iloc[0] == pytest.approx(0.15, abs=0.02)
    assert found["force_N"].iloc[0] == pytest.approx(3.0)
    assert len(found) == len(curve)


def test_contact_is_where_the_force_leaves_the_noise() -> None:
    """After a gap of 0.5 mm the slope is 20 N/mm: five times 0.05 N is reached 0.0125 mm later."""
    rng = np.random.default_rng(3)
    travel = np.linspace(0.0, 5.0, 5000)
    force = 20.0 * np.maximum(travel - 0.5, 0.0) + 0.05 * rng.standard_normal(5000)
    curve = pd.DataFrame({"displacement_mm": travel, "force_N": force})
    by_noise = seat(curve, rf.Seating("threshold"))
    assert 5.0 - by_noise["displacement_mm"].iloc[-1] == pytest.approx(0.5125, abs=0.01)
    at_two = seat(curve, rf.Seating("threshold", threshold_N=2.0))
    assert 5.0 - at_two["displacement_mm"].iloc[-1] == pytest.approx(0.6, abs=0.01)


def test_a_threshold_that_is_never_passed_is_told() -> None:
    with pytest.raises(rf.SpecificationError, match=r"threshold_N = 500.*below the largest force"):
        seat(measured(), rf.Seating("threshold", threshold_N=500.0))


def test_a_contact_before_the_record_is_told() -> None:
    late = measured()[lambda curve: curve["displacement_mm"] > 1.0]
    with pytest.raises(rf.SpecificationError, match=r"threshold_N = 2\.0 must be at least .* 14"):
        seat(late, rf.Seating("threshold", threshold_N=2.0))


def test_a_toe_far_before_the_record_is_told() -> None:
    """In a record from 3 mm on, the straight part ends by 4.5 mm, and the toe is 2.7 mm away."""
    late = measured()[lambda curve: curve["displacement_mm"] > 3.0]
    with pytest.raises(rf.SpecificationError, match=r"zero = 'toe' must not precede the record"):
        seat(late, rf.Seating("toe"))


def test_a_toe_needs_a_rise() -> None:
    curve = measured(0.0)
    curve.loc[0, "force_N"] = 2.0 * PEAK
    with pytest.raises(rf.SpecificationError, match=r"'toe' needs a curve that rises from its"):
        seat(curve, rf.Seating("toe"))


def test_what_seating_leaves_is_a_curve() -> None:
    with pytest.raises(rf.SpecificationError, match=r"must leave at least 20 rows .* leaves \d+"):
        seat(measured(0.0, 60), rf.Seating("threshold", threshold_N=0.999 * PEAK))


@pytest.mark.parametrize("force", [exact(np.linspace(1.0, 8.0, 99)), np.repeat([50.0, 60.0], 50)])
def test_a_slope_that_is_not_recorded_from_its_start_is_not_a_number(force: np.ndarray) -> None:
    """The secant starts at a tenth of the largest force."""
    curve = pd.DataFrame({"displacement_mm": np.linspace(1.0, 8.0, len(force)), "force_N": force})
    assert np.isnan(response("slope_N_per_mm").of(curve))


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"zero": "first"}, r"zero = 'first' must be one of 'machine'"),
        ({"preload_N": -1.0}, r"preload_N = -1.0 must be a number at least 0 N"),
        ({"zero": "threshold", "threshold_N": 0.0}, r"threshold_N = 0.0.*above 0 N"),
        ({"zero": "toe", "threshold_N": 1.0}, r"threshold_N = 1.0 must be left out"),
    ],
)
def test_unusable_seating_is_told(values: dict[str, object], message: str) -> None:
    with pytest.raises(rf.SpecificationError, match=message):
        rf.Seating(**values)

"""Simulated curves are read without their toe if the measured ones are."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

import ramiefenics as rf
from ramiefenics.discovery.curves.observed import read
from ramiefenics.measured.noise import level
from ramiefenics.measured.seating import Seating, seat, straight_part, toe_mm

TOE = Seating(zero="toe")
AT = np.linspace(0.5, 8.0, 20)


def bent_N(x: np.ndarray) -> np.ndarray:
    """Return the force of a contact that stiffens over 0.3 mm, and a beam that softens."""
    x = np.asarray(x)
    return 12.0 * (x - 0.3 * (1.0 - np.exp(-x / 0.3))) - 0.35 * x**2


def simulated(step_mm: float = 0.25) -> pd.DataFrame:
    x = np.arange(0.0, 9.0, step_mm)
    return pd.DataFrame({"displacement_mm": x, "force_N": bent_N(x)})


def test_the_same_stalk_is_read_the_same_whatever_the_machines_zero() -> None:
    """With its toe a simulated curve is off by 2 % of the peak; without, by at most 0.5 %."""
    at = np.arange(0.0, 9.0, 0.01)
    recorded = pd.DataFrame({"displacement_mm": at + 1.7, "force_N": bent_N(at)})
    moved, straight = seat(recorded, TOE), straight_part(recorded, TOE)
    measured = np.array([level(moved, float(d), 0.1) for d in AT])
    test = rf.ramie(14.23, 7.28, 0.67)
    peak = measured.max()
    with_toe = np.abs(read(test, simulated(), AT) - measured).max()
    without = np.abs(read(test, simulated(), AT, straight) - measured).max()
    assert with_toe > 0.019 * peak
    assert without < 0.005 * peak


def test_a_gap_makes_no_difference_behind_a_toe() -> None:
    test = rf.ramie(14.23, 7.28, 0.67)
    gap = replace(test, machine=rf.Machine(seating_gap_mm=0.4))
    recorded = simulated(0.01)
    straight = straight_part(recorded, TOE)
    toe = toe_mm(lambda x: bent_N(x), straight)
    assert 0.1 < toe < 0.3
    one, other = (read(each, simulated(), AT, straight) for each in (test, gap))
    assert other == pytest.approx(one, abs=0.01 * one.max())


def test_a_toe_is_as_smooth_as_the_forces() -> None:
    """Its derivative by the beam's softening is the same from both sides."""
    straight = straight_part(simulated(0.01), TOE)
    assert straight is not None

    def toe(share: float) -> float:
        return toe_mm(lambda x: bent_N(x) - share * x**2, straight)

    slopes = [(toe(s) - toe(0.0)) / s for s in (-1e-3, 1e-3, 1e-5)]
    assert slopes == pytest.approx([slopes[0]] * 3, rel=0.01)


def test_an_offset_of_the_load_moves_the_zero_by_what_it_is_worth() -> None:
    """As on a machine, it moves by offset over slope, here farther than the straight part."""
    straight = straight_part(simulated(0.01), TOE)
    offset, toe = 30.0, toe_mm(bent_N, straight)
    moved = toe_mm(lambda x: np.where(x < 0.0, offset, bent_N(x) + offset), straight)
    assert straight is not None
    slope = float(np.diff(bent_N(np.array(straight)))[0] / (straight[1] - straight[0]))
    assert toe - moved == pytest.approx(offset / slope, rel=0.05)  # slope of a secant


def test_other_seatings_leave_the_toe() -> None:
    assert straight_part(simulated(0.01), Seating()) is None
    assert toe_mm(bent_N, None) == 0.0
    with pytest.raises(rf.SpecificationError, match="must leave simulated curves that rise"):
        toe_mm(lambda x: -np.asarray(x), (0.5, 1.0))

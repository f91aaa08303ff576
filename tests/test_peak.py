"""The maximum of a curve with few steps: of a parabola, and beside a jump."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

import ramiefenics as rf
from ramiefenics.solve.peak import find_peak
from ramiefenics.solve.quasistatic import Jump

X = np.array([0.0, 1.0, 2.5, 3.0, 4.5, 5.0])


def test_a_parabolas_maximum_is_exact_whatever_the_steps() -> None:
    found = find_peak(X, 10.0 - (X - 3.3) ** 2)
    assert found.force_N == pytest.approx(10.0)
    assert found.displacement_mm == pytest.approx(3.3)
    assert found.inside
    assert found.step_error_N == pytest.approx(1.5**2 * 2.0 / 8.0)  # h^2 f'' / 8, longest step


def test_no_parabola_goes_through_a_jump() -> None:
    """The force rises by 10 N/mm up to 3 mm, and falls by 40 % within the next 0.05 mm."""
    x = np.array([0.0, 1.0, 2.0, 2.9, 3.0, 3.05, 4.0])
    force = np.where(x <= 3.0, 10.0 * x, 15.0 + x)
    found = find_peak(x, force, [3.05])
    assert found.force_N == 30.0
    assert found.displacement_mm == 3.0
    assert found.inside
    assert found.step_error_N == pytest.approx(0.5)  # 10 N/mm over 0.05 mm
    assert find_peak(x, force).force_N > 30.3  # the wrong peak, if the jump were ignored


def test_a_jump_elsewhere_changes_nothing() -> None:
    force = 10.0 - (X - 3.3) ** 2 - np.where(X < 2.0, 4.0, 0.0)
    found = find_peak(X, force, [2.5])
    assert found.force_N == pytest.approx(10.0)


def test_a_result_knows_its_jumps(
    coarse: rf.BendingTest, as_result: Callable[..., rf.BendingResult]
) -> None:
    x = np.array([0.0, 1.0, 2.0, 2.5, 2.6, 3.0])
    result = as_result(coarse, x, np.array([0.0, 10.0, 20.0, 25.0, 12.0, 14.0]))
    jump = Jump(2.6, 1.0, 25.0, 12.0)
    assert replace(result, jumps=(jump,)).max_force_N == 25.0
    assert result.max_force_N > 25.0

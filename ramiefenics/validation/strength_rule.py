"""The simplest predictor: all stalks fail at the same nominal bending stress."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ramiefenics.reduction.equations import maximum_stress, section_modulus
from ramiefenics.specification import BendingTest


def nominal_strength(test: BendingTest, force_N: float) -> float:
    """Return P L / 4 W, MPa, Eqs. 6 and 7: the bending stress in a homogeneous section.

    L is the distance between the supports, in four-point bending less that between the indenters.

    Raises
    ------
    SpecificationError
        If the fixture is neither for three-point nor for four-point bending.
    """
    stalk, beam = test.stalk, test.fixture.check_beam("P L / 4 W is")
    modulus = section_modulus(stalk.outer_diameter_mm, stalk.void_diameter_mm, stalk.height_mm)
    return float(maximum_stress(force_N, 2.0 * beam.arm_mm, modulus))


def by_strength(
    tests: Mapping[str, BendingTest], measured: Mapping[str, tuple[float, float]]
) -> dict[str, float]:
    """Return the maximum force of every test, N, for the mean P L / 4 W of the measured ones.

    Parameters
    ----------
    tests
        Specifications with geometry and fixture, by name.
    measured
        Maximum force and its standard error, N, of one or more of these tests, by name. Their
        strengths are averaged with the inverse squares of the errors as weights.
    """
    strengths = [nominal_strength(tests[name], force) for name, (force, _) in measured.items()]
    errors = [nominal_strength(tests[name], error) for name, (_, error) in measured.items()]
    strength = np.average(strengths, weights=1.0 / np.square(errors))
    return {name: float(strength / nominal_strength(test, 1.0)) for name, test in tests.items()}

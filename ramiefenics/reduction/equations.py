"""Formulas for a bending test: Eqs. 1 to 3, 6 and 7 of the published study.

The study is "Bending mechanics test and parameters calibration of ramie stalks". All functions take
numbers or arrays, in mm, N and MPa.

The functions differ from the study in two points. The constant of Eq. 2 is 8/pi = 2.546, not the
printed 2.564. And the result of Eq. 2, which the study calls the bending modulus of elasticity, is
a shear modulus, for the following reason. A beam on two supports with overhangs deflects by
``f_b = P L^3 / (48 EI)`` at midspan and rises by ``f_1 = a P L^2 / (16 EI)`` at the end of an
overhang of length a, so that ``f_1 L / (3 a)`` in Eq. 1 is ``f_b``. The denominator of Eq. 1
therefore contains the remaining deflection, that by shear, ``f - f_b = P L / (4 U)`` (Timoshenko
1921), and U is the shear stiffness, GA over a shear coefficient, in N. A bending stiffness, EI,
would be in N mm2. The 2 in Eq. 2 is the shear coefficient of a thin-walled tube (Cowper 1966), A is
the area of the section, and the quotient is G. The modulus of bending is `bending_modulus`.
"""

from __future__ import annotations

import math
from typing import Any


def shear_stiffness(
    load_N: Any,
    deflection_mm: Any,
    span_mm: Any,
    overhang_deflection_mm: Any = None,
    overhang_mm: Any = None,
) -> Any:
    """Return the shear stiffness U, N, of Eq. 1.

    Parameters
    ----------
    load_N, deflection_mm
        Increments of the force and of the deflection at midspan, in the elastic range.
    span_mm
        Distance L between the supports, in four-point bending less that between the indenters.
    overhang_deflection_mm
        Increment of the upward deflection f_1 at the end of an overhang. If it is left out, the
        deflection by bending is attributed to shear as well, and U is too low.
    overhang_mm
        Length a of the overhang.

    Raises
    ------
    ValueError
        If one of the last two is given without the other.
    """
    if (overhang_deflection_mm is None) != (overhang_mm is None):
        raise ValueError("overhang_deflection_mm and overhang_mm must be given together")
    by_bending = 0.0
    if overhang_mm is not None:
        by_bending = overhang_deflection_mm * span_mm / (3.0 * overhang_mm)
    return load_N * span_mm / (4.0 * (deflection_mm - by_bending))


def shear_modulus(
    shear_stiffness_N: Any, outer_mm: Any, inner_mm: Any = 0.0, height_mm: Any = None
) -> Any:
    """Return the shear modulus G, MPa, of Eq. 2, with 2.546 in place of the printed 2.564.

    The study calls it the bending modulus of elasticity; see the docstring of this module. The
    shear coefficient of 2 is that of a thin wall. It is 1.70 if the inner diameter is half the
    outer one, and 1.17 for a solid section (Cowper 1966, Poisson's ratio 0), so that G is too high
    by 18 and 71 %.

    Parameters
    ----------
    shear_stiffness_N
        Shear stiffness U of Eq. 1.
    outer_mm, inner_mm, height_mm
        Dimensions of the section, as in `section_modulus`.
    """
    return 2.0 * shear_stiffness_N / section_area(outer_mm, inner_mm, height_mm)


def section_area(outer_mm: Any, inner_mm: Any = 0.0, height_mm: Any = None) -> Any:
    """Return the area of a hollow circle or ellipse, mm2; parameters as in `section_modulus`."""
    height = outer_mm if height_mm is None else height_mm
    return math.pi / 4.0 * outer_mm * height * (1.0 - (inner_mm / outer_mm) ** 2)


def phloem_ratio(outer_mm: Any, inner_mm: Any, phloem_mm: Any) -> Any:
    """Return the volume ratio V1 of the phloem, Eq. 3, which is correct as printed.

    It is the area of the outermost ring over that of the tube.

    Parameters
    ----------
    outer_mm, inner_mm
        Diameters of the tube.
    phloem_mm
        Thickness of the phloem.
    """
    ring = 4.0 * outer_mm * phloem_mm - 4.0 * phloem_mm**2
    return ring / (outer_mm**2 - inner_mm**2)


def maximum_stress(force_N: Any, span_mm: Any, section_modulus_mm3: Any) -> Any:
    """Return the largest bending stress in three-point bending, MPa: Eq. 6 with M = P L / 4.

    In four-point bending M = P (L - l) / 4, where l is the distance between the indenters.

    At the peak force, this stress is the nominal strength: the largest stress at failure in a
    homogeneous, elastic beam with the undeformed section.

    Parameters
    ----------
    force_N, span_mm
        Total force, and distance between the supports, in four-point bending less that between the
        indenters.
    section_modulus_mm3
        Section modulus W of Eq. 7.
    """
    return force_N * span_mm / (4.0 * section_modulus_mm3)


def section_modulus(outer_mm: Any, inner_mm: Any = 0.0, height_mm: Any = None) -> Any:
    """Return the section modulus W, mm3: Eq. 7, and its equivalent for an ellipse.

    For an ellipse of width w and height h, it is ``pi w h^2 (1 - m^4) / 32``, where m is the ratio
    of the inner to the outer width (Young and Budynas 2002, Table A.1).

    Parameters
    ----------
    outer_mm
        Diameter; for an ellipse, the width perpendicular to the force.
    inner_mm
        Diameter of the void, 0 if there is none; for an ellipse, the width of the void, which has
        the same shape.
    height_mm
        Height of an ellipse, in the direction of the force; by default the section is a circle.
    """
    height = outer_mm if height_mm is None else height_mm
    return math.pi / 32.0 * outer_mm * height**2 * (1.0 - (inner_mm / outer_mm) ** 4)


def bending_modulus(
    slope_N_per_mm: Any,
    span_mm: Any,
    outer_mm: Any,
    inner_mm: Any = 0.0,
    height_mm: Any = None,
    inner_span_mm: Any = 0.0,
) -> Any:
    """Return the apparent Young's modulus, MPa, of a slender beam: E = k L^3 / (48 I).

    In four-point bending it is ``k (L - l)^2 (L + 2 l) / (48 I)``, because the machine records the
    displacement of the indenters. With the distance a = (L - l) / 2 between a support and an
    indenter, this is ``k a^2 (3 L - 4 a) / (12 I)``. The deflection at midspan is another one,
    ``P a (3 L^2 - 4 a^2) / (48 E I)``. Both follow from the deflection of a beam with two equal
    loads (Gere and Goodno 2013, Table G-2).

    Shear, crushing of the section and the compliance of the machine count as bending, so that the
    result is a lower bound.

    Parameters
    ----------
    slope_N_per_mm
        Initial slope k of the total force over the displacement of the indenters.
    span_mm
        Distance L between the supports.
    outer_mm, inner_mm, height_mm
        Dimensions of the section, as in `section_modulus`; I is W times half the height.
    inner_span_mm
        Distance l between two indenters; 0 if there is only one.
    """
    height = outer_mm if height_mm is None else height_mm
    second_moment = section_modulus(outer_mm, inner_mm, height_mm) * height / 2.0
    cubed = (span_mm - inner_span_mm) ** 2 * (span_mm + 2.0 * inner_span_mm)
    return slope_N_per_mm * cubed / (48.0 * second_moment)

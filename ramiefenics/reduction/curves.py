"""Reduction of one measured curve to numbers."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd

from ramiefenics.measured import Record, initial_slope, noise
from ramiefenics.measured.work import work
from ramiefenics.reduction import equations

QUANTITIES: dict[str, tuple[str, str]] = {
    "slope_N_per_mm": ("Initial slope", "N/mm"),
    "peak_N": ("Peak force", "N"),
    "peak_at_mm": ("Displacement at the peak", "mm"),
    "energy_to_peak_Nmm": ("Energy to the peak", "N mm"),
    "energy_Nmm": ("Total energy", "N mm"),
    "drop": ("Drop after the peak, relative to the peak", "1"),
    "strength_MPa": ("Nominal strength M/W", "MPa"),
    "bending_modulus_MPa": ("Apparent bending modulus", "MPa"),
    "shear_modulus_MPa": ("Apparent shear modulus", "MPa"),
}
"""Title and unit of the quantities by which groups are compared."""

AT_END = 0.01
"""Share of the displacement at the end of a record within which a peak may not be a maximum.

It is not a maximum there if the force drops afterwards by less than the same share of the peak.
"""


@dataclass(frozen=True)
class CurveNumbers:
    """Numbers computed from a measured curve.

    Attributes
    ----------
    noise_N
        Standard deviation of the noise from row to row.
    slope_N_per_mm
        Initial slope.
    slope_low_N_per_mm
        Lower end of its 95 % interval.
    slope_high_N_per_mm
        Upper end of its 95 % interval.
    slope_from_mm
        Displacement from which the slope was taken.
    slope_to_mm
        Displacement to which the slope was taken.
    slope_stable
        Whether the curve is straight there.
    peak_N
        Largest force.
    peak_at_mm
        Displacement at the largest force.
    still_rising
        Whether the peak lies at the end of the record. It is then a lower bound.
    end_mm
        Displacement at the end of the record.
    energy_to_peak_Nmm
        Work of the indenter up to the peak.
    energy_Nmm
        Work of the indenter up to the end of the record.
    drop_N
        Drop from the peak to the least force after it.
    drop
        The same as a share of the peak.
    """

    noise_N: float
    slope_N_per_mm: float
    slope_low_N_per_mm: float
    slope_high_N_per_mm: float
    slope_from_mm: float
    slope_to_mm: float
    slope_stable: bool
    peak_N: float
    peak_at_mm: float
    still_rising: bool
    end_mm: float
    energy_to_peak_Nmm: float
    energy_Nmm: float
    drop_N: float
    drop: float


def reduce_curve(curve: pd.DataFrame) -> CurveNumbers:
    """Reduce one curve.

    Parameters
    ----------
    curve
        Columns ``displacement_mm``, ascending, and ``force_N``, with a peak above 0 N.
    """
    travel, force = curve["displacement_mm"].to_numpy(), curve["force_N"].to_numpy()
    slope = initial_slope(curve)
    top = int(force.argmax())
    peak, end = float(force[top]), float(travel[-1])
    drop = peak - float(force[top:].min())
    return CurveNumbers(
        noise_N=noise(curve),
        slope_N_per_mm=slope.N_per_mm,
        slope_low_N_per_mm=slope.low_N_per_mm,
        slope_high_N_per_mm=slope.high_N_per_mm,
        slope_from_mm=slope.from_mm,
        slope_to_mm=slope.to_mm,
        slope_stable=slope.stable,
        peak_N=peak,
        peak_at_mm=float(travel[top]),
        still_rising=bool(end - travel[top] <= AT_END * np.ptp(travel)) and drop < AT_END * peak,
        end_mm=end,
        energy_to_peak_Nmm=work(curve, float(travel[top])),
        energy_Nmm=work(curve, end),
        drop_N=drop,
        drop=drop / peak,
    )


def reduce_section(record: Record, numbers: CurveNumbers) -> dict[str, float]:
    """Return the nominal strength and the apparent moduli, MPa, with the dimensions of the section.

    ``strength_MPa`` is for the section as specified, turned to the nearest right angle, and
    ``strength_turned_MPa`` for the section turned by a right angle from there. The two are the
    range of the strength if it was not recorded which diameter faced the indenter. The moduli are
    apparent: each attributes the whole deflection to one cause.
    """
    stalk = record.test.stalk
    beam = record.test.fixture.check_beam("strengths and moduli are")
    span, inner_span = beam.supports_mm, beam.indenters_mm
    arms = 2.0 * beam.arm_mm  # the span of three-point bending with the same moment and shear force
    outer, inner, height = stalk.outer_diameter_mm, stalk.void_diameter_mm, stalk.height_mm
    if round(stalk.rotation_deg / 90.0) % 2:
        outer, inner, height = height, inner * height / outer, outer
    upright = equations.section_modulus(outer, inner, height)
    turned = equations.section_modulus(height, inner * height / outer, outer)
    slope = numbers.slope_N_per_mm
    return {
        "span_mm": span,
        "inner_span_mm": inner_span,
        "width_mm": outer,
        "height_mm": height,
        "void_width_mm": inner,
        "section_modulus_mm3": upright,
        "strength_MPa": equations.maximum_stress(numbers.peak_N, arms, upright),
        "strength_turned_MPa": equations.maximum_stress(numbers.peak_N, arms, turned),
        "bending_modulus_MPa": equations.bending_modulus(
            slope, span, outer, inner, height, inner_span
        ),
        "shear_modulus_MPa": equations.shear_modulus(
            equations.shear_stiffness(slope, 1.0, arms), outer, inner, height
        ),
    }

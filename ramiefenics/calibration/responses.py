"""Responses: named numbers that characterise a force curve, measured or simulated."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pandas as pd

from ramiefenics.measured.work import work
from ramiefenics.solve.peak import Peak, secant_slope
from ramiefenics.solve.result import BendingResult
from ramiefenics.specification import Machine, SpecificationError

Curve = pd.DataFrame
"""Columns ``displacement_mm``, ascending, and ``force_N``, both as the machine records them."""


@dataclass(frozen=True)
class Response:
    """A number computed from a force curve.

    Attributes
    ----------
    name
        Name with unit, such as ``max_force_N``.
    title, unit
        Title and unit for tables and figures.
    of
        Function that returns the response of a curve; NaN where the curve does not determine it.
    of_peak
        Function that returns the response of a simulation from its maximum, for responses that the
        few, exact points of a simulation determine better than the many, noisy ones of a measured
        curve.
    needs_peak
        Whether the response is unknown if the curve ends early, while the force still rises.
    at_mm
        Displacement that the curve must reach.
    """

    name: str
    title: str
    unit: str
    of: Callable[[Curve], float]
    needs_peak: bool = False
    at_mm: float = 0.0
    of_peak: Callable[[Machine, Peak], float] | None = None

    def check_travel(self, travel_mm: float) -> None:
        """Check that the travel reaches the displacement at which the response is read.

        Raises
        ------
        SpecificationError
            If it does not.
        """
        if self.at_mm > travel_mm:
            allowed = f"must be read within the travel of {travel_mm:g} mm"
            raise SpecificationError("response", self.name, allowed)

    @property
    def label(self) -> str:
        """Title with unit, as the label of an axis."""
        return f"{self.title[0].upper()}{self.title[1:]} ({self.unit})"

    def of_result(self, result: BendingResult) -> float:
        """Return the response of a simulation; NaN if the simulation ended too early."""
        if self.needs_peak and not (result.completed or result.has_force_maximum):
            return math.nan
        return self.of_loading(result.loading, result.peak, result.test.machine)

    def of_loading(self, loading: Curve, peak: Peak, machine: Machine) -> float:
        """Return the response of a simulated loading.

        Parameters
        ----------
        loading
            Travel of the indenter and force on it, in columns as those of `Curve`.
        peak
            Its maximum.
        machine
            Machine that records the loading.
        """
        if self.of_peak is not None:
            return self.of_peak(machine, peak)
        x, force = machine.recorded(loading["displacement_mm"], loading["force_N"])
        return self.of(pd.DataFrame({"displacement_mm": x, "force_N": force}))


def response(name: str) -> Response:
    """Return the response with a given name.

    Parameters
    ----------
    name
        ``max_force_N``, ``displacement_at_max_mm``, ``slope_N_per_mm`` (secant between 10 and
        40 % of the largest force), ``force_4mm_N`` (the force at that displacement) or
        ``energy_4mm_Nmm`` (the work up to that displacement); the last two also with any other
        displacement.

    Raises
    ------
    SpecificationError
        If there is no response of that name.
    """
    if name in CURVE:
        return CURVE[name]
    match = re.fullmatch(r"(force|energy)_(\d+(?:\.\d+)?)mm_(N|Nmm)", name)
    if (
        match is not None
        and float(match[2]) > 0.0
        and match[3] == {"force": "N", "energy": "Nmm"}[match[1]]
    ):
        at, words = float(match[2]), {"force": "force at", "energy": "energy up to"}[match[1]]
        unit = "N" if match[1] == "force" else "N mm"
        return Response(name, f"{words} {at:g} mm", unit, _at(AT[match[1]], at), at_mm=at)
    known = ", ".join(CURVE)
    allowed = f"must be one of {known}, force_4mm_N, energy_4mm_Nmm or the like"
    raise SpecificationError("response", name, allowed)


def _at(of: Callable[[Curve, float], float], at_mm: float) -> Callable[[Curve], float]:
    return lambda curve: of(curve, at_mm)


def _max_force(curve: Curve) -> float:
    return float(curve["force_N"].max())


def _displacement_at_max(curve: Curve) -> float:
    return float(curve["displacement_mm"].iloc[int(curve["force_N"].to_numpy().argmax())])


def _recorded_peak(machine: Machine, peak: Peak) -> tuple[float, float]:
    """Return the recorded displacement and force where the force on the indenter is largest."""
    at, force = machine.recorded(peak.displacement_mm, peak.force_N)
    return float(at), float(force)


def _slope(curve: Curve) -> float:
    return secant_slope(curve["displacement_mm"], curve["force_N"])


def _force(curve: Curve, at_mm: float) -> float:
    """Return the force at a displacement, by linear interpolation."""
    return float(
        np.interp(at_mm, curve["displacement_mm"], curve["force_N"], left=math.nan, right=math.nan)
    )


AT: dict[str, Callable[[Curve, float], float]] = {"force": _force, "energy": work}

CURVE = {
    found.name: found
    for found in (
        Response(
            "max_force_N",
            "maximum force",
            "N",
            _max_force,
            needs_peak=True,
            of_peak=lambda machine, peak: _recorded_peak(machine, peak)[1],
        ),
        Response(
            "displacement_at_max_mm",
            "displacement at maximum force",
            "mm",
            _displacement_at_max,
            needs_peak=True,
            of_peak=lambda machine, peak: _recorded_peak(machine, peak)[0],
        ),
        Response("slope_N_per_mm", "slope", "N/mm", _slope, needs_peak=True),
    )
}
"""Responses that are computed from the whole curve, by name."""

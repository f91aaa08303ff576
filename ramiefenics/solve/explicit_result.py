"""What a simulation with inertia gives back."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.interpolate import PchipInterpolator

from ramiefenics.model.observables import Observables
from ramiefenics.solve.quasistatic import Ending
from ramiefenics.specification import BendingTest

START = 0.1
"""Share of the travel after which energies are judged; before it hardly any is stored."""

QUASI_STATIC = 0.05
"""Kinetic over stored energy up to which a test counts as quasi-static, by common practice."""


@dataclass(frozen=True)
class Point:
    """What is known at a point of the curve; energies and works of the whole stalk, N mm.

    Attributes
    ----------
    time_s, travel_mm, time_step_s
        Where the test is, and the time step that led there.
    observables
        What was measured; forces are momentary.
    kinetic_energy_Nmm
        Of the stalk.
    indenter_work_Nmm, support_integral_Nmm
        Integrals over the travel of the forces of the indenter and of the supports.
    damping_work_Nmm
        Taken by viscosity and drag.
    energy_error
        Work that became none of these energies, over the largest so far of work, energy, and force
        times travel.
    """

    time_s: float
    travel_mm: float
    time_step_s: float
    observables: Observables
    kinetic_energy_Nmm: float
    indenter_work_Nmm: float
    support_integral_Nmm: float
    damping_work_Nmm: float
    energy_error: float


@dataclass(frozen=True)
class ExplicitStatistics:
    """Cost of a run, and what was moved.

    Attributes
    ----------
    dofs, cells
        Size of the model.
    steps, evaluations
        Time steps; evaluations of the residual, those for the stable step included.
    least_time_step_s, greatest_time_step_s
        Of all steps but the last.
    speed_mm_per_s
        Of the indenter after the start.
    mass_g, added_mass_g
        Moved mass of the whole stalk; what mass scaling has added to it.
    wall_s, ranks
        Time from specification to result; MPI ranks.
    """

    dofs: int
    cells: int
    steps: int
    evaluations: int
    least_time_step_s: float
    greatest_time_step_s: float
    speed_mm_per_s: float
    mass_g: float
    added_mass_g: float
    wall_s: float
    ranks: int


@dataclass(frozen=True)
class ExplicitResult:
    """A test simulated with inertia.

    Attributes
    ----------
    test
        The specification.
    curve
        One row per point: ``time_s``, ``displacement_mm``, what `Observables` has but the search
        for lost ellipticity, and the energies and works of `Point`. ``force_N`` and
        ``support_force_N`` are means between the neighbouring points, which leave out vibrations:
        derivatives of the work by the travel.
    statistics
        Cost.
    ending
        Whether the whole travel was reached, else why not: as in `BendingResult`, or
        ``energy`` if it was not conserved.
    """

    test: BendingTest
    curve: pd.DataFrame
    statistics: ExplicitStatistics
    ending: Ending

    @property
    def completed(self) -> bool:
        """Whether the whole travel was reached."""
        return self.ending.kind == "completed"

    @property
    def max_force_N(self) -> float:
        """Largest force on the curve."""
        return float(self.curve["force_N"].max())

    @property
    def displacement_at_max_mm(self) -> float:
        """Travel at the largest force."""
        return float(self.curve["displacement_mm"].iloc[int(self.curve["force_N"].argmax())])

    @property
    def energy_error(self) -> float:
        """Largest share of the energy that appeared or vanished after the start; NaN if none."""
        return float(self._judged["energy_error"].abs().max(skipna=False))

    @property
    def _judged(self) -> pd.DataFrame:
        """The curve after the start; empty if the run ended before."""
        return self.curve[self.curve["displacement_mm"] > START * self.test.protocol.travel_mm]

    @property
    def kinetic_share(self) -> float:
        """Largest ratio of kinetic to stored energy after the start; NaN if it ended before."""
        after = self._judged
        return float((after["kinetic_energy_Nmm"] / after["stored_energy_Nmm"]).max())

    @property
    def damping_share(self) -> float:
        """Largest ratio of what damping has taken to stored energy after the start; or NaN."""
        after = self._judged
        return float((after["damping_work_Nmm"] / after["stored_energy_Nmm"]).max())

    @property
    def quasi_static(self) -> bool:
        """Whether inertia was small enough, by the kinetic energy and what damping has taken."""
        return max(self.kinetic_share, self.damping_share) <= QUASI_STATIC

    def differences(self, implicit: pd.DataFrame) -> tuple[float, float]:
        """Compare with a quasi-static curve of the same model, as far as both go.

        Returns
        -------
        tuple
            Relative difference of the largest forces; largest difference of the forces at the
            same travel over the quasi-static one's largest.
        """
        end = float(implicit["displacement_mm"].iloc[-1])
        curve = self.curve[self.curve["displacement_mm"] <= end * (1.0 + 1e-9)]
        travel = np.minimum(curve["displacement_mm"], end)
        static = PchipInterpolator(implicit["displacement_mm"], implicit["force_N"])(travel)
        largest = float(static.max())
        deviation = float(np.abs(curve["force_N"] - static).max())
        return float(curve["force_N"].max()) / largest - 1.0, deviation / largest


def tabulate(test: BendingTest, points: list[Point]) -> pd.DataFrame:
    """Tabulate points; forces become means, the derivatives of their integrals."""
    curve = pd.DataFrame([dataclasses.asdict(point.observables) for point in points])
    curve = curve.drop(columns=["min_acoustic_MPa"])
    names = [field.name for field in dataclasses.fields(Point) if field.name != "observables"]
    table = pd.DataFrame([{name: getattr(point, name) for name in names} for point in points])
    travel = table.pop("travel_mm")
    support = table.pop("support_integral_Nmm")
    curve["force_N"] = _mean(table["indenter_work_Nmm"], travel)
    curve["support_force_N"] = _mean(support, travel)
    curve.insert(0, "displacement_mm", travel)
    recorded = test.machine.displacement(travel, curve["force_N"])
    curve.insert(1, "recorded_displacement_mm", recorded)
    curve[list(table.columns)] = table
    return curve


def _mean(integral: pd.Series, travel: pd.Series) -> NDArray[np.float64]:
    """Return the derivative at every point: second order, zero at rest."""
    if len(travel) < 3:
        return np.zeros(len(travel))
    mean = np.gradient(integral, travel, edge_order=2)
    mean[0] = 0.0
    return np.asarray(mean)

"""Result of a simulation with inertia."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.interpolate import PchipInterpolator

from ramiefenics.model.observables import Observables
from ramiefenics.results.result import Picture, Result, Table
from ramiefenics.solve.quasistatic import Ending
from ramiefenics.solve.result import BendingResult
from ramiefenics.specification import BendingTest
from ramiefenics.specification.files import to_dict

START = 0.1
"""Share of the travel after which energies are judged; hardly any energy is stored before."""

QUASI_STATIC = 0.05
"""Ratio of kinetic to stored energy up to which a test is commonly taken to be quasi-static."""


@dataclass(frozen=True)
class Point:
    """State at a point of the curve; energies and works are those of the whole stalk, N mm.

    Attributes
    ----------
    time_s
        Time since the first touch.
    travel_mm
        Travel of the indenter.
    time_step_s
        Length of the time steps that led there.
    observables
        Observables; forces are instantaneous.
    kinetic_energy_Nmm
        Kinetic energy of the stalk.
    indenter_work_Nmm
        Integral over the travel of the force of the indenter.
    support_integral_Nmm
        Integral over the travel of the force of the supports.
    damping_work_Nmm
        Energy dissipated by viscosity and drag.
    energy_error
        Work of the indenter that the energies do not account for, relative to the largest so
        far of work, energy, and force times travel.
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
    """Cost of a run, and the mass that was moved.

    Attributes
    ----------
    dofs
        Number of degrees of freedom.
    cells
        Number of cells.
    steps
        Number of time steps.
    evaluations
        Number of evaluations of the residual, those for the stable step included.
    least_time_step_s
        Shortest time step, apart from the last one.
    greatest_time_step_s
        Longest time step, apart from the last one.
    speed_mm_per_s
        Speed of the indenter after the start.
    mass_g
        Moved mass of the whole stalk.
    added_mass_g
        The part of that mass that mass scaling has added.
    wall_s
        Wall time from specification to result.
    ranks
        Number of MPI ranks.
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


@dataclass(frozen=True, repr=False)
class ExplicitResult(Result):
    """Result of a test simulated with inertia.

    Attributes
    ----------
    test
        The specification.
    curve
        One row per point: ``displacement_mm``, ``recorded_displacement_mm`` and
        ``recorded_force_N`` of the machine, the fields of `Observables` except
        ``min_acoustic_MPa``, and those of `Point` except ``support_integral_Nmm``. ``force_N`` and
        ``support_force_N`` are means between the neighbouring points, which leave out vibrations:
        derivatives of their integrals with respect to the travel.
    statistics
        Cost of the run.
    ending
        Whether the whole travel was reached, and if not, why: as in `BendingResult`, or ``energy``
        if energy was not conserved.
    implicit
        Quasi-static result of the same test on the same mesh for comparison, if there is one.
    """

    title: ClassVar[str] = "Bending test with inertia"

    test: BendingTest
    curve: pd.DataFrame
    statistics: ExplicitStatistics
    ending: Ending
    implicit: BendingResult | None = None

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
        """Largest energy error after the start, see `Point`; NaN if the run ended before."""
        return float(self._judged["energy_error"].abs().max(skipna=False))

    @property
    def _judged(self) -> pd.DataFrame:
        """Part of the curve after the start; empty if the run ended before."""
        return self.curve[self.curve["displacement_mm"] > START * self.test.protocol.travel_mm]

    @property
    def kinetic_share(self) -> float:
        """Largest ratio of kinetic to stored energy after the start.

        It is NaN if the run ended before.
        """
        after = self._judged
        return float((after["kinetic_energy_Nmm"] / after["stored_energy_Nmm"]).max())

    @property
    def damping_share(self) -> float:
        """Largest ratio of damping work to stored energy after the start.

        It is NaN if the run ended before.
        """
        after = self._judged
        return float((after["damping_work_Nmm"] / after["stored_energy_Nmm"]).max())

    @property
    def quasi_static(self) -> bool:
        """Whether inertia was small enough, judged by the kinetic energy and the damping work."""
        return max(self.kinetic_share, self.damping_share) <= QUASI_STATIC

    def differences(self, implicit: pd.DataFrame) -> tuple[float, float]:
        """Compare with a quasi-static curve of the same model, over their common travel.

        Returns
        -------
        tuple
            Relative difference of the largest forces; largest difference of the forces at the same
            travel, relative to the largest quasi-static force.
        """
        end = float(implicit["displacement_mm"].iloc[-1])
        curve = self.curve[self.curve["displacement_mm"] <= end * (1.0 + 1e-9)]
        travel = np.minimum(curve["displacement_mm"], end)
        static = PchipInterpolator(implicit["displacement_mm"], implicit["force_N"])(travel)
        largest = float(static.max())
        deviation = float(np.abs(curve["force_N"] - static).max())
        return float(curve["force_N"].max()) / largest - 1.0, deviation / largest

    def findings(self) -> list[str]:
        """Return the largest force, that of the quasi-static run, energies and cost."""
        told = [
            f"The largest force is {self.max_force_N:.2f} N at "
            f"{self.displacement_at_max_mm:.2f} mm."
        ]
        if self.implicit is not None:
            peak, anywhere = (100 * share for share in self.differences(self.implicit.curve))
            told.append(
                f"In the quasi-static run it is {self.implicit.max_force_N:.2f} N; the largest "
                f"forces differ by {peak:+.2f} %, and the curves by at most {anywhere:.2f} % of "
                "that force."
            )
        if self.completed:
            told.append(
                f"Energy is conserved within {100 * self.energy_error:.2g} %; the kinetic energy "
                f"is at most {100 * self.kinetic_share:.2g} % of the stored energy."
            )
        cost = self.statistics
        return [
            *told,
            f"Mass {cost.mass_g:.4g} g, {cost.added_mass_g:.4g} g of it by mass scaling; speed of "
            f"the indenter {cost.speed_mm_per_s:.4g} mm/s.",
            f"{cost.dofs} unknowns, {cost.steps} steps of at least "
            f"{1e6 * cost.least_time_step_s:.3g} us, {cost.wall_s:.1f} s.",
        ]

    def notes(self) -> list[str]:
        """Return why the run ended, or that inertia was large."""
        if not self.completed:
            return [f"not completed: {self.ending.reason}"]
        share = f"kinetic energy or damping above {100 * QUASI_STATIC:g} % of the stored energy"
        return [] if self.quasi_static else [f"not quasi-static: {share}"]

    def numbers(self) -> dict[str, Any]:
        """Return forces, energies and cost."""
        early = math.isnan(self.kinetic_share)  # the run ended before energies are judged
        return {
            "max_force_N": self.max_force_N,
            "displacement_at_max_mm": self.displacement_at_max_mm,
            **self._beside_implicit(),
            "ending": dataclasses.asdict(self.ending),
            "reached_mm": float(self.curve["displacement_mm"].iloc[-1]),
            "kinetic_over_stored_energy": self.kinetic_share,
            "quasi_static": self.quasi_static,
            "energy_error": None if early else self.energy_error,
            "mass_factor": self.test.numerics.explicit.mass_factor,
            **dataclasses.asdict(self.statistics),
            "mesh": self.test.numerics.mesh.name,
            "specification": to_dict(self.test),
        }

    def _beside_implicit(self) -> dict[str, float]:
        if self.implicit is None:
            return {}
        peak, anywhere = self.differences(self.implicit.curve)
        return {
            "implicit_max_force_N": self.implicit.max_force_N,
            "max_force_over_implicit": peak,
            "largest_difference_over_implicit_max": anywhere,
        }

    def tables(self) -> dict[str, Table]:
        """Return the curve and, if there is one, the quasi-static curve."""
        curves = {"curve": Table(self.curve, "One row per point.")}
        if self.implicit is not None:
            curves["implicit"] = Table(self.implicit.curve, "The quasi-static curve.")
        return curves

    def figures(self) -> dict[str, Picture]:
        """Return the figure of force and energies."""
        from ramiefenics.solve.explicit_figures import explicit_figure

        caption = "Force, with the quasi-static force for comparison if available, and energies."
        return {"explicit": Picture(lambda: explicit_figure(self), caption)}

    def specifications(self) -> dict[str, BendingTest]:
        """Return the simulated specification."""
        return {"specification": self.test}


def tabulate(test: BendingTest, points: list[Point]) -> pd.DataFrame:
    """Tabulate points; forces are replaced by means, the derivatives of their integrals."""
    curve = pd.DataFrame([dataclasses.asdict(point.observables) for point in points])
    curve = curve.drop(columns=["min_acoustic_MPa"])
    names = [field.name for field in dataclasses.fields(Point) if field.name != "observables"]
    table = pd.DataFrame([{name: getattr(point, name) for name in names} for point in points])
    travel = table.pop("travel_mm")
    support = table.pop("support_integral_Nmm")
    curve["force_N"] = _mean(table["indenter_work_Nmm"], travel)
    curve["support_force_N"] = _mean(support, travel)
    curve.insert(0, "displacement_mm", travel)
    displacement, force = test.machine.recorded(travel, curve["force_N"])
    curve.insert(1, "recorded_displacement_mm", displacement)
    curve.insert(2, "recorded_force_N", force)
    curve[list(table.columns)] = table
    return curve


def _mean(integral: pd.Series, travel: pd.Series) -> NDArray[np.float64]:
    """Return the derivative with respect to the travel: of second order, and zero at rest."""
    if len(travel) < 3:
        return np.zeros(len(travel))
    mean = np.gradient(integral, travel, edge_order=2)
    mean[0] = 0.0
    return np.asarray(mean)

"""Result of a quasi-static simulation."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
import pandas as pd

from ramiefenics.model.laws import law_named
from ramiefenics.model.snapshot import Snapshot
from ramiefenics.results.result import Picture, Result, Table
from ramiefenics.solve.measured_curves import Measured, measured_curves
from ramiefenics.solve.peak import Peak, find_peak, secant_slope
from ramiefenics.solve.quasistatic import Ending, Jump
from ramiefenics.specification import BendingTest
from ramiefenics.specification.files import to_dict

if TYPE_CHECKING:
    import pyvista as pv
    from matplotlib.figure import Figure

LOSSES = {
    "volume": "the material turns inside out",
    "stretch": "compression exceeds the law's limit, beyond which the stress falls",
    "ellipticity": "the material loses strong ellipticity, and the result depends on the mesh",
}
"""Properties that a material may lose, and what the loss means."""

UNBALANCED = 0.05
"""Share of the indenter's work that may remain unaccounted for without a note. The trapezoidal rule
over default steps loses less than a hundredth."""

RECOVERED = 0.001
"""Share of the energy dissipated by the material by which it may fall again without a note."""


@dataclass(frozen=True)
class Statistics:
    """Cost of a run.

    Attributes
    ----------
    dofs
        Number of degrees of freedom.
    cells
        Number of cells.
    steps
        Number of steps.
    newton_iterations
        Number of Newton iterations, those of failed attempts included.
    linear_iterations
        Number of iterations of the linear solver, those of failed attempts included.
    cut_backs
        Number of attempts that failed and were repeated with a shorter increment.
    wall_s
        Wall time from specification to result.
    ranks
        Number of MPI ranks.
    repeated
        Number of nonlinear solves taken from an earlier run of the same test. The other numbers,
        except the time, count them as if they had been done now.
    """

    dofs: int
    cells: int
    steps: int
    newton_iterations: int
    linear_iterations: int
    cut_backs: int
    wall_s: float
    ranks: int
    repeated: int = 0


@dataclass(frozen=True, repr=False)
class BendingResult(Result):
    """Result of a simulated test; on ranks other than the first, without snapshots.

    Attributes
    ----------
    test
        The specification.
    curve
        One row per converged step, from zero travel on: ``displacement_mm`` of the indenter,
        ``recorded_displacement_mm`` and ``recorded_force_N`` of the machine, ``time_s``, the
        fields of `Observables`, ``newton_iterations`` and ``indenter_work_Nmm``.
    snapshots
        Full fields at the travels at which the protocol saves them.
    statistics
        Cost of the run.
    ending
        Whether the whole path was followed, and if not, why.
    jumps
        Jumps on the way, each from one equilibrium to another.
    further
        Results of later tests of the same stalk. They are fewer than in `test` if one of the tests
        was not completed.
    pictures
        Figures of the snapshots, by name, as stored in the folder that the result was read from.
    """

    title: ClassVar[str] = "Bending test"

    test: BendingTest
    curve: pd.DataFrame
    snapshots: tuple[Snapshot, ...]
    statistics: Statistics
    ending: Ending
    jumps: tuple[Jump, ...] = ()
    further: tuple[BendingResult, ...] = ()
    pictures: Mapping[str, Picture] | None = None

    @property
    def completed(self) -> bool:
        """Whether the whole path of this test, and of all further tests, was followed."""
        done = len(self.further) == len(self.test.further)
        return self.ending.kind == "completed" and done and all(r.completed for r in self.further)

    @property
    def later(self) -> dict[int, BendingResult]:
        """Further tests by number; the second test of the stalk is number 2."""
        return dict(enumerate(self.further, start=2))

    @property
    def loading(self) -> pd.DataFrame:
        """Part of the curve where the indenter is farther than ever before."""
        travel = self.curve["displacement_mm"]
        return self.curve[travel > travel.cummax().shift(fill_value=-1.0)]

    @property
    def losses_mm(self) -> dict[str, float]:
        """Travel at the first step at which a property is found lost; no entry if it never is.

        The keys are those of `LOSSES`. In turn they mean that J is not positive, that a principal
        stretch is not above `Law.least_stretch`, and that the acoustic tensor has an eigenvalue
        that is not positive. The last is only checked at saved steps.
        """
        curve = self.curve
        lost = {
            "volume": curve["min_volume_ratio"] <= 0.0,
            "stretch": curve["min_principal_stretch"] <= law_named(self.test.law).least_stretch,
            "ellipticity": curve["min_acoustic_MPa"] <= 0.0,
        }
        return {
            name: float(curve["displacement_mm"][where].iloc[0])
            for name, where in lost.items()
            if where.any()
        }

    @property
    def peak(self) -> Peak:
        """Maximum force of the loading, with its position, plateau and step error."""
        loading = self.loading
        travel, force = (loading[name].to_numpy() for name in ("displacement_mm", "force_N"))
        return find_peak(travel, force, [jump.displacement_mm for jump in self.jumps])

    @property
    def mesh_error_N(self) -> float | None:
        """Error of the maximum due to the mesh, as measured for its recipe; None if it was not."""
        share = self.test.numerics.mesh.max_force_error
        return None if share is None else share * self.max_force_N

    @property
    def max_force_N(self) -> float:
        """Largest force; see `find_peak`."""
        return self.peak.force_N

    @property
    def displacement_at_max_mm(self) -> float:
        """Travel at the largest force."""
        return self.peak.displacement_mm

    @property
    def has_force_maximum(self) -> bool:
        """Whether the force falls again before the end of the loading."""
        return self.peak.inside

    @property
    def slope_N_per_mm(self) -> float:
        """Secant stiffness between 10 and 40 % of the largest force."""
        return secant_slope(self.loading["displacement_mm"], self.loading["force_N"])

    def findings(self) -> list[str]:
        """Return the largest force, its error, and the cost of the run."""
        peak, mesh, cost = self.peak, self.mesh_error_N, self.statistics
        first, last = peak.plateau_mm
        kept = f", with {cost.repeated} solves kept from an earlier run" if cost.repeated else ""
        return [
            f"{'Force maximum' if peak.inside else 'Force still rising at the end,'} "
            f"{peak.force_N:.2f} N at {peak.displacement_mm:.2f} mm, within 1 % of it from "
            f"{first:.2f} to {last:.2f} mm; slope {self.slope_N_per_mm:.2f} N/mm.",
            "Error of the maximum: "
            + (
                "unknown for the steps, as they are too few; "
                if math.isnan(peak.step_error_N)
                else f"{peak.step_error_N:.2g} N from the steps; "
            )
            + (
                "unknown for the mesh, as the error of its recipe was not measured "
                "(see ramiefenics converge)."
                if mesh is None
                else f"about {mesh:.2g} N from the mesh, by the largest error measured for its "
                "recipe."
            ),
            f"{cost.dofs} unknowns, {cost.steps} steps, {cost.newton_iterations} iterations, "
            f"{cost.cut_backs} cut-backs, {cost.wall_s:.1f} s{kept}.",
            *(f"Test {number}: {one.findings()[0]}" for number, one in self.later.items()),
        ]

    def notes(self) -> list[str]:
        """Return losses of the material, a closed void, jumps, imbalance, and why it ended."""
        lost = [
            f"at {at:.2f} mm of travel or earlier, {LOSSES[n]}" for n, at in self.losses_mm.items()
        ]
        jumps = [
            f"the stalk jumps at {jump.displacement_mm:.2f} mm of travel and releases "
            f"{jump.energy_released_Nmm:.3g} N mm"
            for jump in self.jumps
        ]
        closed = self.curve.loc[self.curve["void_force_N"] > 0.0, "displacement_mm"]
        meeting = [
            f"the void has closed at {at:.2f} mm of travel; beyond that its walls press against "
            "each other without friction"
            for at in closed.head(1)
        ]
        complete = self.ending.kind == "completed"
        ended = [] if complete else [f"not completed: {self.ending.reason}"]
        later = [f"test {k}: {note}" for k, one in self.later.items() for note in one.notes()]
        energies = [*self._unbalanced(), *self._recovered()]
        return [*lost, *self._unsearched(), *meeting, *jumps, *energies, *ended, *later]

    def _unbalanced(self) -> list[str]:
        """Return by how much the energies differ from the indenter's work, if by much."""
        share = self._energy_imbalance()
        if share is None or abs(share) <= UNBALANCED:
            return []
        return [
            f"the indenter's work differs by {100.0 * abs(share):.0f} % from the sum of the energy "
            "stored, dissipated by friction and by the material, and released by jumps: use "
            "shorter steps (numerics.stepping.max_step_mm)"
        ]

    def _recovered(self) -> list[str]:
        """Return where the energy dissipated by the material falls, which no material does."""
        spent = self.curve["dissipated_Nmm"].to_numpy()
        fallen = np.maximum.accumulate(spent) - spent
        if fallen.max() <= RECOVERED * spent.max():
            return []
        at = self.curve["displacement_mm"].iloc[int(fallen.argmax())]
        return [
            f"the energy dissipated by the material falls by {fallen.max():.3g} N mm until "
            f"{at:.2f} mm of travel: the law is used where it is not valid"
        ]

    def _energy_imbalance(self) -> float | None:
        """Return the part of the indenter's work not accounted for, relative to its maximum."""
        work = self.curve["indenter_work_Nmm"]
        if not work.max() > 0.0:
            return None
        kinds = ["stored_energy_Nmm", "friction_work_Nmm", "dissipated_Nmm"]
        released = sum(jump.energy_released_Nmm for jump in self.jumps)
        energies = self.curve[kinds].sum(axis=1)  # there may be some from an earlier test
        spent = float(energies.iloc[-1] - energies.iloc[0]) + released
        return (float(work.iloc[-1]) - spent) / float(work.max())

    def _unsearched(self) -> list[str]:
        """Return how far strong ellipticity was checked, if the run ended early beyond that."""
        if not self.test.numerics.acoustic_check or len(self.curve) == 1:
            return []
        sought = self.curve["min_acoustic_MPa"].notna()
        if sought.iloc[-1]:
            return []
        last = self.curve["displacement_mm"][sought].iloc[-1] if sought.any() else 0.0
        return [f"strong ellipticity was not checked beyond {last:.2f} mm of travel"]

    def numbers(self) -> dict[str, Any]:
        """Return force, energies, losses and cost."""
        curve, acoustic = self.curve, self.test.numerics.acoustic_check
        imbalance = float((curve["force_N"] - curve["support_force_N"]).abs().max())
        return {
            "max_force_N": self.max_force_N,
            "displacement_at_max_mm": self.displacement_at_max_mm,
            "has_force_maximum": self.has_force_maximum,
            "plateau_mm": self.peak.plateau_mm,
            "step_error_N": self.peak.step_error_N,
            "mesh_error_N": self.mesh_error_N,
            "slope_N_per_mm": self.slope_N_per_mm,
            "ending": dataclasses.asdict(self.ending),
            "reached_mm": float(curve["displacement_mm"].max()),
            "force_imbalance": imbalance / self.max_force_N if self.max_force_N > 0 else None,
            "energy_imbalance": self._energy_imbalance(),
            "min_volume_ratio": float(curve["min_volume_ratio"].min()),
            "min_principal_stretch": float(curve["min_principal_stretch"].min()),
            "min_acoustic_MPa": float(curve["min_acoustic_MPa"].min()) if acoustic else None,
            "lost_at_mm": {name: self.losses_mm.get(name) for name in LOSSES},
            "jumps": [dataclasses.asdict(jump) for jump in self.jumps],
            **dataclasses.asdict(self.statistics),
            "mesh": self.test.numerics.mesh.name,
            "specification": to_dict(self.test),
            "further": [one.numbers() for one in self.further],
        }

    def tables(self) -> dict[str, Table]:
        """Return the curves of all tests."""
        later = {
            f"curve_{number}": Table(one.curve, f"One row per step of test {number}.")
            for number, one in self.later.items()
        }
        return {"curve": Table(self.curve, "One row per step."), **later}

    def figures(self) -> dict[str, Picture]:
        """Return the force curves, and the last section and stalk if there are snapshots.

        Of a result that was read from its folder, section and stalk are the stored pictures.
        """
        from ramiefenics.solve.figures import curve_figure, curves_figure, section_figure
        from ramiefenics.solve.pictures import deformed_figure

        drawn = {"curve": Picture(lambda: curve_figure(self), "Indenter force against travel.")}
        if self.snapshots:
            last = self.snapshots[-1]
            force = np.interp(last.time_s, self.curve["time_s"], self.curve["force_N"])
            load = f"at {last.travel_mm:.1f} mm of travel and {force:.1f} N"
            drawn["section"] = Picture(
                lambda: section_figure(self),
                f"Section under the indenter {load}, drawn over the undeformed section. Thick "
                "lines are the boundaries of layers, thin lines those of elements.",
            )
            drawn["deformed"] = Picture(
                lambda: deformed_figure(self), f"The stalk between its cylinders {load}."
            )
        else:
            drawn |= self.pictures or {}
        if self.further:
            drawn["curves"] = Picture(
                lambda: curves_figure(self), "Force against travel in all tests of the stalk."
            )
        return drawn

    def plot(self, name: str | None = None, measured: Measured | None = None) -> Figure:
        """Draw a figure, or the force curve with measured curves.

        Parameters
        ----------
        name
            Name of the figure, as in `figures`; by default the force curve. It is not used if
            `measured` is given.
        measured
            Table with ``displacement_mm`` and ``force_N``, its CSV file, a `RawCurve`, several of
            these by name, or a `Dataset`.

        Raises
        ------
        SpecificationError
            If there is no figure of that name, or if `measured` is none of these.
        """
        if measured is None:
            return super().plot(name)
        from ramiefenics.solve.figures import curve_figure

        return curve_figure(self, measured_curves(measured))

    def view(self, number: int = -1) -> pv.Plotter:
        """Return the stalk in a saved state as an interactive scene; see `ramiefenics.view`."""
        from ramiefenics.solve.pictures import view

        return view(self, number)

    def animate(self, path: str | Path, seconds: float = 5.0) -> Path:
        """Write an animation of the test; see `ramiefenics.animate`."""
        from ramiefenics.solve.animation import animate

        return animate(self, path, seconds)

    def specifications(self) -> dict[str, BendingTest]:
        """Return the simulated specification."""
        return {"specification": self.test}

    def write_more(self, folder: Path) -> None:
        """Write the fields of the snapshots for ParaView."""
        if self.snapshots:
            from ramiefenics.solve.fields import write_fields

            write_fields(self, folder / "fields")
        for number, one in self.later.items():
            one.write_more(folder / f"test_{number}")

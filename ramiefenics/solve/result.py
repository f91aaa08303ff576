"""What a simulation gives back."""

from __future__ import annotations

from dataclasses import dataclass

import pandas as pd

from ramiefenics.model.laws import law_named
from ramiefenics.model.snapshot import Snapshot
from ramiefenics.solve.peak import Peak, find_peak
from ramiefenics.solve.quasistatic import Ending, Jump
from ramiefenics.specification import BendingTest

LOSSES = {
    "volume": "the material turns inside out",
    "stretch": "compression passes the law's limit, its stress falls",
    "ellipticity": "the material loses strong ellipticity, the answer depends on the mesh",
}
"""Properties that a law may lose, and what that means."""


@dataclass(frozen=True)
class Statistics:
    """Cost of a run.

    Attributes
    ----------
    dofs, cells
        Size of the model.
    steps, newton_iterations, linear_iterations, cut_backs
        Work done; iterations of failed attempts included.
    wall_s
        Time from specification to result.
    ranks
        MPI ranks.
    """

    dofs: int
    cells: int
    steps: int
    newton_iterations: int
    linear_iterations: int
    cut_backs: int
    wall_s: float
    ranks: int


@dataclass(frozen=True)
class BendingResult:
    """A simulated test; on ranks other than the first, without snapshots.

    Attributes
    ----------
    test
        The specification.
    curve
        One row per converged step, from zero travel on: ``displacement_mm`` of the indenter,
        ``recorded_displacement_mm`` by the machine, the fields of `Observables`, and
        ``indenter_work_Nmm``.
    snapshots
        Full fields at the travels that the protocol names.
    statistics
        Cost.
    ending
        Whether the whole travel was reached, else why not.
    jumps
        Dynamic transitions on the way.
    """

    test: BendingTest
    curve: pd.DataFrame
    snapshots: tuple[Snapshot, ...]
    statistics: Statistics
    ending: Ending
    jumps: tuple[Jump, ...] = ()

    @property
    def completed(self) -> bool:
        """Whether the whole travel was reached."""
        return self.ending.kind == "completed"

    @property
    def losses_mm(self) -> dict[str, float]:
        """Travel at the first step at which the material has lost a property; none if never.

        The keys are those of `LOSSES`: J is not positive, some principal stretch is below
        `Law.least_stretch`, the acoustic tensor has an eigenvalue that is not positive.
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
        """The force maximum, its place, plateau and error of step, at travels of the indenter."""
        return find_peak(self.curve["displacement_mm"].to_numpy(), self.curve["force_N"].to_numpy())

    @property
    def mesh_error_N(self) -> float | None:
        """What the mesh makes of the maximum, as its recipe did elsewhere; None if not measured."""
        share = self.test.numerics.mesh.max_force_error
        return None if share is None else share * self.max_force_N

    @property
    def max_force_N(self) -> float:
        """Largest force, see `find_peak`."""
        return self.peak.force_N

    @property
    def displacement_at_max_mm(self) -> float:
        """Travel at the largest force."""
        return self.peak.displacement_mm

    @property
    def has_force_maximum(self) -> bool:
        """Whether the force falls again before the end of the curve."""
        return self.peak.inside

    @property
    def slope_N_per_mm(self) -> float:
        """Secant stiffness between 10 and 40 % of the largest force."""
        return secant_slope(self.curve["displacement_mm"], self.curve["force_N"])


def secant_slope(displacement_mm: pd.Series[float], force_N: pd.Series[float]) -> float:
    """Return the secant stiffness between 10 and 40 % of the largest force, N/mm.

    NaN where the curve does not begin below 10 %.
    """
    peak = int(force_N.to_numpy().argmax())
    force, travel = force_N.iloc[: peak + 1].tolist(), displacement_mm.iloc[: peak + 1].tolist()
    low, high = 0.1 * force[-1], 0.4 * force[-1]
    ends = [_crossing(force, travel, level) for level in (low, high)]
    return (high - low) / (ends[1] - ends[0]) if ends[1] > ends[0] else float("nan")


def _crossing(force: list[float], travel: list[float], level: float) -> float:
    """Travel at which the force first reaches a level, linearly interpolated; NaN if before."""
    if force[0] >= level:
        return float("nan")
    for i in range(1, len(force)):
        if force[i] >= level:
            share = (level - force[i - 1]) / (force[i] - force[i - 1])
            return travel[i - 1] + share * (travel[i] - travel[i - 1])
    return float("nan")

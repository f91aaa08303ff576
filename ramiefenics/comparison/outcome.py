"""How far measured curves are from simulated ones."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, partial
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ramiefenics.measured import Dataset
from ramiefenics.measured.record import Record
from ramiefenics.measured.seating import toe_mm
from ramiefenics.results.result import Picture, Result, Table
from ramiefenics.results.text import stack
from ramiefenics.solve.result import BendingResult
from ramiefenics.specification import BendingTest, SpecificationError

POINTS = 201
"""Displacements at which curves are compared."""

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Pair:
    """A measured curve, and a simulated one.

    Attributes
    ----------
    record
        As measured.
    name
        Of the simulation.
    result
        The simulation.
    """

    record: Record
    name: str
    result: BendingResult

    @property
    def recorded(self) -> pd.DataFrame:
        """The simulation as its machine records it: ``displacement_mm``, ``force_N``.

        Where the measured displacement begins behind a toe, it does, too.
        """
        loading = self.result.loading[["recorded_displacement_mm", "recorded_force_N"]]
        travel, force = loading.to_numpy().T
        toe = toe_mm(lambda at: np.interp(at, travel, force), self.record.straight_mm)
        return pd.DataFrame({"displacement_mm": travel - toe, "force_N": force})

    @cached_property
    def at_mm(self) -> Array:
        """Displacements that both reach, shape (POINTS,).

        Raises
        ------
        SpecificationError
            If there are none.
        """
        low, high = self.record.range_mm
        for curve in (self.recorded, self.record.curve):
            low = max(low, float(curve["displacement_mm"].iloc[0]))
            high = min(high, float(curve["displacement_mm"].iloc[-1]))
        if not low < high:
            allowed = f"must reach displacements that {self.record.name} has, above {low:.4g} mm"
            raise SpecificationError(self.name, high, allowed)
        return np.asarray(np.linspace(low, high, POINTS))

    @property
    def measured_N(self) -> Array:
        """Measured force there."""
        curve = self.record.curve
        return np.asarray(np.interp(self.at_mm, curve["displacement_mm"], curve["force_N"]))

    @property
    def residual_N(self) -> Array:
        """Simulated force less the measured one there."""
        curve = self.recorded
        simulated = np.interp(self.at_mm, curve["displacement_mm"], curve["force_N"])
        return np.asarray(simulated - self.measured_N)

    def row(self) -> dict[str, Any]:
        """Return what a table has of it."""
        measured, residual = self.measured_N, self.residual_N
        peak, simulated = float(measured.max()), float((measured + residual).max())
        rms = float(np.sqrt(np.mean(residual**2)))
        return {
            "measured": self.record.name,
            "simulated": self.name,
            "from_mm": float(self.at_mm[0]),
            "to_mm": float(self.at_mm[-1]),
            "rms_N": rms,
            "rms_percent": 100.0 * rms / peak,
            "mean_percent": 100.0 * float(residual.mean()) / peak,
            "measured_max_N": peak,
            "simulated_max_N": simulated,
            "max_error_percent": 100.0 * (simulated / peak - 1.0),
        }


@dataclass(frozen=True, repr=False)
class Comparison(Result):
    """Measured curves beside simulated ones.

    Attributes
    ----------
    dataset
        What was measured.
    pairs
        What is compared with what.
    """

    dataset: Dataset
    pairs: tuple[Pair, ...]

    @property
    def title(self) -> str:
        """What this is."""
        return f"{self.dataset.title}: measured and simulated"

    @cached_property
    def table(self) -> pd.DataFrame:
        """One row per pair.

        ``measured`` and ``simulated``, by name; ``from_mm`` and ``to_mm``, between which both
        curves are; ``rms_N`` and, over the measured maximum there, ``rms_percent`` and
        ``mean_percent`` of simulated less measured force; ``measured_max_N``, ``simulated_max_N``
        and ``max_error_percent`` of the maxima.
        """
        return pd.DataFrame([pair.row() for pair in self.pairs])

    def findings(self) -> list[str]:
        """Return how far each simulation is from what was measured."""
        return [
            f"{name}: {np.sqrt((rows['rms_percent'] ** 2).mean()):.3g} % of the maximum as root "
            f"mean square, {rows['mean_percent'].mean():+.3g} % in the mean; maxima "
            f"{rows['max_error_percent'].mean():+.3g} % ({rows['max_error_percent'].min():+.3g} to "
            f"{rows['max_error_percent'].max():+.3g} %) of {len(rows)} measured ones."
            for name, rows in self.table.groupby("simulated", sort=False)
        ]

    def notes(self) -> list[str]:
        """Return which simulations ended early, and what of the records is not compared."""
        ended = {
            f"{pair.name} of {pair.record.name}: {pair.result.ending.reason}": None
            for pair in self.pairs
            if not pair.result.completed
        }
        return [*ended, *self.dataset.notes()]

    def overview(self) -> pd.DataFrame:
        """Return the table."""
        return self.table.drop(columns=["from_mm", "rms_N"])

    def numbers(self) -> dict[str, Any]:
        """Return the table."""
        return {"pairs": self.table.to_dict("records")}

    def tables(self) -> dict[str, Table]:
        """Return the table, and all curves at the same displacements."""
        curves = {
            f"{pair.record.name}, {pair.name}": pd.DataFrame(
                {
                    "displacement_mm": pair.at_mm,
                    "measured_N": pair.measured_N,
                    "simulated_N": pair.measured_N + pair.residual_N,
                }
            )
            for pair in self.pairs
        }
        return {
            "comparison": Table(self.table, "Simulated less measured force."),
            "curves": Table(stack(curves, "pair")),
        }

    def figures(self) -> dict[str, Picture]:
        """Return curves and residuals."""
        from ramiefenics.comparison.figures import comparison_figure

        return {
            "comparison": Picture(
                partial(comparison_figure, self), "Measured and simulated curves, and what is left."
            )
        }

    def specifications(self) -> dict[str, BendingTest]:
        """Return the data set's baseline."""
        return {"baseline": self.dataset.baseline}

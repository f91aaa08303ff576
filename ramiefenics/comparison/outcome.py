"""Result of a comparison of measured and simulated curves."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ramiefenics.comparison.dimensions import differences
from ramiefenics.measured import Dataset
from ramiefenics.measured.record import Record
from ramiefenics.measured.seating import toe_mm
from ramiefenics.results.result import Picture, Result, Table
from ramiefenics.results.text import stack
from ramiefenics.solve.result import BendingResult
from ramiefenics.specification import BendingTest, SpecificationError

POINTS = 201
"""Number of displacements at which two curves are compared."""

REACHED = 0.99
"""Share of the highest measured force above which a range contains the measured maximum."""

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Pair:
    """A measured curve and a simulated one.

    Attributes
    ----------
    record
        The measured test.
    name
        Name of the simulation.
    result
        Result of the simulation.
    """

    record: Record
    name: str
    result: BendingResult

    @property
    def recorded(self) -> pd.DataFrame:
        """The simulated curve as its machine records it: ``displacement_mm``, ``force_N``.

        If the measured curve has been corrected for its toe, so is the simulated one.
        """
        loading = self.result.loading[["recorded_displacement_mm", "recorded_force_N"]]
        travel, force = loading.to_numpy().T
        toe = toe_mm(lambda at: np.interp(at, travel, force), self.record.straight_mm)
        return pd.DataFrame({"displacement_mm": travel - toe, "force_N": force})

    @cached_property
    def at_mm(self) -> Array:
        """Equally spaced displacements that both curves cover, shape (POINTS,).

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
            allowed = f"must reach displacements of {self.record.name}, above {low:.4g} mm"
            raise SpecificationError(self.name, high, allowed)
        return np.asarray(np.linspace(low, high, POINTS))

    @property
    def measured_N(self) -> Array:
        """Measured force at `at_mm`."""
        curve = self.record.curve
        return np.asarray(np.interp(self.at_mm, curve["displacement_mm"], curve["force_N"]))

    @property
    def residual_N(self) -> Array:
        """Simulated minus measured force at `at_mm`."""
        curve = self.recorded
        simulated = np.interp(self.at_mm, curve["displacement_mm"], curve["force_N"])
        return np.asarray(simulated - self.measured_N)

    def row(self) -> dict[str, Any]:
        """Return the pair's row of `Comparison.table`."""
        measured, residual = self.measured_N, self.residual_N
        peak, simulated = float(measured.max()), float((measured + residual).max())
        reached = peak >= REACHED * float(self.record.curve["force_N"].max())
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
            "max_error_percent": 100.0 * (simulated / peak - 1.0) if reached else math.nan,
        }


@dataclass(frozen=True, repr=False)
class Comparison(Result):
    """Measured curves compared with simulated ones.

    Attributes
    ----------
    dataset
        The measured data.
    pairs
        Pairs of a measured and a simulated curve.
    """

    dataset: Dataset
    pairs: tuple[Pair, ...]

    @property
    def title(self) -> str:
        """Title of the comparison."""
        return f"{self.dataset.title}: measured and simulated"

    @cached_property
    def table(self) -> pd.DataFrame:
        """One row per pair.

        ``measured`` and ``simulated``, the names; ``from_mm`` and ``to_mm``, the range that both
        curves cover; ``rms_N``, the root mean square of simulated minus measured force;
        ``rms_percent`` and ``mean_percent``, its root mean square and mean relative to the measured
        maximum in this range; the maxima in this range, ``measured_max_N`` and
        ``simulated_max_N``; and the relative error of the maximum, ``max_error_percent``, which is
        NaN where the range ends before the measured maximum.
        """
        return pd.DataFrame([pair.row() for pair in self.pairs])

    def findings(self) -> list[str]:
        """Return how far each simulation is from the measured curves."""
        return [
            f"{name}: over {len(rows)} measured curves, root mean square difference "
            f"{np.sqrt((rows['rms_percent'] ** 2).mean()):.3g} % of the maximum, mean difference "
            f"{rows['mean_percent'].mean():+.3g} %; "
            f"{_error_of_the_maximum(rows['max_error_percent'])}."
            for name, rows in self.table.groupby("simulated", sort=False)
        ]

    def notes(self) -> list[str]:
        """Return differences from the measured tests, early ends, and what is not compared."""
        ended = {
            f"{pair.name} of {pair.record.name}: {pair.result.ending.reason}": None
            for pair in self.pairs
            if not pair.result.completed
        }
        return [*self._other_tests(), *ended, *self.dataset.notes()]

    def _other_tests(self) -> Iterator[str]:
        """Yield how each simulation differs from the tests that it is compared with."""
        simulated: dict[tuple[str, int], list[Pair]] = {}
        for pair in self.pairs:
            simulated.setdefault((pair.name, id(pair.result)), []).append(pair)
        for (name, _), pairs in simulated.items():
            found = differences(pairs[0].result.test, [pair.record.test for pair in pairs])
            if found:
                yield f"{name} is not the test that was measured: {'; '.join(found)}"

    def overview(self) -> pd.DataFrame:
        """Return the main columns of the table."""
        return self.table.drop(columns=["from_mm", "rms_N"])

    def numbers(self) -> dict[str, Any]:
        """Return the rows of the table."""
        return {"pairs": self.table.to_dict("records")}

    def tables(self) -> dict[str, Table]:
        """Return the table, and both curves of each pair at common displacements."""
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
        """Return the figure of curves and residuals."""
        from ramiefenics.comparison.figures import comparison_figure

        return {
            "comparison": Picture(
                partial(comparison_figure, self),
                "Measured and simulated curves, and their differences.",
            )
        }

    def specifications(self) -> dict[str, BendingTest]:
        """Return the data set's baseline."""
        return {"baseline": self.dataset.baseline}


def _error_of_the_maximum(percent: pd.Series) -> str:
    """Return the mean and the range of the known errors of the maximum, as part of a sentence."""
    known = percent.dropna()
    if known.empty:
        return "error of the maximum unknown, as the measured maximum is not reached"
    missed = len(percent) - len(known)
    reached = f", without {missed} that {'is' if missed == 1 else 'are'} not reached"
    return (
        f"error of the maximum {known.mean():+.3g} % ({known.min():+.3g} to "
        f"{known.max():+.3g} %{reached if missed else ''})"
    )

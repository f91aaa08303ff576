"""Result of a sweep."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from ramiefenics.results.result import Picture, Result, Table
from ramiefenics.results.text import stack
from ramiefenics.runs import KeptRun
from ramiefenics.specification import BendingTest
from ramiefenics.specification.files import to_dict

if TYPE_CHECKING:
    import xarray as xr

NUMBERS = ("max_force_N", "displacement_at_max_mm", "slope_N_per_mm")


@dataclass(frozen=True, repr=False)
class Sweep(Result):
    """Simulations of one specification with some of its values varied.

    Attributes
    ----------
    test
        The specification before any value was changed.
    runs
        One row per run: the varied values, by key, ``max_force_N``, ``displacement_at_max_mm``,
        ``slope_N_per_mm`` (NaN if the run ended while the force still rose) and ``ending``.
    done
        The simulations, in the same order; None where one failed.
    """

    test: BendingTest
    runs: pd.DataFrame
    done: tuple[KeptRun | None, ...]

    @property
    def keys(self) -> list[str]:
        """Keys of the varied values."""
        return [str(name) for name in self.runs if name not in (*NUMBERS, "ending")]

    @property
    def title(self) -> str:
        """Title of the sweep."""
        names = [key.rpartition(".")[2] for key in self.keys]
        return f"Sweep over {' and '.join(names)}, {len(self.runs)} runs"

    @property
    def completed(self) -> bool:
        """Whether all runs reached the whole travel."""
        return bool((self.runs["ending"] == "completed").all())

    def findings(self) -> list[str]:
        """Return the range of the maximum force."""
        force = self.runs["max_force_N"].to_numpy(dtype=float)
        if not np.isfinite(force).any():
            return ["No run has a force maximum."]
        extremes = (int(np.nanargmin(force)), int(np.nanargmax(force)))
        ends = (f"{force[n]:.4g} N ({self._where(n)})" for n in extremes)
        return [f"The maximum force ranges from {' to '.join(ends)}."]

    def notes(self) -> list[str]:
        """Return which runs ended early, and in which the stalk jumps."""
        ends = self.runs["ending"]
        told = [f"{self._where(n)}: {why}" for n, why in enumerate(ends) if why != "completed"]
        jumps = [n for n, run in enumerate(self.done) if run is not None and run.result.jumps]
        return told + [f"{self._where(n)}: the stalk jumps" for n in jumps]

    def _where(self, number: int) -> str:
        row = self.runs.iloc[number]
        return ", ".join(f"{key.rpartition('.')[2]} = {row[key]}" for key in self.keys)

    def overview(self) -> pd.DataFrame:
        """Return the first 30 runs."""
        return self.runs.head(30).rename(columns=lambda name: str(name).rpartition(".")[2])

    def numbers(self) -> dict[str, Any]:
        """Return the runs and the specification."""
        rows = self.runs.to_dict("records")
        return {"runs": rows, "specification": to_dict(self.test)}

    def tables(self) -> dict[str, Table]:
        """Return the runs, and their curves by the number of the run, counted from 0."""
        curves = {
            number: run.result.curve[["displacement_mm", "force_N"]]
            for number, run in enumerate(self.done)
            if run is not None
        }
        return {
            "runs": Table(self.runs, "One row per run."),
            **({"curves": Table(stack(curves, "run"))} if curves else {}),
        }

    def to_xarray(self) -> xr.DataArray:
        """Return the force, N, as an xarray over the varied values and the displacement.

        There is one dimension for each key, and ``displacement_mm`` with the displacements of all
        runs. A run's force is interpolated linearly between its own displacements, and is NaN
        beyond its end.
        """
        import xarray as xr

        curves = [None if run is None else run.result.curve for run in self.done]
        found = [curve["displacement_mm"].round(9) for curve in curves if curve is not None]
        at = np.unique(np.concatenate(found)) if found else np.zeros(0)
        force = [
            np.full(len(at), math.nan)
            if curve is None
            else np.interp(at, curve["displacement_mm"], curve["force_N"], right=math.nan)
            for curve in curves
        ]
        values = [list(dict.fromkeys(self.runs[key])) for key in self.keys]
        return xr.DataArray(
            np.reshape(force, [*map(len, values), len(at)]),
            dict(zip([*self.keys, "displacement_mm"], [*values, at], strict=True)),
            [*self.keys, "displacement_mm"],
            "force_N",
            {"units": "N"},
        )

    def figures(self) -> dict[str, Picture]:
        """Return the figures of the curves, and of maximum force against the first varied key."""
        from ramiefenics.sweep import figures

        drawn = {
            "curves": Picture(
                partial(figures.curves_figure, self),
                "Force against travel of all runs; a cross marks a run that ended early.",
            )
        }
        if len(self.keys) <= 2 and self.runs[self.keys[0]].nunique() > 1:
            drawn["max_force"] = Picture(
                partial(figures.force_figure, self), "Maximum force of all runs."
            )
        return drawn

    def specifications(self) -> dict[str, BendingTest]:
        """Return the specification before any value was changed."""
        return {"specification": self.test}

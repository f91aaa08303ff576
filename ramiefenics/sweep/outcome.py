"""Result of a sweep."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
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
NOT_KEYS = (*NUMBERS, "still_rising", "ending")
"""Columns of the table of runs beside the keys."""

DIGITS = re.compile(r"\d[\d.,]*(e[+-]?\d+)?")
"""Numbers, in which notes on several runs may differ that say the same."""


@dataclass(frozen=True, repr=False)
class Sweep(Result):
    """Simulations of one specification with some of its values varied, or effects added.

    Attributes
    ----------
    test
        The specification before any value was changed.
    runs
        One row per run: the given values, by key, and amplitudes, by effect; ``max_force_N``,
        ``displacement_at_max_mm``, ``slope_N_per_mm`` (NaN if the run ended early while the force
        still rose), ``still_rising`` (whether the force still rises at the largest travel; None if
        the run failed) and ``ending``.
    done
        The simulations, in the same order; None where one failed.
    effects
        Units of the amplitudes, by effect.
    """

    test: BendingTest
    runs: pd.DataFrame
    done: tuple[KeptRun | None, ...]
    effects: Mapping[str, str] = field(default_factory=dict)

    @property
    def given(self) -> list[str]:
        """Keys of all given values, and names of effects."""
        return [str(name) for name in self.runs if name not in NOT_KEYS]

    @property
    def keys(self) -> list[str]:
        """Keys with more than one value; all given keys if there is none."""
        return [key for key in self.given if self.runs[key].nunique() > 1] or self.given

    @property
    def names(self) -> dict[str, str]:
        """Shortest ends of the given keys that are unique among them, by key."""
        return {key: _shortest(key, self.given) for key in self.given}

    @property
    def title(self) -> str:
        """Title of the sweep."""
        names, number = " and ".join(self.names[key] for key in self.keys), len(self.runs)
        return f"Sweep over {names}, {number} run{'' if number == 1 else 's'}"

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
        told = [f"The maximum force ranges from {' to '.join(ends)}."]
        if rising := int((self.runs["still_rising"] == True).sum()):  # noqa: E712  None if failed
            told.append(
                f"In {rising} of {len(self.runs)} runs the force still rises at the end "
                "(still_rising): their maxima are lower bounds."
            )
        return told

    def notes(self) -> list[str]:
        """Return the notes of all runs, each once, and which runs failed."""
        runs: dict[str, list[int]] = {}
        first: dict[str, str] = {}
        for number, run in enumerate(self.done):
            ending = str(self.runs["ending"][number])
            for note in [ending] if run is None else run.result.notes():
                what = DIGITS.sub("", note)
                first.setdefault(what, note)
                runs.setdefault(what, []).append(number)
        return [
            f"{self._where(numbers[0])}: {first[what]}{self._others(numbers[1:])}"
            for what, numbers in runs.items()
        ]

    def _others(self, numbers: list[int]) -> str:
        """Return in which other runs a note is alike."""
        if not numbers:
            return ""
        if len(numbers) + 1 == len(self.done):
            return " (alike in all other runs)"
        listed = ", ".join(map(str, numbers))
        return f" (alike in run{'' if len(numbers) == 1 else 's'} {listed}, counted from 0)"

    def _where(self, number: int) -> str:
        row = self.runs.iloc[number]
        return ", ".join(f"{self.names[key]} = {row[key]}" for key in self.keys)

    def overview(self) -> pd.DataFrame:
        """Return the first 30 runs."""
        return self.runs.head(30).rename(columns=self.names)

    def numbers(self) -> dict[str, Any]:
        """Return the runs, units of amplitudes, and the specification."""
        rows = self.runs.to_dict("records")
        return {"runs": rows, "effects": dict(self.effects), "specification": to_dict(self.test)}

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
        values = [list(dict.fromkeys(self.runs[key])) for key in self.given]
        return xr.DataArray(
            np.reshape(force, [*map(len, values), len(at)]),
            dict(zip([*self.given, "displacement_mm"], [*values, at], strict=True)),
            [*self.given, "displacement_mm"],
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
                partial(figures.force_figure, self),
                f"Maximum force on the indenter in all runs, against {self.keys[0]}.",
            )
        return drawn

    def specifications(self) -> dict[str, BendingTest]:
        """Return the specification before any value was changed."""
        return {"specification": self.test}


def _shortest(key: str, keys: Sequence[str]) -> str:
    """Return the shortest end of a dotted key with which no other key ends."""
    parts = key.split(".")
    ends = [".".join(parts[-number:]) for number in range(1, len(parts) + 1)]
    unique = (e for e in ends if sum(f".{other}".endswith(f".{e}") for other in keys) == 1)
    return next(unique, key)

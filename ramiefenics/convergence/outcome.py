"""Result of a mesh-convergence study."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any

import pandas as pd

from ramiefenics.convergence.richardson import Extrapolation
from ramiefenics.results.result import Picture, Result, Table
from ramiefenics.results.text import stack
from ramiefenics.runs import KeptRun
from ramiefenics.specification import BendingTest
from ramiefenics.specification.files import to_dict

BEHAVIOURS = {
    "converging": "converges",
    "oscillating": "oscillates",
    "not converging": "does not converge",
    "unchanged": "no longer changes",
    "too few": "has too few meshes",
}
"""Wording of each `Extrapolation.behaviour`."""


def label_of(quantity: str) -> str:
    """Return a quantity's name in words."""
    if quantity.startswith("force_"):
        return f"force at {quantity.removeprefix('force_').removesuffix('mm_N')} mm"
    return {"max_force_N": "maximum force", "slope_N_per_mm": "slope"}[quantity]


@dataclass(frozen=True, repr=False)
class Convergence(Result):
    """A mesh-convergence study.

    Attributes
    ----------
    test
        The specification; its own mesh was not used.
    order
        Element order of the ladder.
    runs
        Runs, one per mesh, coarsest first.
    positions_mm
        Travels at which forces are compared: 2/7 and 4/7 of the whole travel (to three digits),
        and the whole.
    meshes
        One row per mesh: ``mesh``, ``unknowns``, ``cells``, ``cell_size_mm`` (cube root of volume
        over cells), the columns of `quantities`, ``displacement_at_max_mm``, ``reached_mm``,
        ``ending``, ``steps``, ``newton_iterations``, ``cut_backs``, ``wall_s``, ``cpu_s``.
    quantities
        Extrapolation of ``max_force_N``, ``slope_N_per_mm``, and ``force_4mm_N`` or the like for
        each of `positions_mm`. A mesh whose run ended too early for a quantity is left out of it.
    """

    test: BendingTest
    order: int
    runs: tuple[KeptRun, ...]
    positions_mm: tuple[float, ...]
    meshes: pd.DataFrame
    quantities: Mapping[str, Extrapolation]

    @property
    def completed(self) -> bool:
        """Whether all meshes reached the whole travel."""
        return all(run.result.completed for run in self.runs)

    def reference(self, quantity: str) -> float:
        """Return the Richardson limit or, if there is none, the value of the finest mesh."""
        limit = self.quantities[quantity].limit
        if limit is not None:
            return limit
        return self._finest(quantity)

    def errors(self, quantity: str) -> pd.Series:
        """Return each mesh's error relative to `reference`; NaN for the mesh that gave it."""
        reference = self.reference(quantity)
        values = self.meshes[quantity]
        return (values / reference - 1.0).abs().where(values != reference)

    def notes(self) -> list[str]:
        """Return remarks on single runs, one sentence each."""
        told = []
        for name, run in zip(self.meshes["mesh"], self.runs, strict=True):
            result = run.result
            if not result.completed:
                told.append(f"{name} did not complete the travel: {result.ending.reason}")
            if "ellipticity" in result.losses_mm:
                at = result.losses_mm["ellipticity"]
                told.append(
                    f"{name} loses strong ellipticity at {at:.2f} mm of travel: beyond it there is "
                    "no limit to converge to"
                )
            told += [f"{name} jumps at {jump.displacement_mm:.2f} mm" for jump in result.jumps]
        if self.meshes["steps"].nunique() > 1:
            few, many = self.meshes["steps"].min(), self.meshes["steps"].max()
            told.append(
                f"{few} to {many} steps were taken: some of the differences are not due to the "
                "mesh, see numerics.stepping.max_step_mm"
            )
        return told

    @property
    def title(self) -> str:
        """Title of the study."""
        order = {1: "first", 2: "second"}[self.order]
        return f"Mesh convergence, {len(self.runs)} meshes of {order} order"

    def findings(self) -> list[str]:
        """Return what each quantity converges to, and how uncertain it is."""
        return [self._told(name, found) for name, found in self.quantities.items()]

    def _told(self, name: str, found: Extrapolation) -> str:
        label, unit = label_of(name), "N/mm" if name == "slope_N_per_mm" else "N"
        said = f"{label[0].upper()}{label[1:]}: {self._finest(name):.5g} {unit} on the finest mesh"
        said += f", {BEHAVIOURS[found.behaviour]}"
        if found.order is not None:
            said += f" with order {found.order:.2f}"
        if found.limit is not None:
            said += f" to {found.limit:.5g} {unit}"
        elif found.order is not None:
            said += ", as the last two meshes agree by accident"
        if found.uncertainty is not None:
            said += f"; uncertain by {100.0 * found.uncertainty:.2g} %"
        return f"{said}."

    def _finest(self, quantity: str) -> float:
        values = self.meshes[quantity].dropna()
        return float(values.iloc[-1]) if len(values) else math.nan

    def overview(self) -> pd.DataFrame:
        """Return size, quantities and cost of every mesh."""
        cost = ["newton_iterations", "cpu_s"]
        table = self.meshes[["mesh", "unknowns", *self.quantities, *cost]]
        return table.rename(columns={"newton_iterations": "iterations"})

    def numbers(self) -> dict[str, Any]:
        """Return the extrapolations, and size and cost of every mesh."""
        return {
            "order": self.order,
            "positions_mm": self.positions_mm,
            "quantities": {
                name: {**dataclasses.asdict(found), "uncertainty": found.uncertainty}
                for name, found in self.quantities.items()
            },
            "meshes": {
                name: {
                    **dataclasses.asdict(run.result.statistics),
                    "cpu_s": run.cpu_s,
                    "ending": dataclasses.asdict(run.result.ending),
                    "lost_at_mm": run.result.losses_mm,
                    "jumps": [dataclasses.asdict(jump) for jump in run.result.jumps],
                    "recipe": to_dict(run.result.test.numerics.mesh),
                }
                for name, run in zip(self.meshes["mesh"], self.runs, strict=True)
            },
            "specification": to_dict(self.test),
        }

    def tables(self) -> dict[str, Table]:
        """Return the tables of meshes, extrapolations and curves."""
        curves = {
            name: run.result.curve[["displacement_mm", "force_N"]]
            for name, run in zip(self.meshes["mesh"], self.runs, strict=True)
        }
        return {
            "convergence": Table(self.meshes, "One row per mesh."),
            "richardson": Table(
                self._extrapolations(),
                "Extrapolation of each quantity from the three finest meshes. Index, change, "
                "spread and uncertainty are relative to the value on the finest mesh.",
            ),
            "curves": Table(stack(curves, "mesh")),
        }

    def _extrapolations(self) -> pd.DataFrame:
        rows = []
        for name, found in self.quantities.items():
            finest = self.meshes["mesh"][self.meshes[name].notna()].iloc[-3:]
            row = {"quantity": name, "meshes": " ".join(finest), "finest_value": self._finest(name)}
            rows.append({**row, **dataclasses.asdict(found), "uncertainty": found.uncertainty})
        return pd.DataFrame(rows)

    def figures(self) -> dict[str, Picture]:
        """Return the figures of the curves, and of errors against cost."""
        from ramiefenics.convergence import figures

        return {
            "curves": Picture(
                partial(figures.curves_figure, self),
                "Force against travel on all meshes; a cross marks a run that ended early.",
            ),
            "error": Picture(
                partial(figures.error_figure, self),
                "Errors against size and cost of the mesh.",
            ),
        }

    def specifications(self) -> dict[str, BendingTest]:
        """Return the specification, with its own mesh."""
        return {"specification": self.test}

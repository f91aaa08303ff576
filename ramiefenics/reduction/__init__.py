"""Reduction of measured curves to numbers, and statistics of these by group."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import pandas as pd

from ramiefenics.measured import Dataset, read_dataset
from ramiefenics.reduction.curves import QUANTITIES, CurveNumbers, reduce_curve, reduce_section
from ramiefenics.reduction.differences import differences, few_units, in_several_groups
from ramiefenics.reduction.groups import by_group, describe, ordered
from ramiefenics.results.result import Picture, Result, Table
from ramiefenics.specification import SpecificationError
from ramiefenics.specification.files import to_dict

__all__ = [
    "QUANTITIES",
    "CurveNumbers",
    "Reduction",
    "describe",
    "reduce_curve",
    "reduce_dataset",
]

ALL = "all"
"""Name of the only group if no column is given."""

ALPHA = 0.05
"""Value of p below which a difference between groups is significant."""

TOLD = ("slope_N_per_mm", "peak_N", "strength_MPa")
"""Quantities that the findings report."""


@dataclass(frozen=True, repr=False)
class Reduction(Result):
    """Result of the reduction of a data set.

    Attributes
    ----------
    dataset
        Measured data.
    by
        Column of `specimens.csv` or `tests.csv` that names the groups; None for a single group.
    curves
        One row per record: its ``specimen``, its name (``record``), its ``group``, the fields of
        `CurveNumbers`, and the section with its strength and moduli (see `reduce_section`).
    groups
        One row per group and quantity of `QUANTITIES`: mean and intervals; see `describe`.
    seed
        Seed of the resampling.
    tests
        Whether the groups differ, one row per quantity. Empty if there is only one group.
    pairs
        Which groups differ, one row per quantity and pair. Empty if there is only one group.
    within
        Column or columns that name the units whose curves are not independent; None for the
        specimen.
    """

    SUMMARY: ClassVar[str] = "manifest.json"

    dataset: Dataset
    by: str | None
    curves: pd.DataFrame
    groups: pd.DataFrame
    seed: int
    tests: pd.DataFrame
    pairs: pd.DataFrame
    within: str | None = None

    @property
    def names(self) -> list[str]:
        """Names of the groups."""
        return ordered(list(self.curves["group"]))

    def notes(self) -> list[str]:
        """Return what a user of the numbers should know, one sentence each."""
        notes = []
        keys = self.dataset.layout.specimens
        if not any(key.endswith(("outer_diameter_mm", "section_height_mm")) for key in keys):
            notes.append(
                "strengths and moduli are for the baseline's section, as [specimens] in "
                "dataset.toml gives no outer diameter"
            )
        nonsense = ~(self.curves["slope_N_per_mm"] > 0.0)
        if nonsense.any():
            which = ", ".join(self.curves.loc[nonsense, "record"])
            notes.append(f"{which}: no positive initial slope; is the zero of the force correct?")
        notes += self._at_the_start()
        notes += self.dataset.notes()
        if self.curves.duplicated(["group", "specimen"]).any():
            notes.append(
                "groups have several curves of the same specimen, but the intervals treat them as "
                "independent: to separate them, group by a column of tests.csv (by)"
            )
        notes += self._on_units()
        for column, what in (
            ("still_rising", "still rise at the end of the record; their peaks are lower bounds"),
            ("slope_stable", "have no straight part; their initial slopes are averages"),
        ):
            told = self.curves[column]
            if column == "slope_stable":
                told = ~told & ~nonsense
            if told.any():
                notes.append(f"{told.sum()} of {len(told)} curves {what} ({column})")
        return notes

    def _on_units(self) -> list[str]:
        """Return notes on groups that are not compared, and on units in several groups."""
        if self.by is None:
            return []
        groups, units = list(self.curves["group"]), _units(self.dataset, self.within)
        unit, notes = self.within or "specimen", []
        few = few_units(groups, units)
        if len(self.names) - len(few) < 2:
            notes.append(
                f"nothing is compared: fewer than two groups of {self.by} have more than one {unit}"
            )
        elif few:
            which = ", ".join(few)
            notes.append(
                f"{self.by} {which}: not compared with others, for want of a second {unit}"
            )
        if not self.tests.empty and (both := in_several_groups(groups, units)):
            notes.append(
                f"{len(both)} of {len(set(units))} values of {unit} occur in several groups of "
                f"{self.by}, which are compared within them; if equal values do not mean the same "
                f"{unit} there, name its units by both columns (within = {self.by},{unit})"
            )
        return notes

    def _at_the_start(self) -> list[str]:
        """Return notes on preloads and on load cells that were not zeroed."""
        if self.dataset.layout.seating.zero != "machine":
            return []
        start = np.array([s.curve["force_N"].iloc[0] for s in self.dataset.records])
        noise, peak = self.curves["noise_N"].to_numpy(), self.curves["peak_N"].to_numpy()
        seen = np.maximum(5.0 * noise, 0.01 * peak)
        notes = []
        if (start > seen).any():
            notes.append(
                f"{(start > seen).sum()} of {len(start)} curves begin with a force of up to "
                f'{start.max():.3g} N: if there was a preload, zero = "toe" in [seating] adds the '
                "displacement that it caused"
            )
        if (start < -seen).any():
            notes.append(
                f"{(start < -seen).sum()} of {len(start)} curves begin with a negative force, down "
                f"to {start.min():.3g} N: was the load cell zeroed?"
            )
        return notes

    @property
    def title(self) -> str:
        """Title of the data set, marked as reduced."""
        return f"{self.dataset.title}, reduced"

    def findings(self) -> list[str]:
        """Return the means of the main quantities with their intervals, and compare the groups."""
        told = []
        for group in self.names:
            rows = self.groups[self.groups["group"] == group].set_index("quantity")
            cells = [f"{group}, n = {rows['n']['peak_N']}"]
            for name in TOLD:
                row, (title, unit) = rows.loc[name], QUANTITIES[name]
                interval = f" ({row['low']:.4g} to {row['high']:.4g})" if row["n"] > 1 else ""
                cells.append(f"{title} {row['mean']:.4g}{interval} {unit}")
            told.append("; ".join(cells))
        return told + [self._compared(name) for name in TOLD if name in set(self._tested)]

    @property
    def _tested(self) -> list[str]:
        return [] if self.tests.empty else list(self.tests["quantity"])

    def _compared(self, name: str) -> str:
        test = self.tests.set_index("quantity").loc[name]
        pairs = self.pairs[(self.pairs["quantity"] == name) & (self.pairs["p"] < ALPHA)]
        title = QUANTITIES[name][0]
        method = f"{test['method'][0].upper()}{test['method'][1:]}"
        said = (
            f"{title[0].upper()}{title[1:]}, test of equal group means: {method}, "
            f"F({test['df']:.3g}, {test['df_within']:.3g}) = {test['F']:.3g}, p = {test['p']:.2g}"
        )
        if pairs.empty:
            return f"{said}; no two groups differ significantly (Holm's p)."
        apart = [
            f"{row['second']} less {row['first']} {row['difference']:+.3g} ({row['low']:.3g} to "
            f"{row['high']:.3g}) {QUANTITIES[name][1]}, Holm's p = {row['p']:.2g}, Hedges' g = "
            f"{row['g']:.2g}"
            for _, row in pairs.iterrows()
        ]
        return f"{said}; {'; '.join(apart)}; intervals are not adjusted for several comparisons."

    def numbers(self) -> dict[str, Any]:
        """Return the data set, its specification, and the options of the reduction."""
        return {
            "dataset_folder": str(self.dataset.folder.resolve()),
            "dataset": to_dict(self.dataset.layout),
            "specification": to_dict(self.dataset.baseline),
            "specimens": len(self.dataset.specimens),
            "by": self.by,
            "within": self.within,
            "seed": self.seed,
            "units": {name: unit for name, (_, unit) in QUANTITIES.items()},
        }

    def tables(self) -> dict[str, Table]:
        """Return tables by group and by record, and of the comparison of groups."""
        means = "Means of the groups, with 95 % confidence intervals and their method."
        return {
            "groups": Table(self.groups, means, digits=6),
            "curves": Table(self.curves, "One row per record.", digits=6),
            **self._comparison(),
        }

    def _comparison(self) -> dict[str, Table]:
        if self.tests.empty:
            return {}
        return {
            "tests": Table(
                self.tests,
                "Tests of equal group means, by Welch's analysis of variance or a mixed model, and "
                "the share of the variance that lies between groups.",
                digits=6,
            ),
            "pairs": Table(
                self.pairs,
                "Second less first group: difference of the means with its 95 % interval, not "
                "adjusted for several comparisons, p adjusted by Holm's method over the pairs of "
                "a quantity, and Hedges' g.",
                digits=6,
            ),
        }

    def figures(self) -> dict[str, Picture]:
        """Return figures of the curves and of the quantities, by group."""
        from ramiefenics.reduction import figures

        return {
            "curves": Picture(
                partial(figures.curves_by_group_figure, self),
                "Curves, with the groups' means.",
            ),
            "quantities": Picture(
                partial(figures.quantities_by_group_figure, self),
                "Quantities computed from the curves, with the groups' means.",
            ),
        }


def reduce_dataset(
    dataset: Dataset | str | Path,
    by: str | None = None,
    seed: int = 0,
    within: str | None = None,
) -> Reduction:
    """Reduce every curve of a data set, average by group, and compare the groups.

    Parameters
    ----------
    dataset
        Measured data, or the folder that contains them.
    by
        Column of `specimens.csv` or `tests.csv` that names the groups.
    seed
        Seed of the resampling for bootstrap intervals.
    within
        Column that names a unit, such as a plant, whose curves are not independent of each other;
        by default the specimen. If equal values do not always mean the same unit, as of plants
        numbered anew in each plot, several columns with commas between them: ``plot,plant``.

    Raises
    ------
    SpecificationError
        If the folder is defective, there is no such column, or units are named without groups.
    """
    if within is not None and by is None:
        allowed = "must come with a column that names the groups (by), which are compared"
        raise SpecificationError("within", within, allowed)
    if not isinstance(dataset, Dataset):
        dataset = read_dataset(dataset)
    rows = []
    for record in dataset.records:
        asked = [] if by is None else [("by", by), *(("within", c) for c in _columns(within))]
        for option, column in asked:
            if column not in record.row:
                there = ", ".join(record.row)
                allowed = f"must be a column of specimens.csv or tests.csv ({there})"
                raise SpecificationError(option, column, allowed)
        numbers = reduce_curve(record.curve)
        rows.append(
            {
                "specimen": record.specimen,
                "record": record.name,
                "group": ALL if by is None else record.row[by],
                **dataclasses.asdict(numbers),
                **reduce_section(record, numbers),
            }
        )
    curves = pd.DataFrame(rows)
    groups = by_group(curves, list(curves["group"]), list(QUANTITIES), seed)
    units = _units(dataset, within)
    tests, pairs = differences(curves, list(curves["group"]), list(QUANTITIES), units)
    return Reduction(dataset, by, curves, groups, seed, tests, pairs, within)


def _units(dataset: Dataset, within: str | None) -> list[str]:
    """Return the unit of each record whose curves are not independent of each other."""
    if within is None:
        return [record.specimen for record in dataset.records]
    return [", ".join(record.row[c] for c in _columns(within)) for record in dataset.records]


def _columns(within: str | None) -> list[str]:
    """Return the names of the columns that name a unit."""
    return [] if within is None else [column.strip() for column in within.split(",")]

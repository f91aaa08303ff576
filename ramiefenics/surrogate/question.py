"""Tasks for force curves, expressed in coordinates."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from ramiefenics.runs.curve import CurveTask, normalised
from ramiefenics.specification import BendingTest, SpecificationError
from ramiefenics.specification.replacing import Path
from ramiefenics.surrogate.coordinates import coordinates, numbers
from ramiefenics.surrogate.family import Array

SMALL = 1e-3
"""Step of numerical derivatives, in the unit of the change."""


@dataclass(frozen=True)
class Question:
    """A task, expressed in coordinates.

    Attributes
    ----------
    task
        The task.
    test, factor
        Its normalised specification, and the factor on the forces of that.
    at
        Coordinates, shape (d,).
    changes, scales
        Derivatives of the coordinates, and of the logarithm of the factor, with respect to the
        factors of the task, shapes (k, d) and (k,).
    """

    task: CurveTask
    test: BendingTest
    factor: float
    at: Array
    changes: Array
    scales: Array

    @classmethod
    def of(cls, task: CurveTask, paths: Sequence[Path]) -> Question:
        """Express a task in the coordinates at some paths."""
        test, factor = normalised(task.test)
        changes, scales = np.zeros((len(task.factors), len(paths))), np.zeros(len(task.factors))
        for k, change in enumerate(task.factors):
            ends = []
            for amount in (-SMALL, SMALL):
                try:
                    moved, moved_factor = normalised(change.apply(test, amount))
                except SpecificationError:  # one-sided
                    amount, moved, moved_factor = 0.0, test, 1.0
                ends.append((amount, coordinates(numbers(moved), paths), np.log(moved_factor)))
            (a, at_a, log_a), (b, at_b, log_b) = ends
            changes[k], scales[k] = (at_b - at_a) / (b - a), (log_b - log_a) / (b - a)
        return cls(task, test, factor, coordinates(numbers(test), paths), changes, scales)

    def curve(self, displacement_mm: Array, force_N: Array, by_changes: Array) -> pd.DataFrame:
        """Return the curve, given normalised forces and their derivatives along the changes."""
        columns = {"displacement_mm": displacement_mm, "force_N": self.factor * force_N}
        slopes = self.factor * (by_changes + self.scales[:, None] * force_N)
        names = [factor.name for factor in self.task.factors]
        return pd.DataFrame(columns | dict(zip(names, slopes, strict=True)))

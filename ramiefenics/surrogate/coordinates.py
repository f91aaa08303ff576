"""The numbers by which stalks and fixtures differ, as coordinates."""

from __future__ import annotations

import functools
import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from ramiefenics.runs.curve import REMEMBERED
from ramiefenics.specification import BendingTest
from ramiefenics.specification.files import to_dict
from ramiefenics.specification.replacing import Path, replaced

Array = NDArray[np.floating[Any]]

PARTS = ("stalk", "fixture")
"""Parts of a specification whose numbers are coordinates; everything else must be the same."""

LOGARITHMIC = ("_mm", "_MPa")
"""Endings of the names of numbers whose logarithm is the coordinate."""

SIGNED = ("void_offset_mm", "node_at_mm", "indenter_offset_mm", "z_mm")
"""Lengths that may be negative, which are coordinates themselves."""

MAY_BE_NEGATIVE = (
    *SIGNED,
    "taper",
    "curvature_per_m",
    "rotation_deg",
    "radial_gradient",
    "fibre_angle_deg",
    "growth_strain",
)
"""Numbers that may be negative, so that curves change smoothly where they are zero."""

SMALLEST = 1e-9
"""Number whose logarithm stands for that of zero; it is far from those of all nonzero numbers."""


@functools.lru_cache(maxsize=REMEMBERED)
def numbers(test: BendingTest) -> Mapping[Path, float]:
    """Return the numbers of stalk and fixture, by their paths."""
    found: dict[Path, float] = {}

    def walk(part: Any, path: Path) -> None:
        if isinstance(part, float) and math.isfinite(part):
            found[path] = part
        elif isinstance(part, (dict, list)):
            for key, value in part.items() if isinstance(part, dict) else enumerate(part):
                walk(value, (*path, key))

    data = to_dict(test)
    for name in PARTS:
        walk(data[name], (name,))
    return MappingProxyType(found)


@functools.lru_cache(maxsize=REMEMBERED)
def rest_of(test: BendingTest) -> str:
    """Return everything in a specification except these numbers, as text."""
    data: dict[str, Any] = to_dict(test)
    for path in numbers(test):
        part: Any = data
        for key in path[:-1]:
            part = part[key]
        part[path[-1]] = None
    return json.dumps(data, sort_keys=True)


def is_logarithmic(path: Path) -> bool:
    """Return whether a number's coordinate is its logarithm."""
    return path[-1] not in SIGNED and is_size(path)


def is_size(path: Path) -> bool:
    """Return whether a number has the dimension of a length or of a modulus."""
    return str(path[-1]).endswith(LOGARITHMIC)


def coordinates(values: Mapping[Path, float], paths: Sequence[Path]) -> Array:
    """Return the coordinates of the numbers at some paths, shape (len(paths),)."""
    return np.array(
        [
            math.log(max(values[path], SMALLEST)) if is_logarithmic(path) else values[path]
            for path in paths
        ]
    )


@dataclass(frozen=True)
class Direction:
    """A change of several coordinates at once.

    Attributes
    ----------
    name
        Name, one word.
    paths, weights
        Paths of these coordinates, and the change of each per unit.
    """

    name: str
    paths: tuple[Path, ...]
    weights: tuple[float, ...]

    TYPICAL: ClassVar[float] = 0.1
    """A change that matters."""

    def apply(self, test: BendingTest, amount: float) -> BendingTest:
        """Return the specification with these coordinates changed by an amount."""
        values, changed = numbers(test), {}
        for path, weight in zip(self.paths, self.weights, strict=True):
            change = amount * weight
            factor = math.exp(change) if is_logarithmic(path) else 1.0
            shift = 0.0 if is_logarithmic(path) else change
            changed[path] = factor * values[path] + shift
        return replaced(test, changed)

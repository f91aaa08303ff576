"""The region of a design, in which its response surfaces may be trusted."""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import qmc

from ramiefenics.calibration.factors import Array

TOLERANCE = 1e-9
"""Coded distance by which a point may lie outside the region and still count as inside."""


@dataclass(frozen=True)
class Region:
    """The intersection of a box and a ball around 0, in coded units.

    Attributes
    ----------
    dimension
        Number of factors.
    reach
        Half the width of the box: the largest coded value in the design.
    radius
        Radius of the ball: the largest distance of a point of the design from the centre.
    """

    dimension: int
    reach: float
    radius: float

    @classmethod
    def of(cls, points: Array) -> Region:
        """Return the region of a design, given by coded points of shape (n, k)."""
        distances = np.linalg.norm(points, axis=1)
        return cls(points.shape[1], float(np.abs(points).max()), float(distances.max()))

    @property
    def bounds(self) -> list[tuple[float, float]]:
        """Bounds of the box, per factor."""
        return [(-self.reach, self.reach)] * self.dimension

    def contains(self, points: Array) -> NDArray[np.bool_]:
        """Return whether points, of shape (..., k), lie in the region."""
        inside = np.abs(points).max(axis=-1) <= self.reach + TOLERANCE
        near = np.linalg.norm(points, axis=-1) <= self.radius + TOLERANCE
        return np.asarray(inside & near)

    @property
    def is_box(self) -> bool:
        """Whether the ball contains the whole box."""
        return self.radius >= self.reach * math.sqrt(self.dimension) - TOLERANCE

    def slice(self, value: float) -> Region:
        """Return the region of the other factors if one factor has this coded value."""
        left = math.sqrt(max(self.radius**2 - value**2, 0.0))
        return Region(self.dimension - 1, min(self.reach, left), left)

    def sample(self, number: int, seed: int = 0) -> Array:
        """Return points of a scrambled Sobol sequence (1967) that fill the region evenly.

        There are approximately as many as `number`, depending on the region's share of the box, but
        at least one.
        """
        trial = self._box(256, seed)
        share = max(float(self.contains(trial).mean()), 1.0 / 256.0)
        points = self._box(math.ceil(number / share), seed)
        inside = points[self.contains(points)]
        return inside if len(inside) else np.zeros((1, self.dimension))

    def _box(self, number: int, seed: int) -> Array:
        return sobol_points(self.dimension, number, seed) * self.reach

    def pull_in(self, points: Array) -> Array:
        """Return points, of shape (n, k), after moving those outside into the region."""
        points = np.clip(points, -self.reach, self.reach)
        distances = np.linalg.norm(points, axis=-1, keepdims=True)
        return np.asarray(points * np.minimum(1.0, self.radius / np.maximum(distances, 1e-300)))


@functools.lru_cache(maxsize=16)  # every point of a profile needs the same ones
def sobol_points(dimension: int, number: int, seed: int) -> Array:
    """Return points of a scrambled Sobol sequence in [-1, 1], of shape (number, dimension)."""
    sampler = qmc.Sobol(dimension, seed=seed)
    points = 2.0 * sampler.random_base2(max(0, math.ceil(math.log2(number))))[:number] - 1.0
    points.flags.writeable = False
    return np.asarray(points)

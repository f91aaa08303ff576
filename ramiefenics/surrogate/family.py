"""Force curves of specifications that differ by numbers, learned from simulations of some."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import Akima1DInterpolator

from ramiefenics.surrogate.directions import combinations
from ramiefenics.surrogate.process import Observed, Process

Array = NDArray[np.floating[Any]]

DISPLACEMENTS = 56
"""Number of equally spaced displacements at which curves are learned."""

ROUNDING = 1e-6
"""Difference of coordinates, relative to their range, below which these count as equal."""

EXACT = 1e-9
"""Least expected error, relative to the peak, with which an actual error is compared."""


@dataclass(frozen=True)
class Run:
    """A simulation with derivatives.

    Attributes
    ----------
    at
        Its coordinates, shape (d,).
    along
        Directions of the derivatives, shape (q, d).
    displacement_mm
        Displacements, shape (p,).
    force_N, by_direction_N
        Forces there, shape (p,), and their derivatives along the directions, shape (q, p).
    error
        Reason of the failure if it failed, in which case there are no forces.
    smooth
        Whether jumps were refused, in which case it may have failed because of one.
    """

    at: Array
    along: Array
    displacement_mm: Array
    force_N: Array
    by_direction_N: Array
    error: Exception | None = None
    smooth: bool = False

    def weights(self, changes: Array) -> Array | None:
        """Return changes, shape (k, d), as combinations of `along`; None if that is impossible."""
        if not len(changes):
            return np.zeros((0, len(self.along)))
        weights = combinations(changes, self.along)
        return weights if np.allclose(weights @ self.along, changes, atol=ROUNDING) else None

    def reaches(self, travel_mm: float) -> bool:
        """Return whether there are positive forces up to a displacement."""
        return bool(
            self.error is None
            and self.displacement_mm[-1] > travel_mm - 1e-9
            and np.all(self.force_N[self.displacement_mm > 0.0] > 0.0)
        )

    def logarithms(self, at_mm: Array) -> Array:
        """Return the logarithm of force over displacement, and its derivatives, (1 + q, m)."""
        x = self.displacement_mm
        read = Akima1DInterpolator(x, np.vstack([self.force_N, self.by_direction_N]), axis=1)
        force, *slopes = read(np.minimum(at_mm, x[-1]))
        return np.array([np.log(force / at_mm), *(slope / force for slope in slopes)])


class Family:
    """Curves of one family of specifications, learned from runs.

    Parameters
    ----------
    runs
        Simulations, some of which have reached the end.
    travel_mm
        Displacement that curves must reach.

    Attributes
    ----------
    at_mm
        Displacements at which curves are learned, shape (m,).
    """

    def __init__(self, runs: Sequence[Run], travel_mm: float) -> None:
        self.at_mm = travel_mm * np.arange(1, DISPLACEMENTS + 1) / DISPLACEMENTS
        self._used = [run for run in runs if run.reaches(travel_mm)]
        self._short = [run for run in runs if not run.reaches(travel_mm)]
        at = np.array([run.at for run in self._used])
        along = np.concatenate([run.along for run in self._used])
        self._centre = at.mean(axis=0)
        scale = np.maximum(np.ptp(at, axis=0), np.abs(along).max(axis=0))
        self._scale = np.where(scale > 0.0, scale, 1.0)
        span = np.concatenate([at - self._centre, along]) / self._scale
        _, sizes, axes = np.linalg.svd(span, full_matrices=False)
        self._axes = axes[sizes > ROUNDING * sizes[0]]
        self._process = Process(self._observed(at))

    def _observed(self, at: Array) -> Observed:
        counts = [1 + len(run.along) for run in self._used]
        along = [np.vstack([np.zeros_like(run.at), run.along]) for run in self._used]
        return Observed(
            np.repeat(self._inside(at), counts, axis=0),
            np.concatenate(along) / self._scale @ self._axes.T,
            np.concatenate([run.logarithms(self.at_mm) for run in self._used]),
            np.repeat(np.arange(len(counts)), counts),
        )

    def _inside(self, at: Array) -> Array:
        return np.asarray((at - self._centre) / self._scale @ self._axes.T)

    def spans(self, directions: Array) -> bool:
        """Return whether the runs show changes in all of some directions, shape (k, d)."""
        scaled = directions / self._scale
        return bool(np.all(np.abs(scaled - scaled @ self._axes.T @ self._axes) < ROUNDING))

    def force_N(self, at: Array) -> Array:
        """Return the forces at given coordinates, shape (n, m)."""
        return np.asarray(np.exp(self._process.mean(self._inside(at))) * self.at_mm)

    @cached_property
    def left_out(self) -> tuple[Array, Array]:
        """Errors of runs predicted from all others, and the errors expected of them.

        Both are root mean squares over displacements, relative to the peak, for those runs that the
        others can predict.
        """
        errors, sd = self._process.left_out()
        logs = np.array([run.logarithms(self.at_mm)[0] for run in self._used])
        told = np.isfinite(errors).all(axis=1)
        return self._over_peak(logs[told], errors[told]), self._over_peak(logs[told], sd[told])

    def _over_peak(self, logs: Array, errors: Array) -> Array:
        force = np.exp(logs) * self.at_mm
        relative = errors * force / force.max(axis=1, keepdims=True)
        return np.asarray(np.sqrt((relative**2).mean(axis=1)))

    def expected_errors(self, at: Array) -> Array:
        """Return expected errors relative to the peak, two standard deviations, shape (n,).

        The process gives the standard deviations; if left-out runs show larger errors than it
        expects, these are enlarged accordingly. Errors are infinite in directions about which no
        run tells anything, where the nearest run does not reach the end, and as long as no run can
        be predicted from the others.
        """
        inside = self._inside(at)
        missed, expected = self.left_out
        if not len(missed):
            return np.full(len(at), np.inf)
        ratios = missed / np.maximum(expected, EXACT)
        caution = max(1.0, float(np.sqrt((ratios**2).mean())))
        errors = (
            2.0 * caution * self._over_peak(self._process.mean(inside), self._process.sd(inside))
        )
        errors[[not self.spans(here[None] - self._centre) for here in at]] = np.inf
        if self._short:
            near, short = (self._nearest(inside, runs) for runs in (self._used, self._short))
            errors[short < near] = np.inf
        return errors

    def _nearest(self, inside: Array, runs: Sequence[Run]) -> Array:
        others = self._inside(np.array([run.at for run in runs]))
        apart = (inside[:, None] - others) / self._process.lengths
        return np.asarray((apart**2).sum(axis=2).min(axis=1))

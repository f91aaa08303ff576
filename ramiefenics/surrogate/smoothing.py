"""Derivatives of force curves without the irregularities of single steps."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.stats import siegelslopes

Array = NDArray[np.floating[Any]]

NEIGHBOURS = 2
"""Number of steps on either side from which a derivative is smoothed."""


def smoothed(displacement_mm: Array, force_N: Array, slope: Array) -> Array:
    """Return a derivative of a force curve, smoothed along the displacement.

    Where a point of the surface comes into contact, the force bends, by a few thousandths, and its
    derivative may be off at that step, by up to a third. The derivative relative to the force is
    therefore replaced by that of straight lines through `NEIGHBOURS` steps on either side, fitted
    by repeated medians, which leave outliers aside (Siegel 1982, Biometrika 69, 242-244). Those of
    the first steps under load are kept, because there they really change fast.

    Parameters
    ----------
    displacement_mm, force_N
        Displacements and forces, shape (p,).
    slope
        Derivative of the forces, shape (p,).
    """
    found = slope.astype(float)
    (loaded,) = np.nonzero(force_N > 0.0)
    x, relative = displacement_mm[loaded], slope[loaded] / force_N[loaded]
    for i in range(NEIGHBOURS, len(loaded)):
        near = slice(i - NEIGHBOURS, i + NEIGHBOURS + 1)
        line = siegelslopes(relative[near], x[near] - x[i])
        found[loaded[i]] = line.intercept * force_N[loaded[i]]
    return found

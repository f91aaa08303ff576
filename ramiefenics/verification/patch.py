"""Patch test: a layered block, stretched and sheared, with distorted cells."""

from __future__ import annotations

import numpy as np
import pandas as pd
from dolfinx import fem
from dolfinx import mesh as dmesh
from scipy.optimize import fsolve

from ramiefenics.model.solid import Solid
from ramiefenics.published.stalks import PHLOEM, XYLEM
from ramiefenics.verification.block import (
    BoundaryValueProblem,
    all_around,
    block,
    layers,
    prescribe,
    second_order,
)
from ramiefenics.verification.point import Point
from ramiefenics.verification.study import Array, Study, at_most

LAW = "saturating_fibre"
INTERFACE, DISTORTION, CELLS = 0.5, 0.25, 4

START = 1e-3
"""Largest deviation from the solution, mm, with which Newton's method starts."""

BELOW = np.array([[1.05, 0.04, 0.02], [0.01, 0.9, 0.03], [0.0, 0.05, 1.02]])
"""Deformation gradient of the lower layer."""

SPACES = {"order 1": (1, False), "order 2": (2, False), "order 2, serendipity": (2, True)}


def above() -> Array:
    """Return the deformation gradient of the upper layer, in equilibrium with the lower one.

    The two layers have the same displacement at the interface, so their gradients differ by
    q (x) e_Y (Hadamard 1903); q is such that their tractions on the interface are equal.
    """
    lower, upper = Point(LAW, XYLEM), Point(LAW, PHLOEM)
    traction = lower.stress(BELOW)[:, 1]

    def gradient(q: Array) -> Array:
        return BELOW + np.outer(q, [0.0, 1.0, 0.0])

    return gradient(fsolve(lambda q: upper.stress(gradient(q))[:, 1] - traction, np.zeros(3)))


def distorted(order: int) -> dmesh.Mesh:
    """Return a unit cube of straight-edged cells whose inner nodes are displaced at random."""
    even = np.linspace(0.0, 1.0, CELLS + 1)
    mesh = block(even, even, even)
    points = mesh.geometry.x
    inside = (points > 1e-9) & (points < 1 - 1e-9)
    inside[:, 1] &= np.abs(points[:, 1] - INTERFACE) > 1e-9
    moves = np.random.default_rng(1).uniform(-1, 1, points.shape)
    points += np.where(inside, DISTORTION / CELLS * moves, 0.0)
    return mesh if order == 1 else second_order(mesh)


def error(order: int, serendipity: bool, upper: Array) -> float:
    """Return the largest error of the displacement, relative to its largest value."""
    mesh = distorted(order)
    solid = Solid(mesh, layers(mesh, [INTERFACE]), [XYLEM, PHLOEM], LAW, serendipity)

    def exact(x: Array) -> Array:
        step = np.outer(upper[:, 1] - BELOW[:, 1], np.maximum(x[1] - INTERFACE, 0.0))
        return np.asarray(BELOW @ x + step - x)

    wanted = fem.Function(solid.space)
    wanted.interpolate(exact)
    start = np.random.default_rng(2).uniform(-START, START, len(wanted.x.array))
    solid.displacement.x.array[:] = wanted.x.array + start
    around = prescribe(solid, all_around(mesh), exact)
    BoundaryValueProblem(solid, [around]).solve(1e-10)
    miss = solid.displacement.x.array - wanted.x.array
    return float(np.abs(miss).max() / np.abs(wanted.x.array).max())


def patch() -> Study:
    """Run the patch test in all displacement spaces."""
    upper = above()
    errors = {name: error(*space, upper) for name, space in SPACES.items()}
    return Study(
        "Patch test",
        "Two layers, xylem below phloem, each with a constant deformation gradient, different "
        "but compatible and in balance at their interface. Displacements are prescribed on the "
        f"surface; inside, {CELLS}^3 cells are distorted at random by up to {DISTORTION:.0%} of "
        "their size. The exact solution is linear in each layer and must be reproduced.",
        (
            at_most(
                "largest error of the displacement, relative",
                max(errors.values()),
                1e-8,
                "rounding, amplified by the ratio of moduli",
            ),
        ),
        pd.DataFrame({"space": list(errors), "relative error": list(errors.values())}),
    )

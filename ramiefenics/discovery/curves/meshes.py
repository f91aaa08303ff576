"""Finer meshes of a stalk, which tell discretisation error from physics."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ramiefenics.specification import BendingTest, MeshRecipe

FINER = 1.5
"""Refinement ratio that reveals the error of a mesh."""

SLOWEST = 4.0 / 3.0
"""Least order of convergence of a force that is thought possible. Contact and kinks lower it; that
of a functional of second-order elements is 4 where nothing disturbs it (Oberkampf and Roy 2010,
section 8.6)."""


def on_mesh(test: BendingTest, mesh: MeshRecipe) -> BendingTest:
    """Return a test on another mesh."""
    return replace(test, numerics=replace(test.numerics, mesh=mesh))


def finer(recipe: MeshRecipe) -> MeshRecipe:
    """Return a recipe with cells `FINER` times smaller, as nearly as whole numbers allow.

    The growth from cell to cell falls by less than would keep the grading of every row. Cells thus
    shrink most where they are smallest, at the bore and at the stalk's sides, because forces
    converge slowest where the flattened void bends.
    """
    softer = FINER**-0.5
    return replace(
        recipe,
        name="custom",
        angular_elements=2 * max(1, round(recipe.angular_elements * FINER / 2.0)),
        wall_elements=max(1, int(recipe.wall_elements * FINER)),
        rind_elements=max(1, int(recipe.rind_elements * FINER)),
        contact_size=recipe.contact_size / FINER,
        coarse_size=recipe.coarse_size / FINER,
        bore_growth=recipe.bore_growth**softer,
        side_growth=recipe.side_growth**softer,
    )


def limit() -> tuple[float, float]:
    """Return by how much to extrapolate to vanishing cell size, with its uncertainty.

    Richardson's extrapolation is ``F(0) = F(h) + (F(h / r) - F(h)) / (1 - q)``, where refinement
    leaves the share ``q = r^-p`` of the error. The values returned are the mean and the standard
    deviation of the factor ``1 / (1 - q)`` on the change of the force on the finer mesh, with all
    shares up to that of `SLOWEST` equally probable.
    """
    most = FINER**-SLOWEST
    mean = -np.log(1.0 - most) / most
    return float(mean), float(np.sqrt(1.0 / (1.0 - most) - mean**2))

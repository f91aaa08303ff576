"""Other meshes of a stalk: what changes with them is no physics."""

from __future__ import annotations

from dataclasses import replace

from ramiefenics.specification import BendingTest, MeshRecipe

FINER = 1.5
"""Refinement that shows the error of a mesh."""

ORDER_LENGTH, ORDER_SECTION = 3.0, 2.0
"""Elements of first order are shorter along the stalk, and thinner across it, to be as good. They
are not graded: where they are long, straight edges leave the round surface."""


def on_mesh(test: BendingTest, mesh: MeshRecipe) -> BendingTest:
    """Return a test on another mesh."""
    return replace(test, numerics=replace(test.numerics, mesh=mesh))


def other_meshes(recipe: MeshRecipe) -> tuple[MeshRecipe, MeshRecipe]:
    """Return a finer mesh, and one of the other element order."""
    finer = _refined(recipe, FINER, FINER)
    if recipe.order == 2:
        plain = replace(recipe, bore_growth=1.0, side_growth=1.0, serendipity=False)
        other = replace(_refined(plain, ORDER_SECTION, ORDER_LENGTH), order=1)
    else:
        other = replace(_refined(recipe, 1.0 / ORDER_SECTION, 1.0 / ORDER_LENGTH), order=2)
    return finer, other


def _refined(recipe: MeshRecipe, across: float, along: float) -> MeshRecipe:
    return replace(
        recipe,
        name="custom",
        angular_elements=2 * max(1, round(recipe.angular_elements * across / 2.0)),
        wall_elements=max(1, int(recipe.wall_elements * across)),
        rind_elements=max(1, int(recipe.rind_elements * across)),
        contact_size_mm=recipe.contact_size_mm / along,
        coarse_size_mm=recipe.coarse_size_mm / along,
        # the ratio of neighbours, so that the whole layer keeps its grading
        bore_growth=recipe.bore_growth ** (1.0 / across),
        side_growth=recipe.side_growth ** (1.0 / across),
    )

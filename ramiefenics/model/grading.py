"""Positions of the mesh's cross-sections along the stalk."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ramiefenics.specification import BendingTest, Cylinder

DIAMETERS, RADII = 9.0, 21.0
"""Reference lengths of a recipe, besides the span: in diameters of the stalk, and in radii.

The lengths in a recipe are relative to the shortest of the three, over which the fields vary along
a stalk; the radius is that of a cylinder, and counts only under it. The published span, 100 mm for
a stalk of 14.23 mm under cylinders of 5 mm, is shorter than either, but not by much.
"""


def axial_positions(test: BendingTest, others: Sequence[Cylinder] = ()) -> NDArray[np.float64]:
    """Return the Z of every cross-section of nodes, mm, ascending, shape (n,).

    According to the recipe, the sections are close together under the cylinders and farther apart
    in between. They range from 0 to the end of the specimen in the quarter model, and to both ends
    in the others. There is one at every cylinder's axis, and at either face of a node; and one in
    the middle if those are symmetric about it. Otherwise that one might be so near another that the
    elements in between were slivers.

    Parameters
    ----------
    test
        The test.
    others
        Cylinders of other tests of the same stalk.
    """
    cylinders = [*test.fixture.cylinders, *others]
    edges = {*(cylinder.z_mm for cylinder in cylinders), *(test.stalk.node_mm or ())}
    if edges == {-at for at in edges}:
        edges.add(0.0)
    end = test.stalk.length_mm / 2.0
    start = 0.0 if test.numerics.domain == "quarter" else -end
    cuts = sorted({start, end, *(at for at in edges if at > start)})
    pieces = [_graded(*ends, test, cylinders) for ends in itertools.pairwise(cuts)]
    return np.concatenate([pieces[0], *(piece[1:] for piece in pieces[1:])])


def _graded(
    start: float, stop: float, test: BendingTest, cylinders: Sequence[Cylinder]
) -> NDArray[np.float64]:
    """Divide an interval so that element lengths follow the recipe's size function."""
    z = np.linspace(start, stop, 2001)
    density = 1.0 / _element_length(z, test, cylinders)
    count = np.concatenate([[0.0], np.cumsum((density[1:] + density[:-1]) / 2.0 * np.diff(z))])
    elements = max(1, int(np.ceil(count[-1] - 1e-9)))
    return np.interp(np.linspace(0.0, count[-1], elements + 1), count, z)


def _element_length(
    z: NDArray[np.floating], test: BendingTest, cylinders: Sequence[Cylinder]
) -> NDArray[np.float64]:
    """Return the desired length of the elements at Z, mm; nothing varies along a plate."""
    recipe, stalk = test.numerics.mesh, test.stalk
    axes = [cylinder.z_mm for cylinder in cylinders]
    span = max(axes) - min(axes) or stalk.length_mm
    shortest = min(span, DIAMETERS * min(stalk.outer_diameter_mm, stalk.height_mm))
    length = np.full_like(z, recipe.coarse_size * shortest)
    for cylinder in cylinders:
        if not cylinder.flat:
            away = np.abs(z - cylinder.z_mm)
            beyond = np.maximum(away - recipe.contact_zone * shortest, 0.0)
            under = recipe.contact_size * min(shortest, RADII * cylinder.radius_mm)
            length = np.minimum(length, under + recipe.growth * beyond)
    return length

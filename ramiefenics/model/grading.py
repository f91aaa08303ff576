"""Where the mesh is cut along the stalk."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ramiefenics.specification import BendingTest, MeshRecipe


def axial_positions(test: BendingTest) -> NDArray[np.float64]:
    """Return the Z of every cross-section of nodes, mm, ascending, shape (n,).

    Fine under the cylinders, coarser in between, by the recipe; from 0 to the end of the
    specimen on the quarter model, else mirrored to both sides.
    """
    contacts = (0.0, test.fixture.span_mm / 2.0)
    ends = (*contacts, test.stalk.length_mm / 2.0)
    pieces = [
        _graded(start, stop, contacts, test.numerics.mesh)
        for start, stop in itertools.pairwise(ends)
    ]
    z = np.concatenate([pieces[0], pieces[1][1:]])
    return z if test.numerics.domain == "quarter" else np.concatenate([-z[:0:-1], z])


def _graded(
    start: float, stop: float, contacts: Sequence[float], recipe: MeshRecipe
) -> NDArray[np.float64]:
    """Divide an interval so that element lengths follow the recipe's size function."""
    z = np.linspace(start, stop, 2001)
    distance = np.min([np.abs(z - contact) for contact in contacts], axis=0)
    size = recipe.contact_size_mm + recipe.growth * np.maximum(
        distance - recipe.contact_zone_mm, 0.0
    )
    density = 1.0 / np.minimum(size, recipe.coarse_size_mm)
    count = np.concatenate([[0.0], np.cumsum((density[1:] + density[:-1]) / 2.0 * np.diff(z))])
    elements = max(1, int(np.ceil(count[-1] - 1e-9)))
    return np.interp(np.linspace(0.0, count[-1], elements + 1), count, z)

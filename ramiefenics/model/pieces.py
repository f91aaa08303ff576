"""Lagrange cells cut along their nodes into pieces of first order, as VTK requires them."""

from __future__ import annotations

import basix
import numpy as np
from dolfinx import fem
from dolfinx import mesh as dmesh
from numpy.typing import NDArray

AROUND = ((0, 0), (1, 0), (1, 1), (0, 1))
"""Corners of a square in VTK's order."""


def cut_cells(space: fem.FunctionSpace) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Cut the hexahedra of a scalar Lagrange space.

    Returns
    -------
    tuple
        Local nodes of each piece of a cell in VTK's order, shape (order^3, 8), and the centres of
        the pieces in reference coordinates, shape (order^3, 3).
    """
    order, node = _lattice(space)
    first = list(np.ndindex(order, order, order))
    pieces = [[node[a + i, b + j, c + k] for k in (0, 1) for i, j in AROUND] for a, b, c in first]
    return np.array(pieces), (np.array(first) + 0.5) / order


def cut_facets(space: fem.FunctionSpace) -> NDArray[np.int64]:
    """Cut the facets of the hexahedra of a scalar Lagrange space.

    Returns
    -------
    numpy.ndarray
        Local nodes of the cell at the corners of each piece of each of its facets,
        counter-clockwise as seen from outside, shape (6, order^2, 4). From piece to piece, the
        second coordinate of `on_facets` varies fastest.
    """
    order, node = _lattice(space)
    inwards = basix.cell.facet_orientations(basix.CellType.hexahedron)
    cut = []
    for (origin, first, second), clockwise in zip(facet_frames().astype(int), inwards, strict=True):
        around = AROUND[::-1] if clockwise else AROUND
        at = [
            [order * origin + (a + i) * first + (b + j) * second for i, j in around]
            for a, b in np.ndindex(order, order)
        ]
        cut.append([[node[tuple(place.tolist())] for place in piece] for piece in at])
    return np.array(cut)


def on_facets(points: NDArray[np.float64], facets: NDArray[np.int32]) -> NDArray[np.float64]:
    """Return coordinates from 0 to 1 on facets of the reference hexahedron.

    Parameters
    ----------
    points
        Points on each facet in reference coordinates of the cell, shape (m, n, 3).
    facets
        The facets' numbers in the cell, shape (m,).

    Returns
    -------
    numpy.ndarray
        Shape (2, m, n).
    """
    frames = facet_frames()[facets]
    return np.einsum("mqi,mai->amq", points - frames[:, None, 0], frames[:, 1:])


def within_cells(mesh: dmesh.Mesh, facets: NDArray[np.int32]) -> NDArray[np.int32]:
    """Return the cell of each boundary facet of this rank's cells, and the facet's number in it."""
    dim = mesh.topology.dim
    mesh.topology.create_connectivity(dim - 1, dim)
    mesh.topology.create_connectivity(dim, dim - 1)
    cell_of = mesh.topology.connectivity(dim - 1, dim)
    facets_of = mesh.topology.connectivity(dim, dim - 1)
    cells = np.array([cell_of.links(facet)[0] for facet in facets], dtype=np.int32)
    places = [
        int(np.flatnonzero(facets_of.links(cell) == facet)[0])
        for cell, facet in zip(cells, facets, strict=True)
    ]
    pairs = np.column_stack([cells, np.array(places, dtype=np.int32)])
    return pairs[cells < mesh.topology.index_map(dim).size_local]


def facet_frames() -> NDArray[np.float64]:
    """Return origin and two edges of each facet of the reference hexahedron, shape (6, 3, 3)."""
    hexahedron = basix.CellType.hexahedron
    corners = basix.geometry(hexahedron)[np.array(basix.topology(hexahedron)[2])[:, :3]]
    return np.concatenate([corners[:, :1], corners[:, 1:] - corners[:, :1]], axis=1)


def _lattice(space: fem.FunctionSpace) -> tuple[int, dict[tuple[int, ...], int]]:
    """Return the order of a Lagrange space, and its local nodes by their position in the cell."""
    element = space.element.basix_element
    places = np.rint(element.points * element.degree).astype(int)
    return element.degree, {tuple(place): node for node, place in enumerate(places.tolist())}

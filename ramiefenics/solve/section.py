"""Plane section of the stalk, with the curved edges of its elements and a continuous stress."""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ramiefenics.model.pieces import AROUND
from ramiefenics.model.shape import straightened
from ramiefenics.model.snapshot import Grid, Snapshot
from ramiefenics.specification import Stalk

Array = NDArray[np.floating[Any]]

FINE = 9
"""Number of points along an edge of an element's face."""


@dataclass(frozen=True)
class Patch:
    """Face of an element that lies in the plane.

    Attributes
    ----------
    at_mm, now_mm
        X and Y of its points, undeformed and deformed, shape (k, k, 2).
    stress_MPa
        Axial stress at its points, shape (k, k).
    layer
        Number of its layer, 1 for the innermost.
    """

    at_mm: Array
    now_mm: Array
    stress_MPa: Array
    layer: int

    def edges(self, deformed: bool = True) -> list[Array]:
        """Return the four edges of the face, shape (k, 2) each."""
        x = self.now_mm if deformed else self.at_mm
        return [x[0], x[-1], x[:, 0], x[:, -1]]

    def mirrored(self) -> Patch:
        """Return the mirror image of the face on the other side of X = 0."""
        flip = np.array([-1.0, 1.0])
        return Patch(self.at_mm * flip, self.now_mm * flip, self.stress_MPa, self.layer)


def section(snapshot: Snapshot, stalk: Stalk, z_mm: float) -> list[Patch]:
    """Return the faces in the plane Z = z_mm of the elements at larger Z."""
    grid = snapshot.body
    nodes = lattices(grid)
    straight = straightened(stalk, grid.points)[:, 2]
    behind = straight[nodes].mean(axis=(1, 2, 3)) > z_mm
    nodes = nodes[behind]
    stress = at_nodes(grid, "axial_stress_MPa")[behind]
    layers = grid.cell_data["layer"].reshape(len(behind), -1)[behind, 0]
    flat = np.abs(straight[nodes] - z_mm) < 1e-6
    at = grid.points[:, :2]
    now = at + grid.point_data["displacement_mm"][:, :2]
    patches = []
    for axis in (0, 1, 2):
        for side in (0, -1):
            for cell in np.flatnonzero(flat.take(side, axis + 1).all(axis=(1, 2))):
                face = nodes[cell].take(side, axis)
                own = stress[cell].take(side, axis)[..., None]
                x, y, s = (_refined(values) for values in (at[face], now[face], own))
                patches.append(Patch(x, y, s[..., 0], int(layers[cell])))
    return patches


def lattices(grid: Grid) -> NDArray[np.int64]:
    """Return the points of every element by their position in it, shape (c, n, n, n)."""
    order = grid.order
    pieces = grid.cells.reshape(-1, *3 * (order,), 8)
    nodes = np.zeros((len(pieces), *3 * (order + 1,)), dtype=np.int64)
    for a, b, c in np.ndindex(order, order, order):
        for corner, (k, (i, j)) in enumerate((k, ij) for k in (0, 1) for ij in AROUND):
            nodes[:, a + i, b + j, c + k] = pieces[:, a, b, c, corner]
    return nodes


def at_nodes(grid: Grid, name: str) -> Array:
    """Return a field at the points of every element, shape (c, n, n, n).

    Within an element of second order the field is linear between the middles of the pieces. At
    points that several elements of one layer share, it is the mean of their values.
    """
    nodes, order = lattices(grid), grid.order
    values = grid.cell_data[name].reshape(-1, *3 * (order,)).astype(float)
    basis = _lagrange(np.linspace(0.0, 1.0, order + 1), (np.arange(order) + 0.5) / order)
    own = np.einsum("ia,jb,kc,eabc->eijk", basis, basis, basis, values)
    layers = grid.cell_data["layer"].reshape(len(nodes), -1)[:, 0]
    # every rank has its own copies of the points on borders between ranks
    points = np.unique(grid.points.round(9), axis=0, return_inverse=True)[1].ravel()
    keys = points[nodes] * (layers.max() + 1) + layers[:, None, None, None]
    _, index = np.unique(keys, return_inverse=True)
    index = index.reshape(keys.shape)
    total, number = (
        np.bincount(index.ravel(), weights=w.ravel()) for w in (own, np.ones_like(own))
    )
    return np.asarray((total / number)[index])


def _refined(values: Array) -> Array:
    """Return values at many points of a face, by the element's polynomials; shape (k, k, ...)."""
    basis = _lagrange(np.linspace(0.0, 1.0, FINE), np.linspace(0.0, 1.0, len(values)))
    return np.asarray(np.einsum("ia,jb,ab...->ij...", basis, basis, values))


def _lagrange(at: Array, nodes: Array) -> Array:
    """Return the Lagrange polynomials of nodes at given positions, shape (len(at), len(nodes))."""
    basis = np.ones((len(at), len(nodes)))
    for (k, node), (_, zero) in itertools.permutations(enumerate(nodes), 2):
        basis[:, k] *= (at - zero) / (node - zero)
    return basis

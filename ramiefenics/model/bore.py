"""The surface of the void, a few thousand nodes, all of which are known on every rank."""

from __future__ import annotations

import basix
import numpy as np
from dolfinx import fem
from numpy.typing import NDArray
from scipy import sparse
from scipy.spatial import cKDTree

from ramiefenics.model.pieces import facet_frames, within_cells

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

NEWTON_ITERATIONS = 6
"""Number of iterations that find where a line meets a facet; facets are nearly flat."""

FARTHEST = 1.0
"""Distance beyond its edge, in its own coordinates, up to which that search continues a facet."""

HOPS = 3
"""Number of facets by which a point may be away from the first guess."""

SAME = 1e-6
"""Last step, in a facet's own coordinates, below which the iterations have found the point."""

EDGE = 1e-6
"""Distance beyond its edge at which a point still belongs to a facet, to allow for rounding."""


class Bore:
    """Facets of the void's surface; collective.

    Parameters
    ----------
    displacement
        The unknown, which moves the surface.
    facets
        Local facets of the surface.

    Attributes
    ----------
    numbers
        Global numbers of the surface's nodes, ascending, shape (n,).
    own, own_nodes
        Slice of the nodes that are this rank's own, and their local numbers.
    at
        Coefficients of the undeformed position at the nodes, mm, shape (n, 3). With the shape
        functions they give the undeformed position; the displacement's coefficients added to them
        give the current position.
    facets
        Nodes of each facet, numbered from 0 to n - 1, shape (m, k).
    faces
        Face of the reference cell that each facet is, shape (m,).
    outward
        Unit normals into the void at the centres of the undeformed facets, shape (m, 3).
    depth_mm
        Thickness of the cells behind the facets, shape (m,).
    neighbours
        Facets that share a node with each facet, which is one of them, shape (m, most); the last is
        repeated to fill a row.
    """

    def __init__(self, displacement: fem.Function, facets: NDArray[np.int32]) -> None:
        self._u, space = displacement, displacement.function_space
        self._comm, index_map = space.mesh.comm, space.dofmap.index_map
        self._element = element = space.element.basix_element
        self._closures = np.array(element.entity_closure_dofs[2])
        cells, faces = within_cells(space.mesh, facets).T
        nodes_of = space.dofmap.list[cells]
        identity = fem.Function(space)
        identity.interpolate(lambda x: x)
        at = identity.x.array.reshape(-1, 3)
        cell = basix.CellType.hexahedron
        on_corners = element.tabulate(0, basix.geometry(cell))[0, ..., 0]
        corners = np.einsum("ck,fki->fci", on_corners, at[nodes_of])
        of_faces = np.array(basix.topology(cell)[2])[faces]
        # by corners alone, as the centre of a thin cell may be outside it where its facet is an arc
        ahead = np.take_along_axis(corners, of_faces[..., None], axis=1).mean(1) - corners.mean(1)
        nodes = np.take_along_axis(nodes_of, self._closures[faces], axis=1)
        known = np.unique(nodes)
        numbers = index_map.local_to_global(known.astype(np.int32))
        parts = self._comm.allgather(
            (faces, ahead, numbers[np.searchsorted(known, nodes)], numbers, at[known])
        )
        faces, ahead, nodes, numbers, at = map(np.concatenate, zip(*parts, strict=True))
        self.faces = faces
        self.numbers, first = np.unique(numbers, return_index=True)
        self.at = at[first]
        self.facets = np.searchsorted(self.numbers, nodes)
        low, high = np.searchsorted(self.numbers, index_map.local_range)
        self.own = slice(int(low), int(high))
        self.own_nodes = self.numbers[self.own] - index_map.local_range[0]
        self._counts = self._comm.allgather(3 * len(self.own_nodes))
        everything = np.arange(len(self.facets))
        centre = np.full((len(everything), 2), 0.5)
        self._in_middle, _ = self.shapes(everything, centre)
        self._sign = np.ones(len(self.facets))
        normal = self.normal(everything, centre)
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        half = np.einsum("fi,fi->f", ahead, normal)
        self._sign = np.sign(half)
        self.outward = self._sign[:, None] * normal
        self.depth_mm = 2.0 * np.abs(half)
        self.neighbours = _neighbours(self.facets)

    def positions(self) -> Array:
        """Return the coefficients of the current position, mm, shape (n, 3); collective."""
        own = self._u.x.array.reshape(-1, 3)[self.own_nodes]
        if self._comm.size == 1:
            return np.asarray(self.at + own)
        moved = np.empty_like(self.at)
        self._comm.Allgatherv(own, (moved, self._counts))
        return moved + self.at

    def shapes(self, facets: Integers, points: Array) -> tuple[Array, Array]:
        """Return shape functions, shape (p, k), and their slopes along the facets, (p, 2, k).

        Parameters
        ----------
        facets, points
            Facet of each point, shape (p,), and the point in the facet's coordinates, shape (p, 2).
        """
        values = np.empty((len(facets), self.facets.shape[1]))
        slopes = np.empty((len(facets), 2, self.facets.shape[1]))
        for face in np.unique(self.faces[facets]):
            here = self.faces[facets] == face
            origin, *edges = facet_frames()[face]
            table = self._element.tabulate(1, origin + points[here] @ np.array(edges))[..., 0]
            table = table[:, :, self._closures[face]]
            values[here] = table[0]
            slopes[here] = np.einsum("ai,ipk->pak", edges, table[1:])
        return values, slopes

    def place(self, at: Array, facets: Integers, points: Array) -> Array:
        """Return the positions of points of facets, mm, shape (p, 3), from coefficients `at`."""
        values, _ = self.shapes(facets, points)
        return np.einsum("pk,pki->pi", values, at[self.facets[facets]])

    def middles(self, at: Array) -> Array:
        """Return the centres of all facets, mm, shape (m, 3), from coefficients `at`."""
        return np.einsum("mk,mki->mi", self._in_middle, at[self.facets])

    def normal(self, facets: Integers, points: Array, at: Array | None = None) -> Array:
        """Return normals into the void at points of facets, shape (p, 3).

        Their length is the area per area of the reference facet.

        Parameters
        ----------
        facets, points
            As for `shapes`.
        at
            Coefficients of the position; undeformed by default.
        """
        _, slopes = self.shapes(facets, points)
        at = self.at if at is None else at
        along = np.einsum("pak,pki->api", slopes, at[self.facets[facets]])
        return np.asarray(self._sign[facets, None] * np.cross(along[0], along[1]))

    def opposite(self, facets: Integers, others: Integers) -> Integers:
        """Return for each facet which of the others is across the void at the same X and Z.

        The facets are compared by their undeformed centres.
        """
        middles = self.middles(self.at)[:, [0, 2]]
        return np.asarray(others[cKDTree(middles[others]).query(middles[facets])[1]])

    def struck(
        self, at: Array, places: Array, along: Array, guess: Integers
    ) -> tuple[Integers, Array, NDArray[np.bool_]]:
        """Return where lines meet the surface.

        Parameters
        ----------
        at
            Coefficients of the position, mm.
        places, along
            A point of each line, and its unit direction, shape (p, 3).
        guess
            Facet near the point where each line meets the surface.

        Returns
        -------
        tuple
            Facets, points on them in their coordinates, and whether the line meets the facet.
        """
        facets = guess.copy()
        points, beyond = self._met(at, places, along, facets)
        for _ in range(HOPS):
            out = np.flatnonzero(beyond > EDGE)
            if not len(out):
                break
            near = self.neighbours[facets[out]]
            count = near.shape[1]
            found, past = self._met(
                at, np.repeat(places[out], count, 0), np.repeat(along[out], count, 0), near.ravel()
            )
            best = past.reshape(near.shape).argmin(axis=1)
            row = np.arange(len(out))
            facets[out] = near[row, best]
            points[out] = found.reshape(*near.shape, 2)[row, best]
            beyond[out] = past.reshape(near.shape)[row, best]
        return facets, points, beyond <= EDGE

    def _met(self, at: Array, places: Array, along: Array, facets: Integers) -> tuple[Array, Array]:
        """Return where each line meets a facet, continued beyond its edge, and how far beyond."""
        first = np.cross(along, np.eye(3)[np.abs(along).argmin(axis=1)])
        first /= np.linalg.norm(first, axis=1, keepdims=True)
        frame = np.stack([first, np.cross(along, first)], axis=1)  # across the line
        points: Array = np.full((len(facets), 2), 0.5)
        nodes = at[self.facets[facets]]
        for _ in range(NEWTON_ITERATIONS):
            values, slopes = self.shapes(facets, points)
            aside = np.einsum("pk,pki->pi", values, nodes) - places
            misses = np.einsum("pai,pi->pa", frame, aside)
            rates = np.einsum("pai,pbk,pki->pab", frame, slopes, nodes)
            size = np.linalg.det(
                rates
            )  # zero where a line is parallel to the facet, which it never meets
            (a, b), (c, d) = rates.transpose(1, 2, 0)
            adjoint = np.array([[d, -b], [-c, a]]) / np.where(size == 0.0, np.nan, size)
            steps = np.einsum("abp,pb->pa", adjoint, misses)
            points = np.clip(points - steps, -FARTHEST, 1.0 + FARTHEST)
        beyond = np.abs(points - 0.5).max(axis=1) - 0.5
        return points, np.where(np.abs(steps).max(axis=1) < SAME, beyond, np.inf)


def _neighbours(facets: Integers) -> Integers:
    """Return the facets that share a node with each facet, see `Bore`."""
    here = np.repeat(np.arange(len(facets)), facets.shape[1])
    at_nodes = sparse.coo_array((np.ones(here.size), (here, facets.ravel())))
    shared = sparse.csr_array(at_nodes @ at_nodes.T)
    rows = np.split(shared.indices, shared.indptr[1:-1])
    most = int(np.diff(shared.indptr).max(initial=0))
    return np.array(
        [np.pad(row, (0, most - len(row)), mode="edge") for row in rows], dtype=np.int64
    )

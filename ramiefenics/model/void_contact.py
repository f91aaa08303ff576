"""Frictionless contact between the void's walls where the void closes.

Each point x_i of the roof is paired with the point y_i where its normal meets the floor, anew at
every accepted step. Until the next one, a pair keeps its points on both walls and its direction
n_i, from floor to roof. With the areas a_i of the roof at rest, the walls store the energy

    gamma_v / 2 sum a_i [-n_i.(x_i - y_i)]_+^2,    gamma_v = 20 m^2 E_X / t_v

(a penalty method with Gauss points against segments: Fischer and Wriggers 2005). The forces are the
derivative of this energy, so that they are in equilibrium. gamma_v is the same multiple of
stiffness over thickness as in contact with cylinders, with the order m of the elements, the
innermost layer's E_X, and the thickness t_v of the bore's cells. Nitsche's method would need the
stress beside the gap; here the walls penetrate each other under the pressure p by ``p / gamma_v``,
a share p / (20 E_X) of a cell for cells of first order.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import basix
import numpy as np
from dolfinx import fem
from numpy.typing import NDArray
from scipy import sparse

from ramiefenics.model.bore import Array, Bore, Integers
from ramiefenics.model.matrix import Matrix

QUADRATURE_DEGREE = {1: 3, 2: 5}
"""Quadrature degree on a facet of the roof, by element order."""

FLAT = 0.3
"""Least absolute component along Y of the void's normal at rest on its roof and floor."""

AHEAD, NEAR = 3.0, 0.02
"""Distances at which walls are paired: over the last approach, and over the void's diameter.

Walls are paired as soon as the centres of opposite facets are closer than either `AHEAD` times
their approach in the last step, or `NEAR` times the void's diameter.
"""

REACH = 0.2
"""Distance of points over the void's diameter below which they are then paired."""

MOVED = 1e-3
"""Motion of the walls over the void's diameter below which they are not paired anew."""


@dataclass(frozen=True)
class Pairs:
    """Points of the roof, each with the point of the floor below.

    Attributes
    ----------
    gaps
        Sparse matrix that maps the nodes' positions to the gaps ``n_i.(x_i - y_i)``, mm, shape
        (p, 3 n).
    stiffness
        Products of gamma_v and a_i above, N/mm, shape (p,).
    upwards
        Components of n_i along Y, shape (p,).
    """

    gaps: sparse.csr_array
    stiffness: Array
    upwards: Array

    def pressed(self, at: Array) -> Array:
        """Return the overlap of each pair, mm, shape (p,)."""
        return np.maximum(-(self.gaps @ at.ravel()), 0.0)


class VoidContact:
    """Contact between the void's walls as a term of the equations; collective.

    Parameters
    ----------
    displacement
        The unknown.
    facets
        Local facets of the void's surface.
    diameter_mm
        Diameter of the void.
    stiffness_MPa
        The product 20 m^2 E_X above; gamma_v is this over the cells' thickness t_v.

    Attributes
    ----------
    couplings
        Pairs of a node of the roof and a node of the floor that have been near each other, global
        numbers, shape (n, 2). The derivative may have entries between these.
    """

    def __init__(
        self,
        displacement: fem.Function,
        facets: NDArray[np.int32],
        diameter_mm: float,
        stiffness_MPa: float,
    ) -> None:
        self._bore = bore = Bore(displacement, facets)
        self._comm = displacement.function_space.mesh.comm
        order = displacement.function_space.element.basix_element.degree
        self._points, self._weights = basix.make_quadrature(
            basix.CellType.quadrilateral, QUADRATURE_DEGREE[min(order, 2)]
        )
        self._roof = np.flatnonzero(bore.outward[:, 1] < -FLAT)
        floor = np.flatnonzero(bore.outward[:, 1] > FLAT)
        self._below = bore.opposite(self._roof, floor)
        self._diameter_mm = diameter_mm
        self._gamma = stiffness_MPa / bore.depth_mm
        self.couplings: Integers = np.zeros((0, 2), dtype=np.int64)
        self._pairs: Pairs | None = None
        self._last = bore.at

    def refresh(self) -> bool:
        """Pair the walls anew if they have moved; return whether this couples further nodes."""
        at, bore, diameter = self._bore.positions(), self._bore, self._diameter_mm
        if np.abs(at - self._last).max() < MOVED * diameter:
            return False
        before, apart = (self._apart(nodes) for nodes in (self._last, at))
        self._last = at
        meets = apart < np.maximum(NEAR * diameter, AHEAD * (before - apart))
        if self._pairs is None and not meets.any():
            return False
        roof = np.repeat(self._roof, len(self._points))
        points = np.tile(self._points, (len(self._roof), 1))
        down = bore.normal(roof, points, at)
        down /= np.linalg.norm(down, axis=1, keepdims=True)
        places = bore.place(at, roof, points)
        guess = np.repeat(self._below, len(self._points))
        floor, below, met = bore.struck(at, places, down, guess)
        gap = np.einsum("pi,pi->p", bore.place(at, floor, below) - places, down)
        faces_roof = np.einsum("pi,pi->p", bore.normal(floor, below, at), down) < 0.0
        met &= faces_roof & (np.abs(gap) < REACH * diameter)
        area = np.tile(self._weights, len(self._roof))
        area = area * np.linalg.norm(bore.normal(roof, points), axis=1)
        self._pairs = Pairs(
            self._gaps(roof[met], points[met], floor[met], below[met], -down[met]),
            (self._gamma[roof] * area)[met],
            -down[met, 1],
        )
        return self._couple(roof[met], floor[met])

    def _apart(self, at: Array) -> Array:
        """Return the distance between the centres of each roof facet and its opposite, mm."""
        middles = self._bore.middles(at)
        return np.asarray(np.linalg.norm(middles[self._roof] - middles[self._below], axis=1))

    def _gaps(
        self, roof: Integers, points: Array, floor: Integers, below: Array, up: Array
    ) -> sparse.csr_array:
        bore = self._bore
        shares = np.hstack([bore.shapes(roof, points)[0], -bore.shapes(floor, below)[0]])
        nodes = np.hstack([bore.facets[roof], bore.facets[floor]])
        values = shares[:, :, None] * up[:, None, :]
        columns = 3 * nodes[:, :, None] + np.arange(3)
        rows = np.broadcast_to(np.arange(len(roof))[:, None, None], values.shape)
        entries = values.ravel(), (rows.ravel(), columns.ravel())
        return sparse.csr_array(sparse.coo_array(entries, shape=(len(roof), bore.at.size)))

    def _couple(self, roof: Integers, floor: Integers) -> bool:
        bore, number = self._bore, len(self._bore.at)
        around = bore.neighbours[floor]  # a pair may move to these without another matrix
        pairs = np.column_stack([np.repeat(roof, around.shape[1]), around.ravel()])
        pairs = np.unique(pairs, axis=0)
        tops, bottoms = bore.facets[pairs[:, 0]], bore.facets[pairs[:, 1]]
        keys = np.unique(tops[:, :, None] * number + bottoms[:, None, :])
        nodes = bore.numbers[np.column_stack([keys // number, keys % number])]
        together = np.unique(np.vstack([self.couplings, nodes]), axis=0)
        more = len(together) > len(self.couplings)
        self.couplings = together
        return more

    def force_y_N(self) -> float:
        """Return the force along Y between the walls of the modelled part, N; on every rank."""
        if self._pairs is None:
            return 0.0
        overlap = self._pairs.pressed(self._bore.positions())
        return float((self._pairs.stiffness * self._pairs.upwards) @ overlap)

    def energy(self) -> float:
        """Return the energy stored between the walls, N mm, on the first rank, and 0 on others."""
        if self._pairs is None:
            return 0.0
        stored = 0.5 * self._pairs.stiffness @ self._pairs.pressed(self._bore.positions()) ** 2
        return float(stored) if self._comm.rank == 0 else 0.0

    def add_forces(self, forces: Array) -> None:  # noqa: D102
        if self._pairs is None:
            return
        pressure = self._pairs.stiffness * self._pairs.pressed(self._bore.positions())
        on_nodes = -(self._pairs.gaps.T @ pressure).reshape(-1, 3)
        forces.reshape(-1, 3)[self._bore.own_nodes] += on_nodes[self._bore.own]

    def add_stiffness(self, matrix: Matrix, bcs: Sequence[fem.DirichletBC]) -> None:  # noqa: D102
        if self._pairs is None:
            return
        touching = self._pairs.pressed(self._bore.positions()) > 0.0
        gaps = self._pairs.gaps[touching] * self._free(bcs)
        added = sparse.csr_array(gaps.T @ (gaps * self._pairs.stiffness[touching, None]))
        own = np.arange(3 * self._bore.own.start, 3 * self._bore.own.stop)
        components = (3 * self._bore.numbers[:, None] + np.arange(3)).ravel()
        matrix.add_rows(components[own], components, added[own])

    def _free(self, bcs: Sequence[fem.DirichletBC]) -> Array:
        """Return 0 for constrained and 1 for free components of all nodes, shape (1, 3 n)."""
        bore = self._bore
        held = np.zeros(0, dtype=np.int64)
        for bc in bcs:
            held = np.union1d(held, bc.dof_indices()[0])
        mine = ~np.isin(3 * bore.own_nodes[:, None] + np.arange(3), held)
        return np.concatenate(self._comm.allgather(mine.astype(float))).reshape(1, -1)


def void_contact(
    displacement: fem.Function,
    facets: NDArray[np.int32],
    diameter_mm: float,
    stiffness_MPa: float,
) -> VoidContact | None:
    """Return the contact between a void's walls; None on all ranks if there is no void."""
    number = displacement.function_space.mesh.comm.allreduce(len(facets))
    return VoidContact(displacement, facets, diameter_mm, stiffness_MPa) if number else None

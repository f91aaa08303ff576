"""Full fields of one converged step, gathered on the first rank."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
import ufl
from dolfinx import fem
from numpy.typing import NDArray

from ramiefenics.model.bending import BendingProblem
from ramiefenics.model.jit import compile_expression
from ramiefenics.model.observables import Observer


@dataclass(frozen=True)
class Snapshot:
    """A displaced mesh with its fields, as VTK wants it.

    A cell of second order appears as eight of first order, which share its nodes.

    Attributes
    ----------
    travel_mm
        Travel of the indenter.
    points
        Undeformed nodes, mm, shape (n, 3).
    cells
        Corners of every hexahedron in VTK's order, shape (m, 8).
    point_data
        ``displacement`` (mm, shape (n, 3)), ``contact_pressure`` (MPa), ``contact_state``
        (0 none, 1 stick, 2 slip).
    cell_data
        ``layer`` (1 for the innermost); at the middles of the hexahedra ``von_mises`` and
        ``axial_stress`` (Cauchy, MPa; the latter along the deformed fibres) and
        ``axial_stretch``; ``min_volume_ratio``, ``min_principal_stretch`` and
        ``min_acoustic_MPa``, the lowest of the cell's quadrature points, see `PointState`.
    """

    travel_mm: float
    points: NDArray[np.float64]
    cells: NDArray[np.int64]
    point_data: dict[str, NDArray[Any]] = field(default_factory=dict)
    cell_data: dict[str, NDArray[Any]] = field(default_factory=dict)


class Camera:
    """Takes snapshots of a problem; collective.

    Parameters
    ----------
    problem
        What to look at.
    observer
        What has been observed of it at the same step.
    """

    MIDDLE_FIELDS = ("von_mises", "axial_stress", "axial_stretch")

    def __init__(self, problem: BendingProblem, observer: Observer) -> None:
        self._problem, self._observer = problem, observer
        solid = problem.solid
        self._scalar = fem.functionspace(solid.mesh, ("Lagrange", solid.order))
        self._moved = fem.Function(fem.functionspace(solid.mesh, ("Lagrange", solid.order, (3,))))
        self._vertex = fem.Function(fem.functionspace(solid.mesh, ("Lagrange", 1)))
        self._nodal = fem.Function(self._scalar)
        cells = solid.mesh.topology.index_map(solid.mesh.topology.dim)
        self._cells = np.arange(cells.size_local, dtype=np.int32)
        self._corners, self._middles = _subdivide(solid.order, self._scalar)
        self._layer = np.zeros(cells.size_local + cells.num_ghosts, dtype=np.int32)
        self._layer[problem.tube.cells.indices] = problem.tube.cells.values
        self._expression = self._cell_expression()

    def _cell_expression(self) -> fem.Expression:
        solid = self._problem.solid
        F = solid.gradient(solid.displacement)
        sigma = solid.cauchy()
        deviator = ufl.dev(sigma)
        along = F[:, 2]
        stretch = ufl.sqrt(ufl.dot(along, along))
        fields = ufl.as_vector(
            (
                ufl.sqrt(1.5 * ufl.inner(deviator, deviator)),
                ufl.dot(along, sigma * along) / stretch**2,
                stretch,
            )
        )
        return compile_expression(fields, self._middles)

    def take(self, travel_mm: float) -> Snapshot | None:
        """Return the snapshot on rank 0, None elsewhere."""
        solid = self._problem.solid
        comm = solid.mesh.comm
        self._moved.interpolate(solid.displacement)
        nodes = self._scalar.dofmap.list[: len(self._cells)]
        values = self._expression.eval(solid.mesh, self._cells)
        values = values.reshape(-1, len(self.MIDDLE_FIELDS))
        pressure, state = self._observer.surface.evaluate()
        pieces, material = len(self._corners), self._observer.material
        cell_data = {
            "layer": np.repeat(self._layer[self._cells], pieces),
            **dict(zip(self.MIDDLE_FIELDS, values.T, strict=True)),
            "min_volume_ratio": np.repeat(material.volume_ratio.min(axis=1), pieces),
            "min_principal_stretch": np.repeat(material.principal_stretch.min(axis=1), pieces),
            "min_acoustic_MPa": np.repeat(material.acoustic_MPa.min(axis=1), pieces),
        }
        local = {
            "points": self._scalar.tabulate_dof_coordinates(),
            "cells": nodes[:, self._corners].reshape(-1, 8).astype(np.int64),
            "displacement": self._moved.x.array.reshape(-1, 3).copy(),
            "contact_pressure": self._to_nodes(pressure),
            "contact_state": np.rint(self._to_nodes(state.astype(float))).astype(np.int8),
            **cell_data,
        }
        parts = comm.gather(local, root=0)
        if parts is None:
            return None
        offsets = np.cumsum([0, *(len(part["points"]) for part in parts[:-1])])
        for part, offset in zip(parts, offsets, strict=True):
            part["cells"] = part["cells"] + offset
        whole = {name: np.concatenate([part[name] for part in parts]) for name in local}
        return Snapshot(
            travel_mm,
            whole["points"],
            whole["cells"],
            {n: whole[n] for n in ("displacement", "contact_pressure", "contact_state")},
            {n: whole[n] for n in cell_data},
        )

    def _to_nodes(self, at_vertices: NDArray[np.float64]) -> NDArray[np.float64]:
        self._vertex.x.array[:] = at_vertices
        self._nodal.interpolate(self._vertex)
        return self._nodal.x.array.copy()


def _subdivide(
    order: int, scalar: fem.FunctionSpace
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Cut a Lagrange cell along its nodes.

    Returns
    -------
    tuple
        Local nodes of each piece in VTK's order, shape (order^3, 8), and the pieces' middles in
        reference coordinates, shape (order^3, 3).
    """
    lattice = np.rint(scalar.element.basix_element.points * order).astype(int)
    node = {tuple(place): number for number, place in enumerate(lattice.tolist())}
    around = ((0, 0), (1, 0), (1, 1), (0, 1))
    first = list(np.ndindex(order, order, order))
    pieces = [[node[a + i, b + j, c + k] for k in (0, 1) for i, j in around] for a, b, c in first]
    return np.array(pieces), (np.array(first) + 0.5) / order

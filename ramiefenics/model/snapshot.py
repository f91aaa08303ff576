"""Full fields of one converged step, gathered on the first rank."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import ufl
from dolfinx import fem
from numpy.typing import NDArray

from ramiefenics.model.bending import BendingProblem
from ramiefenics.model.jit import compile_expression
from ramiefenics.model.observables import Observer
from ramiefenics.model.pieces import cut_cells, within_cells
from ramiefenics.model.surface import ContactSurface


@dataclass(frozen=True)
class Grid:
    """Cells of first order with data, as VTK requires them.

    Attributes
    ----------
    points
        Undeformed nodes, mm, shape (n, 3).
    cells
        Corners of every cell in VTK's order, shape (m, 8) for hexahedra and (m, 4) for
        quadrilaterals.
    point_data
        Arrays by name, of length n.
    cell_data
        Arrays by name, of length m.
    order
        Order of the elements. An element is cut into this many cells along every edge, which follow
        one another in the order of `numpy.ndindex`.
    """

    points: NDArray[np.float64]
    cells: NDArray[np.int64]
    point_data: dict[str, NDArray[Any]]
    cell_data: dict[str, NDArray[Any]]
    order: int = 1


@dataclass(frozen=True)
class Snapshot:
    """The displaced stalk with its fields, and the contact on its surface.

    A cell of second order appears as eight cells of first order, which share its nodes, and its
    facet as four. Both grids have ``displacement_mm``, shape (n, 3), at their points.

    Attributes
    ----------
    travel_mm
        Travel of the indenter.
    time_s
        Time since the first touch.
    body
        Hexahedra with the following data. ``layer`` is 1 for the innermost. At the cells' centres
        there are the Cauchy stress ``stress_MPa`` and the Green-Lagrange strain ``green_strain``,
        both of shape (m, 6) in the order XX, YY, ZZ, XY, YZ, XZ; ``principal_stretch_1`` to
        ``principal_stretch_3``, ascending; ``von_mises_MPa``, ``axial_stress_MPa`` (along the
        deformed fibres) and ``axial_stretch``; and, unless the law is elastic, its internal
        variables, the components of a tensor row by row, and ``dissipated_Nmm_per_mm3``.
        ``min_volume_ratio``, ``min_principal_stretch`` and ``min_acoustic_MPa`` are the lowest
        values at the element's quadrature points: of the ratio J of a volume to that at rest, of
        the principal stretches, and of the acoustic tensor's eigenvalues.
    contact
        Facets of the part of the outer surface that a cylinder may touch, with the data that
        `ContactSurface.evaluate` returns. ``cylinder`` is the index in `Fixture.cylinders` of the
        cylinder that may touch the facet; no other one can.
    """

    travel_mm: float
    time_s: float
    body: Grid
    contact: Grid


class Camera:
    """Takes snapshots of a problem; collective.

    Parameters
    ----------
    problem
        Problem to take snapshots of.
    observer
        Its observer, which must have observed the same step.
    """

    MIDDLE_FIELDS = ("von_mises_MPa", "axial_stress_MPa", "axial_stretch")
    COMPONENTS = ((0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2))

    def __init__(self, problem: BendingProblem, observer: Observer) -> None:
        self._problem, self._observer = problem, observer
        solid = problem.solid
        self._scalar = fem.functionspace(solid.mesh, ("Lagrange", solid.order))
        self._moved = fem.Function(fem.functionspace(solid.mesh, ("Lagrange", solid.order, (3,))))
        self._surface = ContactSurface(problem.contact, self._scalar)
        self._cylinder = self._cylinders()
        cells = solid.mesh.topology.index_map(solid.mesh.topology.dim)
        self._cells = solid.own_cells
        pieces, self._middles = cut_cells(self._scalar)
        nodes = self._scalar.dofmap.list[self._cells]
        self._corners = nodes[:, pieces].reshape(-1, 8).astype(np.int64)
        self._layer = np.zeros(cells.size_local + cells.num_ghosts, dtype=np.int32)
        self._layer[problem.tube.cells.indices] = problem.tube.cells.values
        self._expression = self._cell_expression()

    def _cylinders(self) -> NDArray[np.int8]:
        """Return ``cylinder`` of every facet, in the order of `ContactSurface`.

        A cell is within reach of one cylinder only.
        """
        solid, obstacles = self._problem.solid, self._problem.contact.obstacles
        cylinders = self._problem.test.fixture.cylinders
        topology = solid.mesh.topology  # whose cells may include those of a bond between layers
        of_cell = np.zeros(topology.index_map(topology.dim).size_local, dtype=np.int8)
        for obstacle in obstacles:
            cells = within_cells(solid.mesh, obstacle.facets)[:, 0]
            of_cell[cells] = cylinders.index(obstacle.cylinder)
        facets = np.unique(np.concatenate([obstacle.facets for obstacle in obstacles]))
        cells = within_cells(solid.mesh, facets)[:, 0]
        return np.repeat(of_cell[cells], solid.order**2)

    def _cell_expression(self) -> fem.Expression:
        solid = self._problem.solid
        F = solid.gradient(solid.displacement)
        sigma = solid.cauchy()
        deviator = ufl.dev(sigma)
        along = solid.fibres(F)
        stretch = ufl.sqrt(ufl.dot(along, along))
        fields = ufl.as_vector(
            (
                ufl.sqrt(1.5 * ufl.inner(deviator, deviator)),
                ufl.dot(along, sigma * along) / stretch**2,
                stretch,
                *(sigma[i, j] for i, j in self.COMPONENTS),
                *((F.T * F)[i, j] for i, j in self.COMPONENTS),
            )
        )
        return compile_expression(fields, self._middles)

    def take(self, travel_mm: float, time_s: float) -> Snapshot | None:
        """Return the snapshot on rank 0, None elsewhere."""
        solid = self._problem.solid
        self._moved.interpolate(solid.displacement)
        values = self._expression.eval(solid.mesh, self._cells)
        values = values.reshape(-1, len(self.MIDDLE_FIELDS) + 2 * len(self.COMPONENTS))
        scalars, stress, stretched = np.split(values, [3, 9], axis=1)
        pieces, material = len(self._middles), self._observer.material
        fields = {
            "layer": np.repeat(self._layer[self._cells], pieces),
            **dict(zip(self.MIDDLE_FIELDS, scalars.T, strict=True)),
            "stress_MPa": stress,
            "green_strain": 0.5 * (stretched - [1.0, 1.0, 1.0, 0.0, 0.0, 0.0]),
            **self._principal_stretches(stretched),
            "min_volume_ratio": np.repeat(material.volume_ratio.min(axis=1), pieces),
            "min_principal_stretch": np.repeat(material.principal_stretch.min(axis=1), pieces),
            "min_acoustic_MPa": np.repeat(material.acoustic_MPa.min(axis=1), pieces),
        }
        remembered = solid.internal_variables(self._middles, self._cells)
        for name, value in remembered.items():
            components = value.reshape(len(self._cells) * pieces, -1)
            fields[name] = components[:, 0] if components.shape[1] == 1 else components
        body = self._gather(self._corners, fields)
        contact = self._gather(
            self._surface.corners, {**self._surface.evaluate(), "cylinder": self._cylinder}
        )
        if body is None or contact is None:
            return None
        return Snapshot(travel_mm, time_s, body, contact)

    def _principal_stretches(self, components: NDArray[np.float64]) -> dict[str, NDArray[Any]]:
        """Return the square roots of the eigenvalues of F^T F, ascending, as three scalars.

        ParaView would take an array of three columns for a vector, and mirror its first one.
        """
        C = np.empty((len(components), 3, 3))
        for column, (i, j) in zip(components.T, self.COMPONENTS, strict=True):
            C[:, i, j] = C[:, j, i] = column
        stretches = np.sqrt(np.linalg.eigvalsh(C))
        return {f"principal_stretch_{n}": one for n, one in enumerate(stretches.T, start=1)}

    def _gather(self, corners: NDArray[np.int64], fields: dict[str, NDArray[Any]]) -> Grid | None:
        """Join the cells of all ranks; points on the border between two ranks appear twice."""
        used, cells = np.unique(corners, return_inverse=True)
        local = {
            "points": self._scalar.tabulate_dof_coordinates()[used],
            "cells": cells.reshape(corners.shape),
            "displacement_mm": self._moved.x.array.reshape(-1, 3)[used],
            **fields,
        }
        parts = self._problem.solid.mesh.comm.gather(local, root=0)
        if parts is None:
            return None
        offsets = np.cumsum([0, *(len(part["points"]) for part in parts[:-1])])
        for part, offset in zip(parts, offsets, strict=True):
            part["cells"] = part["cells"] + offset
        whole = {name: np.concatenate([part[name] for part in parts]) for name in local}
        return Grid(
            whole["points"],
            whole["cells"],
            {"displacement_mm": whole["displacement_mm"]},
            {name: whole[name] for name in fields},
            self._problem.solid.order,
        )

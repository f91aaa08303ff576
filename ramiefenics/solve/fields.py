"""Snapshots as VTK grids, for ParaView and for the package's own pictures."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pyvista as pv

from ramiefenics.model.snapshot import Grid
from ramiefenics.specification import BendingTest

if TYPE_CHECKING:
    from ramiefenics.solve.result import BendingResult

STATE = Path(__file__).with_name("paraview_state.txt")
"""Template of a script for ParaView, in which the planes of symmetry are to be filled in."""

NORMALS = {"quarter": ((1, 0, 0), (0, 0, 1)), "half": ((1, 0, 0),), "full": ()}
"""Normals of the planes of symmetry through the origin, by domain."""


def to_grid(grid: Grid) -> pv.UnstructuredGrid:
    """Return an undeformed VTK grid with all fields; ``displacement_mm`` deforms it."""
    count, corners = grid.cells.shape
    cells = np.column_stack([np.full(count, corners), grid.cells]).ravel()
    kind = {4: pv.CellType.QUAD, 8: pv.CellType.HEXAHEDRON}[corners]
    made = pv.UnstructuredGrid(cells, np.full(count, kind, dtype=np.uint8), grid.points)
    made.point_data.update(grid.point_data)
    made.cell_data.update(grid.cell_data)
    return made


def write_fields(result: BendingResult, folder: Path) -> None:
    """Write ParaView collections of one file per snapshot, and a state that opens all of them.

    ``bend.pvd`` is the stalk, ``contact.pvd`` the facets that a cylinder may touch, and
    ``fixture.pvd`` the cylinders. Each file has the values of the curve at its time as field data.
    In ParaView, *File, Load State* opens ``paraview_state.py``.
    """
    folder.mkdir(parents=True, exist_ok=True)
    curve, snapshots = result.curve, result.snapshots
    numbers = [
        {name: float(np.interp(s.time_s, curve["time_s"], curve[name])) for name in curve.columns}
        for s in snapshots
    ]
    data = {
        "bend": [to_grid(snapshot.body) for snapshot in snapshots],
        "contact": [to_grid(snapshot.contact) for snapshot in snapshots],
        "fixture": [pv.merge(cylinders(result.test, s.travel_mm)) for s in snapshots],
    }
    times_s = [snapshot.time_s for snapshot in snapshots]
    for name, grids in data.items():
        _write_collection(name, times_s, grids, numbers, folder)
    normals = NORMALS[result.test.numerics.domain]
    text = STATE.read_text(encoding="utf-8").replace("NORMALS", repr(list(normals)))
    (folder / "paraview_state.py").write_text(text, encoding="utf-8")


def _write_collection(
    name: str,
    times_s: Sequence[float],
    grids: Sequence[pv.DataSet],
    numbers: Sequence[Mapping[str, float]],
    folder: Path,
) -> None:
    entries = []
    for number, (time_s, grid, own) in enumerate(zip(times_s, grids, numbers, strict=True)):
        file = f"{name}_{number:03d}{'.vtp' if isinstance(grid, pv.PolyData) else '.vtu'}"
        for column, value in own.items():
            grid.field_data[column] = [value]
        grid.save(folder / file)
        entries.append(f'    <DataSet timestep="{time_s:g}" file="{file}"/>')
    lines = [
        '<?xml version="1.0"?>',
        '<VTKFile type="Collection" version="0.1" byte_order="LittleEndian">',
        "  <Collection>",
        *entries,
        "  </Collection>",
        "</VTKFile>",
    ]
    (folder / f"{name}.pvd").write_text("\n".join(lines) + "\n", encoding="utf-8")


def cylinders(test: BendingTest, travel_mm: float) -> list[pv.PolyData]:
    """Return the fixture's cylinders at a given travel; plates are a tenth as thick as wide."""
    solids = []
    width, length = 1.75 * test.stalk.outer_diameter_mm, test.stalk.length_mm
    for cylinder in test.fixture.cylinders:
        front = test.front_mm(cylinder) - (travel_mm if cylinder.moves else 0.0)
        if cylinder.flat:
            back = front + cylinder.up * width / 10.0
            sides = (*sorted((front, back)), -0.55 * length, 0.55 * length)
            solids.append(pv.Box((-width / 2.0, width / 2.0, *sides)))
            continue
        solids.append(
            pv.Cylinder(
                center=(0.0, front + cylinder.up * cylinder.radius_mm, cylinder.z_mm),
                direction=(1, 0, 0),
                radius=cylinder.radius_mm,
                height=width,
                resolution=96,
            )
        )
    return solids

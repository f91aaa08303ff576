"""Snapshots as VTK grids: for ParaView, and for our own pictures."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pyvista as pv

from ramiefenics.model.snapshot import Grid, Snapshot


def to_grid(grid: Grid) -> pv.UnstructuredGrid:
    """Return an undeformed grid with all its fields; warp it by ``displacement``."""
    count, corners = grid.cells.shape
    cells = np.column_stack([np.full(count, corners), grid.cells]).ravel()
    kind = {4: pv.CellType.QUAD, 8: pv.CellType.HEXAHEDRON}[corners]
    made = pv.UnstructuredGrid(cells, np.full(count, kind, dtype=np.uint8), grid.points)
    made.point_data.update(grid.point_data)
    made.cell_data.update(grid.cell_data)
    return made


def write_fields(snapshots: Sequence[Snapshot], folder: Path) -> None:
    """Write ``bend.pvd``, the stalk, and ``contact.pvd``, the facets that a cylinder may touch.

    Both are ParaView collections of one file per snapshot.
    """
    folder.mkdir(parents=True, exist_ok=True)
    times_s = [snapshot.time_s for snapshot in snapshots]
    _write_collection("bend", times_s, [snapshot.body for snapshot in snapshots], folder)
    _write_collection("contact", times_s, [snapshot.contact for snapshot in snapshots], folder)


def _write_collection(
    name: str, times_s: Sequence[float], grids: Sequence[Grid], folder: Path
) -> None:
    entries = []
    for number, (time_s, grid) in enumerate(zip(times_s, grids, strict=True)):
        file = f"{name}_{number:03d}.vtu"
        to_grid(grid).save(folder / file)
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

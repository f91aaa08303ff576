"""Snapshots as VTK grids: for ParaView, and for our own pictures."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pyvista as pv

from ramiefenics.model.snapshot import Snapshot


def to_grid(snapshot: Snapshot) -> pv.UnstructuredGrid:
    """Return the undeformed mesh with all fields; warp it by ``displacement``."""
    count, nodes = snapshot.cells.shape
    cells = np.column_stack([np.full(count, nodes), snapshot.cells]).ravel()
    types = np.full(count, pv.CellType.HEXAHEDRON, dtype=np.uint8)
    grid = pv.UnstructuredGrid(cells, types, snapshot.points)
    grid.point_data.update(snapshot.point_data)
    grid.cell_data.update(snapshot.cell_data)
    return grid


def write_fields(snapshots: Sequence[Snapshot], folder: Path) -> None:
    """Write a ParaView collection, travel in place of time, and one file per snapshot."""
    folder.mkdir(parents=True, exist_ok=True)
    entries = []
    for number, snapshot in enumerate(snapshots):
        name = f"bend_{number:03d}.vtu"
        to_grid(snapshot).save(folder / name)
        entries.append(f'    <DataSet timestep="{snapshot.travel_mm:g}" file="{name}"/>')
    lines = [
        '<?xml version="1.0"?>',
        '<VTKFile type="Collection" version="0.1" byte_order="LittleEndian">',
        "  <Collection>",
        *entries,
        "  </Collection>",
        "</VTKFile>",
    ]
    (folder / "bend.pvd").write_text("\n".join(lines) + "\n", encoding="utf-8")

"""Pictures of the deformed stalk between its cylinders, rendered with PyVista."""

from __future__ import annotations

import importlib.util

import matplotlib as mpl
import numpy as np
import pyvista as pv
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from numpy.typing import NDArray

from ramiefenics.model.snapshot import Grid, Snapshot
from ramiefenics.notebook import in_notebook
from ramiefenics.results.style import GREY, STYLE
from ramiefenics.solve.fields import NORMALS, cylinders
from ramiefenics.solve.figures import STRESS_COLOURS
from ramiefenics.solve.result import BendingResult
from ramiefenics.solve.section import at_nodes, lattices
from ramiefenics.specification import SpecificationError
from ramiefenics.specification.errors import warn

STEEL = "#9aa5b1"

PIXELS = (1600, 640)

TOWARDS = (1.0, 0.3, 0.45)
"""Direction from the stalk to the camera."""

HALF_WIDTH = 0.48
"""Half of the width of a scene, relative to the length by which it is scaled."""

STRESS = "axial_stress_MPa"

STILL = (
    "this scene is a still picture, as the package pyvista[jupyter] is not installed, which is a "
    "part of ramiefenics[notebook]"
)
"""Warning in a notebook."""

PLACES = {
    1: ("000 100 110 010 001 101 111 011", pv.CellType.HEXAHEDRON),
    2: (
        "000 200 220 020 002 202 222 022 100 210 120 010 102 212 122 012 001 201 221 021 "
        "011 211 101 121 110 112 111",
        pv.CellType.TRIQUADRATIC_HEXAHEDRON,
    ),
}
"""Positions of an element's points in VTK's numbering, and the VTK cell type, by element order."""


def check_snapshots(result: BendingResult) -> None:
    """Check that a result has a snapshot to draw."""
    if not result.snapshots:
        allowed = (
            "must be at least 1; of several ranks, only the first has them, and a result that was "
            "read from a folder has none: simulate its test again, or open fields/bend.pvd of the "
            "folder in ParaView"
        )
        raise SpecificationError("snapshots", len(result.snapshots), allowed)


def largest_stress(result: BendingResult, number: int = -1) -> float:
    """Return the axial stress magnitude, MPa, that 0.5 % of a snapshot's surface points exceed."""
    body = _whole(result.snapshots[number], result.test.numerics.domain)
    return float(np.percentile(np.abs(body.point_data[STRESS]), 99.5))


def deformed_figure(
    result: BendingResult, number: int = -1, limit_MPa: float | None = None
) -> Figure:
    """Draw the axial stress of a snapshot on the deformed stalk between its cylinders.

    Parameters
    ----------
    result
        Simulation with snapshots.
    number
        Index of the snapshot; the last one by default.
    limit_MPa
        Stress at the end of the colour scale; by default `largest_stress`.
    """
    snapshot, curve = result.snapshots[number], result.curve
    limit = largest_stress(result, number) if limit_MPa is None else limit_MPa
    force = np.interp(snapshot.time_s, curve["time_s"], curve["force_N"])
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(8.0, 4.2), layout="constrained")
        axes = figure.subplots()
        axes.set_axis_off()
        axes.imshow(_render(result, snapshot, limit))
        _draw_directions(axes, _reach(result))
        title = f"{snapshot.travel_mm:.1f} mm of travel, force {force:.1f} N"
        axes.set_title(title, loc="left", fontsize=10)
        figure.colorbar(
            ScalarMappable(Normalize(-limit, limit), STRESS_COLOURS),
            ax=axes,
            label="Axial stress (MPa)",
            orientation="horizontal",
            shrink=0.5,
            aspect=30,
            pad=0.02,
        )
    return figure


def view(result: BendingResult, number: int = -1) -> pv.Plotter:
    """Return a snapshot, the last one by default, as an interactive scene to ``.show()``.

    In a notebook the package pyvista[jupyter], a part of ramiefenics[notebook], makes it
    interactive; without it, it is a still picture.

    Raises
    ------
    SpecificationError
        If no state was saved.
    """
    check_snapshots(result)
    if in_notebook() and importlib.util.find_spec("trame") is None:
        warn(STILL, UserWarning)
    plotter = pv.Plotter()
    stalk = _fill(plotter, result, result.snapshots[number], largest_stress(result, number))
    plotter.add_scalar_bar(
        "Axial stress (MPa)",
        mapper=stalk.mapper,
        color="black",
        n_labels=5,
        fmt="%.3g",
        title_font_size=18,
        label_font_size=16,
        width=0.5,
        height=0.1,
        position_x=0.25,
        position_y=0.03,
    )
    return plotter


def _draw_directions(axes: Axes, reach_mm: float) -> None:
    """Draw X, Y and Z in the corner of a rendered picture, each to the scale of the picture."""
    towards, up = np.array(TOWARDS) / np.linalg.norm(TOWARDS), np.array([0.0, 1.0, 0.0])
    right = np.cross(up, towards) / np.linalg.norm(np.cross(up, towards))
    length_mm = next(size for size in (50, 20, 10, 5, 2, 1) if size <= reach_mm / 12.0 or size == 1)
    pixels = length_mm * PIXELS[0] / (2.0 * HALF_WIDTH * reach_mm)
    start = np.array([0.13 * PIXELS[0], 0.85 * PIXELS[1]])
    for name, direction in zip("XYZ", np.eye(3), strict=True):
        step = pixels * np.array([direction @ right, -direction @ np.cross(towards, right)])
        axes.plot(*np.transpose([start, start + step]), color=GREY, lw=1.2)
        place = start + step + 22.0 * step / np.linalg.norm(step)
        axes.text(place[0], place[1], name, ha="center", va="center", fontsize=8, color=GREY)
    x, y = start + np.array([-15.0, 50.0])
    axes.text(x, y, f"{length_mm} mm each", ha="right", fontsize=8, color=GREY)


def _render(result: BendingResult, snapshot: Snapshot, limit_MPa: float) -> NDArray[np.uint8]:
    plotter = pv.Plotter(off_screen=True, window_size=list(PIXELS))
    _fill(plotter, result, snapshot, limit_MPa)
    plotter.enable_anti_aliasing("ssaa")
    pixels = np.asarray(plotter.screenshot(return_img=True), dtype=np.uint8)
    plotter.close()
    return pixels


def _fill(
    plotter: pv.Plotter, result: BendingResult, snapshot: Snapshot, limit_MPa: float
) -> pv.Actor:
    """Add stalk, cylinders and a camera to a scene, and return the stalk."""
    plotter.set_background("white")
    made = plotter.add_mesh(
        _whole(snapshot, result.test.numerics.domain),
        scalars=STRESS,
        cmap=STRESS_COLOURS,
        clim=(-limit_MPa, limit_MPa),
        ambient=0.7,  # with little shading, colours are those of the scale
        diffuse=0.3,
        smooth_shading=True,
        split_sharp_edges=True,
        show_scalar_bar=False,
    )
    for cylinder in cylinders(result.test, snapshot.travel_mm):
        plotter.add_mesh(cylinder, color=STEEL, smooth_shading=True, split_sharp_edges=True)
    reach, (width, height) = _reach(result), plotter.window_size
    plotter.camera_position = [tuple(reach * part for part in TOWARDS), (0, 0, 0), (0, 1, 0)]
    plotter.enable_parallel_projection()
    plotter.camera.parallel_scale = HALF_WIDTH * reach * height / width
    return made


def _reach(result: BendingResult) -> float:
    """Return the length, mm, by which the scene is scaled."""
    stalk = result.test.stalk
    return max(stalk.length_mm, 5.0 * max(stalk.outer_diameter_mm, stalk.height_mm))


def _whole(snapshot: Snapshot, domain: str) -> pv.PolyData:
    """Return the deformed surface of the whole stalk: the modelled part, mirrored at its cuts."""
    surface = _elements(snapshot.body).extract_surface(
        algorithm="dataset_surface", nonlinear_subdivision=2
    )
    normals = NORMALS[domain]
    middle = surface.cell_centers().points
    cut = np.any([np.abs(middle @ normal) < 1e-6 for normal in normals], axis=0)
    if normals:
        surface = surface.extract_cells(~cut).extract_surface(algorithm="dataset_surface")
    body = surface.warp_by_vector("displacement_mm")
    for normal in normals:
        body = body.append_polydata(body.reflect(normal, point=(0, 0, 0)))
    return body.clean()


def _elements(grid: Grid) -> pv.UnstructuredGrid:
    """Return whole elements with displacement and stress.

    On the border between two layers the stress is that of the outer one.
    """
    text, kind = PLACES[grid.order]
    places = tuple(np.array([[int(digit) for digit in one] for one in text.split()]).T)
    nodes = lattices(grid)[(slice(None), *places)]
    values = at_nodes(grid, STRESS)[(slice(None), *places)]
    layers = grid.cell_data["layer"].reshape(len(nodes), -1)[:, 0]
    stress = np.zeros(len(grid.points))
    for layer in np.unique(layers):
        stress[nodes[layers == layer]] = values[layers == layer]
    cells = np.column_stack([np.full(len(nodes), nodes.shape[1]), nodes]).ravel()
    made = pv.UnstructuredGrid(cells, np.full(len(nodes), kind, dtype=np.uint8), grid.points)
    made.point_data["displacement_mm"] = grid.point_data["displacement_mm"]
    made.point_data[STRESS] = stress
    return made

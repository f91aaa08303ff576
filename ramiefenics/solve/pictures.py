"""The deformed stalk between its cylinders, rendered off-screen with PyVista."""

from __future__ import annotations

import numpy as np
import pyvista as pv
from numpy.typing import NDArray

from ramiefenics.model.snapshot import Snapshot
from ramiefenics.solve.fields import NORMALS, cylinders, to_grid
from ramiefenics.solve.figures import STRESS_COLOURS
from ramiefenics.solve.result import BendingResult

STEEL = "#9aa5b1"


def largest_stress(result: BendingResult, number: int = -1) -> float:
    """Return the axial stress, MPa, that half a per cent of a snapshot's surface passes."""
    body = _whole(result.snapshots[number], result.test.numerics.domain)
    return float(np.percentile(np.abs(body.cell_data["axial_stress_MPa"]), 99.5))


def deformed_picture(
    result: BendingResult, number: int = -1, limit_MPa: float | None = None
) -> NDArray[np.uint8]:
    """Render a snapshot, the last one by default: axial stress on the tube between its cylinders.

    Parameters
    ----------
    result
        With snapshots.
    number
        Of the snapshot.
    limit_MPa
        Where colours end; by default `largest_stress`.

    Returns
    -------
    numpy.ndarray
        RGB pixels, shape (900, 1600, 3).
    """
    snapshot = result.snapshots[number]
    body = _whole(snapshot, result.test.numerics.domain)
    limit = largest_stress(result, number) if limit_MPa is None else limit_MPa
    plotter = pv.Plotter(off_screen=True, window_size=[1600, 900])
    plotter.set_background("white")
    plotter.add_mesh(
        body,
        scalars="axial_stress_MPa",
        cmap=STRESS_COLOURS,
        clim=(-limit, limit),
        ambient=0.25,
        diffuse=0.7,
        scalar_bar_args={
            "title": "Axial stress (MPa)",
            "color": "black",
            "fmt": "%.3g",
            "n_labels": 5,
            "width": 0.4,
            "position_x": 0.3,
            "position_y": 0.04,
            "title_font_size": 26,
            "label_font_size": 22,
        },
    )
    for cylinder in cylinders(result.test, snapshot.travel_mm):
        plotter.add_mesh(cylinder, color=STEEL, smooth_shading=True, split_sharp_edges=True)
    plotter.add_text(
        f"{snapshot.travel_mm:.1f} mm, {_force_at(result, snapshot.time_s):.1f} N",
        position="upper_left",
        font_size=14,
        color="black",
    )
    stalk = result.test.stalk
    view = max(stalk.length_mm, 5.0 * max(stalk.outer_diameter_mm, stalk.height_mm))
    plotter.camera_position = [(view, 0.3 * view, 0.45 * view), (0, 0, 0), (0, 1, 0)]
    plotter.enable_parallel_projection()
    plotter.camera.parallel_scale = 0.27 * view
    plotter.enable_anti_aliasing("ssaa")
    pixels = np.asarray(plotter.screenshot(return_img=True), dtype=np.uint8)
    plotter.close()
    return pixels


def _force_at(result: BendingResult, time_s: float) -> float:
    curve = result.curve
    return float(np.interp(time_s, curve["time_s"], curve["force_N"]))


def _whole(snapshot: Snapshot, domain: str) -> pv.PolyData:
    """Mirror the modelled part to the whole stalk, without the faces where it was cut."""
    surface = to_grid(snapshot.body).extract_surface(algorithm="dataset_surface")
    normals = NORMALS[domain]
    middle = surface.cell_centers().points
    cut = np.any([np.abs(middle @ normal) < 1e-6 for normal in normals], axis=0)
    if normals:
        surface = surface.extract_cells(~cut).extract_surface(algorithm="dataset_surface")
    body = surface.warp_by_vector("displacement_mm")
    for normal in normals:
        body = body.append_polydata(body.reflect(normal, point=(0, 0, 0)))
    return body.clean()

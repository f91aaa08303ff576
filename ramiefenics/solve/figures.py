"""The force-displacement curve and the section under the indenter, drawn with Matplotlib."""

from __future__ import annotations

from collections.abc import Mapping

import matplotlib as mpl
import numpy as np
import pandas as pd
import pyvista as pv
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure
from numpy.typing import NDArray

from ramiefenics.model.shape import straightened
from ramiefenics.model.snapshot import Snapshot
from ramiefenics.results.style import BLUE, GREY, STYLE, VERMILION
from ramiefenics.solve.fields import to_grid
from ramiefenics.solve.result import BendingResult
from ramiefenics.specification import Stalk

LOSS_LINES = {
    "volume": ("material inside out", "-"),
    "stretch": ("compression limit passed", "--"),
    "ellipticity": ("ellipticity lost", ":"),
}

STRESS_COLOURS = "RdBu_r"


def curve_figure(
    result: BendingResult, measured: Mapping[str, pd.DataFrame] | None = None
) -> Figure:
    """Draw force against travel, with the maximum marked where there is one.

    Parameters
    ----------
    result
        The simulation.
    measured
        Tables with ``displacement_mm`` and ``force_N``, by name, to draw behind it.
    """
    curve = result.curve
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(5.5, 4.0), layout="constrained")
        axes = figure.subplots()
        for number, table in enumerate((measured or {}).values()):
            label = "_" if number else "measured"  # once
            axes.plot(table["displacement_mm"], table["force_N"], color=GREY, lw=0.8, label=label)
        axes.plot(curve["displacement_mm"], curve["force_N"], "o-", color=BLUE, ms=3.5, lw=1.5)
        if result.has_force_maximum:
            at, force = result.displacement_at_max_mm, result.max_force_N
            axes.plot(at, force, "o", ms=9, mfc="none", mec=VERMILION, mew=1.5)
            axes.hlines(force, *result.peak.plateau_mm, color=VERMILION, lw=1.0)
            first, last = result.peak.plateau_mm
            axes.annotate(
                f"maximum {force:.1f} N at {at:.1f} mm,\n"
                f"within 1 % from {first:.1f} to {last:.1f} mm",
                (at, force),
                xytext=(0.97, 0.08),
                textcoords="axes fraction",
                ha="right",
                color=VERMILION,
            )
        _mark_losses(axes, result)
        _mark_jumps(axes, result)
        if not result.completed:
            reason = result.ending.reason
            axes.set_title(reason, fontsize=8, color=VERMILION, loc="left", wrap=True)
        axes.set_xlabel("Indenter displacement (mm)")
        axes.set_ylabel("Force (N)")
        axes.set_xlim(left=0.0)
        axes.set_ylim(bottom=0.0)
    return figure


def _mark_losses(axes: Axes, result: BendingResult) -> None:
    """Draw where the model stops being one."""
    for name, travel in result.losses_mm.items():
        label, line = LOSS_LINES[name]
        axes.axvline(travel, color=GREY, lw=1.0, ls=line, label=f"{label} ({travel:.2f} mm)")
    if axes.get_legend_handles_labels()[1]:
        axes.legend(loc="lower right", bbox_to_anchor=(1.0, 0.17), fontsize=8, frameon=False)


def _mark_jumps(axes: Axes, result: BendingResult) -> None:
    """Draw each jump as an arrow with the energy that it releases."""
    for jump in result.jumps:
        at = jump.displacement_mm
        axes.annotate(
            "",
            (at, jump.force_after_N),
            xytext=(at, jump.force_before_N),
            arrowprops={"arrowstyle": "->", "color": VERMILION, "lw": 1.5},
        )
        axes.annotate(
            f"jump, {jump.energy_released_Nmm:.3g} N mm",
            (at, jump.force_before_N),
            xytext=(4, 4),
            textcoords="offset points",
            fontsize=8,
            color=VERMILION,
        )


def section_figure(result: BendingResult, number: int = -1) -> Figure:
    """Draw the section under the indenter, in the last snapshot if no other, and undeformed."""
    test, snapshot = result.test, result.snapshots[number]
    indenter = test.fixture.indenter
    mirror = test.numerics.domain != "full"
    faces, moved, stress = _section_faces(snapshot, test.stalk, indenter.z_mm, mirror)
    limit = float(np.abs(stress).max())
    top = test.front_mm(indenter)
    radius = max(float(np.abs(polygon[:, 0]).max()) for polygon in faces)
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(5.5, 5.0), layout="constrained")
        axes = figure.subplots()
        axes.set_axisbelow(True)
        axes.add_collection(
            PolyCollection(faces, facecolors="none", edgecolors=GREY, linewidths=0.4, alpha=0.7)
        )
        deformed = PolyCollection(moved, array=stress, cmap=STRESS_COLOURS, lw=0.3, ec="k")
        deformed.set_clim(-limit, limit)
        axes.add_collection(deformed)
        level = top - snapshot.travel_mm
        axes.axhline(level, color=VERMILION, lw=1.5)
        axes.annotate(
            "indenter",
            (1.45 * radius, level),
            xytext=(0, 3),
            textcoords="offset points",
            color=VERMILION,
            ha="right",
        )
        lowest = min(polygon[:, 1].min() for polygon in moved)
        axes.set(
            aspect="equal",
            xlim=(-1.5 * radius, 1.5 * radius),
            ylim=(lowest - 0.1 * top, 1.1 * top),
            xlabel="X (mm)",
            ylabel="Y (mm)",
        )
        at_midspan = test.fixture.beam_mm is not None and indenter.z_mm == 0.0
        where = "Midspan" if at_midspan else f"Z = {indenter.z_mm:g} mm"
        axes.set_title(f"{where} at {snapshot.travel_mm:.1f} mm of travel", fontsize=10)
        figure.colorbar(deformed, ax=axes, label="Axial stress (MPa)", shrink=0.8)
    return figure


def _section_faces(
    snapshot: Snapshot, stalk: Stalk, z_mm: float, mirror: bool
) -> tuple[list[NDArray[np.float64]], list[NDArray[np.float64]], NDArray[np.float64]]:
    """Return the polygons of a plane, undeformed and deformed, and axial stress beyond it."""
    grid = to_grid(snapshot.body)
    beyond = grid.extract_cells(straightened(stalk, grid.cell_centers().points)[:, 2] > z_mm)
    surface: pv.PolyData = beyond.extract_surface(algorithm="dataset_surface")
    flat = np.abs(straightened(stalk, surface.points)[:, 2] - z_mm) < 1e-6
    at = np.asarray(surface.points[:, :2])
    now = at + surface.point_data["displacement_mm"][:, :2]
    stress = surface.cell_data["axial_stress_MPa"]
    faces, moved, values = [], [], []
    for index, face in enumerate(surface.regular_faces):
        if not flat[face].all():
            continue
        for sign in (1.0, -1.0) if mirror else (1.0,):
            faces.append(at[face] * (sign, 1.0))
            moved.append(now[face] * (sign, 1.0))
            values.append(stress[index])
    return faces, moved, np.array(values)

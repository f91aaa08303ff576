"""Figures of the force-displacement curve and of the section under the indenter."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import matplotlib as mpl
import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from ramiefenics.results.style import BLUE, GREY, STYLE, VERMILION
from ramiefenics.solve.result import BendingResult
from ramiefenics.solve.section import Array, Patch, section

LOSS_LINES = {
    "volume": ("material inside out", "-"),
    "stretch": ("compression limit passed", "--"),
    "ellipticity": ("ellipticity lost", ":"),
}

STRESS_COLOURS = "RdBu_r"


def curve_figure(
    result: BendingResult, measured: Mapping[str, pd.DataFrame] | None = None
) -> Figure:
    """Draw force against travel, with the maximum marked if there is one.

    Parameters
    ----------
    result
        The simulation.
    measured
        Measured curves by name, with ``displacement_mm`` and ``force_N``, to draw behind it.
    """
    curve = result.curve
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(5.5, 4.0), layout="constrained")
        axes = figure.subplots()
        for number, table in enumerate((measured or {}).values()):
            label = "_" if number else "measured"  # one label for all
            axes.plot(table["displacement_mm"], table["force_N"], color=GREY, lw=0.8, label=label)
        x, force_N = curve["displacement_mm"], curve["force_N"]
        label = "simulated" if measured else "_"
        axes.plot(x, force_N, "o-", color=BLUE, ms=3.5, lw=1.5, label=label)
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


def curves_figure(result: BendingResult) -> Figure:
    """Draw force against travel in all tests of a stalk."""
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(5.5, 4.0), layout="constrained")
        axes = figure.subplots()
        for number, one in {1: result, **result.later}.items():
            curve = one.curve
            axes.plot(curve["displacement_mm"], curve["force_N"], lw=1.5, label=f"test {number}")
        axes.set(xlabel="Indenter displacement (mm)", ylabel="Force (N)", xlim=(0, None))
        axes.set_ylim(bottom=0.0)
        axes.legend()
    return figure


def _mark_losses(axes: Axes, result: BendingResult) -> None:
    """Mark where the material loses a property without which the model is not valid."""
    for name, travel in result.losses_mm.items():
        label, line = LOSS_LINES[name]
        axes.axvline(travel, color=GREY, lw=1.0, ls=line, label=f"{label} ({travel:.2f} mm)")
    if axes.get_legend_handles_labels()[1]:
        axes.legend(loc="lower right", bbox_to_anchor=(1.0, 0.17), fontsize=8)


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
    """Draw the section under the indenter in a snapshot, the last by default, and undeformed."""
    test, snapshot = result.test, result.snapshots[number]
    indenter = test.fixture.indenter
    patches = section(snapshot, test.stalk, indenter.z_mm)
    if test.numerics.domain != "full":
        patches += [patch.mirrored() for patch in patches]
    top = test.front_mm(indenter)
    level = top - snapshot.travel_mm
    radius = max(float(np.abs(patch.at_mm[..., 0]).max()) for patch in patches)
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(5.5, 5.0), layout="compressed")  # for axes of equal scales
        axes = figure.subplots()
        axes.set_axisbelow(True)
        _draw_stress(axes, patches)
        axes.axhline(level, color=VERMILION, lw=1.5)
        axes.annotate(
            "indenter",
            (1.45 * radius, level),
            xytext=(0, 3),
            textcoords="offset points",
            color=VERMILION,
            ha="right",
        )
        lowest = min(float(patch.now_mm[..., 1].min()) for patch in patches)
        names = [layer.name for layer in test.stalk.layers]
        _name_layers(axes, patches, names, (0.7 * radius, lowest - 0.3 * top))
        axes.set(
            aspect="equal",
            xlim=(-1.5 * radius, 1.5 * radius),
            ylim=(lowest - 0.5 * top, 1.2 * top),
            xlabel="X (mm)",
            ylabel="Y (mm)",
        )
        axes.xaxis.set_major_locator(MaxNLocator(7, steps=[1, 2, 5, 10]))
        at_midspan = test.fixture.beam_mm is not None and indenter.z_mm == 0.0
        where = "Midspan" if at_midspan else f"Z = {indenter.z_mm:g} mm"
        force = np.interp(snapshot.time_s, result.curve["time_s"], result.curve["force_N"])
        axes.set_title(
            f"{where} at {snapshot.travel_mm:.1f} mm of travel, force {force:.1f} N", fontsize=10
        )
    return figure


def _name_layers(
    axes: Axes, patches: Sequence[Patch], names: Sequence[str], at_mm: tuple[float, float]
) -> None:
    """Write the names of layers in a row below the deformed section, and name the undeformed one.

    The row is centred on X = 0; `at_mm` is half its width, and its Y.
    """
    for number, (name, x) in enumerate(zip(names, _spread(len(names), at_mm[0]), strict=True), 1):
        centres = np.array([p.now_mm.mean(axis=(0, 1)) for p in patches if p.layer == number])
        low = centres[centres[:, 1] <= np.median(centres[:, 1])]
        axes.annotate(
            name,
            low[np.abs(low[:, 0] - x).argmin()],
            xytext=(x, at_mm[1]),
            fontsize=8,
            ha="center",
            va="center",
            arrowprops={"arrowstyle": "-", "lw": 0.7, "shrinkB": 0},
        )
    top = max(float(patch.at_mm[..., 1].max()) for patch in patches)
    axes.annotate(
        "undeformed",
        (0.0, top),
        xytext=(0, 3),
        textcoords="offset points",
        fontsize=8,
        color=GREY,
        ha="center",
    )


def _spread(number: int, half_mm: float) -> Array:
    """Return evenly spaced positions from `-half_mm` to `half_mm`; the middle if there is one."""
    return np.linspace(-half_mm, half_mm, number) if number > 1 else np.zeros(1)


def _draw_stress(axes: Axes, patches: Sequence[Patch]) -> None:
    """Draw axial stress and edges, thin ones of elements and thick ones of layers.

    Undeformed edges are drawn as well.
    """
    limit = max(float(np.abs(patch.stress_MPa).max()) for patch in patches)
    for patch in patches:
        x, y = np.moveaxis(patch.now_mm, -1, 0)
        colours = axes.pcolormesh(
            x,
            y,
            patch.stress_MPa,
            cmap=STRESS_COLOURS,
            vmin=-limit,
            vmax=limit,
            shading="gouraud",
            rasterized=True,  # vector formats lack this shading
        )
    for deformed, colour in ((False, GREY), (True, "black")):
        inner, outlines = _edges(patches, deformed)
        axes.add_collection(LineCollection(inner, colors=colour, linewidths=0.25, alpha=0.6))
        axes.add_collection(LineCollection(outlines, colors=colour, linewidths=1.0))
    figure = axes.get_figure()
    assert figure is not None
    figure.colorbar(colours, ax=axes, label="Axial stress (MPa)", shrink=0.8)


def _edges(patches: Sequence[Patch], deformed: bool) -> tuple[list[Array], list[Array]]:
    """Return the edges between elements of one layer, and those on the borders of layers."""
    by_place: dict[tuple[object, ...], list[tuple[int, Array]]] = {}
    for patch in patches:
        for place, edge in zip(patch.edges(deformed=False), patch.edges(deformed), strict=True):
            ends = sorted(tuple(end.round(6).tolist()) for end in (place[0], place[-1]))
            by_place.setdefault(tuple(ends), []).append((patch.layer, edge))
    inner: list[Array] = []
    outlines: list[Array] = []
    for shared in by_place.values():
        one_layer = len(shared) == 2 and shared[0][0] == shared[1][0]
        (inner if one_layer else outlines).append(shared[0][1])
    return inner, outlines

"""Figures of a mesh-convergence study: the curves of all meshes, and error against cost."""

from __future__ import annotations

import matplotlib as mpl
from matplotlib.axis import Axis
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from ramiefenics.convergence.outcome import Convergence, label_of
from ramiefenics.results.style import GREEN, ORANGE, PURPLE, SKY, STYLE, VERMILION

MARKS = (("k", "o"), (ORANGE, "s"), (SKY, "^"), (GREEN, "D"), (PURPLE, "v"))
"""Colour and marker of each quantity."""

SHADES = mpl.colormaps["viridis_r"]
"""Colour map of the meshes, from light (coarse) to dark (fine)."""


def curves_figure(study: Convergence) -> Figure:
    """Draw force against travel for all meshes; a cross marks a run that ended early."""
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(5.5, 4.0), layout="constrained")
        axes = figure.subplots()
        last = len(study.runs) - 1
        for index, run in enumerate(study.runs):
            row, curve = study.meshes.iloc[index], run.result.curve
            colour = SHADES(0.12 + 0.88 * index / last)
            at, force = curve["displacement_mm"], curve["force_N"]
            label = f"{row['mesh']}, {row['unknowns']:,} unknowns"
            axes.plot(at, force, "-", color=colour, lw=1.0 + index / last, label=label)
            if not run.result.completed:
                axes.plot(at.iloc[-1], force.iloc[-1], "X", ms=8, color=VERMILION)
        if not study.completed:
            axes.plot([], [], "X", ms=8, color=VERMILION, label="not completed")
        axes.set(xlabel="Indenter displacement (mm)", ylabel="Force (N)")
        axes.set_xlim(left=0.0)
        axes.set_ylim(bottom=0.0)
        axes.legend(loc="lower right", fontsize=8, frameon=False)
    return figure


def error_figure(study: Convergence) -> Figure:
    """Draw the error of each quantity against unknowns and against processor time."""
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(8.0, 4.4), layout="constrained")
        panels = figure.subplots(1, 2, sharey=True)
        titles = {"unknowns": "Degrees of freedom", "cpu_s": "Processor time (s)"}
        for axes, (column, title) in zip(panels, titles.items(), strict=True):
            for quantity, (colour, marker) in zip(study.quantities, MARKS, strict=True):
                errors = 100.0 * study.errors(quantity)
                shown = errors > 0.0
                against = "limit" if study.quantities[quantity].limit is not None else "finest mesh"
                axes.loglog(
                    study.meshes[column][shown],
                    errors[shown],
                    marker=marker,
                    color=colour,
                    ls="-" if against == "limit" else "--",
                    ms=5,
                    lw=1.3,
                    label=f"{label_of(quantity)}, against the {against}",
                )
            axes.set_xlabel(title)
            _tick(axes.xaxis)
        panels[0].set_ylabel("Error (%)")
        _tick(panels[0].yaxis)
        handles, labels = panels[0].get_legend_handles_labels()
        figure.legend(
            handles,
            labels,
            loc="outside lower center",
            ncols=2,
            fontsize=8,
            frameon=False,
            handlelength=3.5,
        )
        order = {1: "first", 2: "second"}[study.order]
        caption = f"{len(study.runs)} meshes of {order} order"
        panels[0].set_title(caption, fontsize=9, loc="left")
    return figure


def _tick(axis: Axis) -> None:
    """Put plain numbers on a logarithmic axis that may span less than a decade."""
    axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:,.10g}"))
    axis.set_minor_formatter(NullFormatter())

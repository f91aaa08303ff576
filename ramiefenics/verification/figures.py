"""Plots of verification studies."""

from __future__ import annotations

import itertools

import matplotlib as mpl
from matplotlib.figure import Figure

from ramiefenics.results.style import BLUE, GREEN, ORANGE, PURPLE, SKY, STYLE, VERMILION
from ramiefenics.verification.study import Plot

COLOURS = (BLUE, VERMILION, GREEN, PURPLE, ORANGE, SKY)
MARKERS = "osD^vx"


def plot_figure(plot: Plot) -> Figure:
    """Draw a plot."""
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(5.5, 3.8), layout="constrained")
        axes = figure.subplots()
        styles = zip(itertools.cycle(COLOURS), itertools.cycle(MARKERS), strict=False)
        for series, (colour, marker) in zip(plot.series, styles, strict=False):
            (line,) = axes.plot(series.x, series.y, color=colour, ms=4.5, label=series.label)
            line.set_marker(marker if series.points or plot.log else "")
            line.set_linestyle("none" if series.points else "-")
        if plot.log:
            axes.set_xscale("log")
            axes.set_yscale("log")
        axes.set_xlabel(plot.x_label)
        axes.set_ylabel(plot.y_label)
        if len(plot.series) > 1:
            axes.legend(frameon=False)
    return figure

"""Plots of verification studies."""

from __future__ import annotations

import itertools

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter, StrMethodFormatter

from ramiefenics.results.style import BLUE, GREEN, GREY, ORANGE, PURPLE, SKY, STYLE, VERMILION
from ramiefenics.verification.study import Plot, Series

COLOURS = (BLUE, VERMILION, GREEN, PURPLE, ORANGE, SKY)
MARKERS = "osD^vx"
LINES = ("-", "--", ":", "-.")
"""Kinds of lines, so that none hides another."""


def plot_figure(plot: Plot) -> Figure:
    """Draw a plot."""
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(5.5, 3.8), layout="constrained")
        axes = figure.subplots()
        styles = zip(*map(itertools.cycle, (COLOURS, MARKERS, LINES)), strict=False)
        for series, (colour, marker, dash) in zip(plot.series, styles, strict=False):
            (line,) = axes.plot(series.x, series.y, color=colour, ms=4.5, label=series.label)
            line.set_marker(marker if series.points or plot.log else "")
            line.set_linestyle("none" if series.points else "-" if plot.log else dash)
        for series in plot.series:  # afterwards, so that slopes come last in the legend
            _draw_slope(axes, series)
        if plot.log:
            axes.set_xscale("log")
            axes.set_yscale("log")
            for axis in (axes.xaxis, axes.yaxis):
                _set_ticks(axis)
        axes.set_xlabel(_capital(plot.x_label))
        axes.set_ylabel(_capital(plot.y_label))
        axes.set_title(plot.note, fontsize=8, loc="left")
        if len(axes.get_legend_handles_labels()[1]) > 1:
            axes.legend(fontsize=8)
    return figure


def _draw_slope(axes: Axes, series: Series) -> None:
    """Draw a line of the slope that theory gives, through the last point of a series."""
    if series.slope is None:
        return
    x, y = np.asarray(series.x, dtype=float), np.asarray(series.y, dtype=float)
    label = f"slope {series.slope:g}"
    known = label in axes.get_legend_handles_labels()[1]
    dash = LINES[int(abs(series.slope)) % len(LINES)]
    line = y[-1] * (x / x[-1]) ** series.slope
    axes.plot(x, line, dash, color=GREY, lw=1.0, zorder=1, label="_" if known else label)


def _set_ticks(axis: Axis) -> None:
    """Set ticks at 1, 2 and 5 times powers of ten if there are less than two decades."""
    low, high = axis.get_view_interval()
    if high < 100.0 * low:
        axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        axis.set_major_formatter(StrMethodFormatter("{x:g}"))
    axis.set_minor_formatter(NullFormatter())


def _capital(label: str) -> str:
    return f"{label[:1].upper()}{label[1:]}"

"""Figures of a sweep: all curves, and the maximum force against the varied values."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import Literal

import matplotlib as mpl
import numpy as np
import pandas as pd
from matplotlib.artist import Artist
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from ramiefenics.results.style import BLUE, GREY, STYLE, VERMILION
from ramiefenics.results.text import label_of
from ramiefenics.sweep.outcome import Sweep

SHADES = mpl.colormaps["viridis_r"]
"""Colour map from the first value (light) to the last (dark)."""

DASHES = ("-", "--", ":", "-.")

MOST_NAMED = 10
"""Largest number of entries in a legend."""


def curves_figure(found: Sweep) -> Figure:
    """Draw all curves; colours show the first varied key, dashes the second."""
    first, *others = found.keys
    values, colours = found.runs[first], _colours(found.runs[first])
    dashes = {}
    if others:
        dashes = dict(zip(found.runs[others[0]].unique(), itertools.cycle(DASHES), strict=False))
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(7.0, 4.0), layout="constrained")
        axes = figure.subplots()
        for number, run in enumerate(found.done):
            if run is None:
                continue
            at, force = run.result.curve["displacement_mm"], run.result.curve["force_N"]
            dash = dashes[found.runs[others[0]][number]] if others else "-"
            axes.plot(at, force, ls=dash, color=colours[values[number]], lw=1.2)
            if not run.result.completed:
                axes.plot(at.iloc[-1], force.iloc[-1], "X", ms=7, color=VERMILION)
        axes.set(xlabel="Indenter displacement (mm)", ylabel="Force (N)")
        axes.set_xlim(left=0.0)
        axes.set_ylim(bottom=0.0)
        lines = [Line2D([], [], color=colour) for colour in colours.values()]
        parts = [(_label(found, first), lines, [_text(value) for value in colours])]
        if others:
            lines = [Line2D([], [], color=GREY, ls=dash) for dash in dashes.values()]
            parts.append((_label(found, others[0]), lines, [_text(value) for value in dashes]))
        _legend(figure, *parts)
    return figure


def force_figure(found: Sweep) -> Figure:
    """Draw the maximum force against the first varied key, one line per value of the second."""
    first, *others = found.keys
    numbers = pd.api.types.is_numeric_dtype(found.runs[first])
    groups = found.runs.groupby(others[0], sort=False) if others else [(None, found.runs)]
    colours: dict[object, str] = _colours(found.runs[others[0]]) if others else {None: BLUE}
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(7.0, 4.0), layout="constrained")
        axes = figure.subplots()
        for value, group in groups:
            at = group[first] if numbers else group[first].astype(str)
            axes.plot(at, group["max_force_N"], "o-" if numbers else "o", color=colours[value])
        if others:
            lines = [Line2D([], [], color=colour, marker="o") for colour in colours.values()]
            title = _label(found, others[0])
            _legend(figure, (title, lines, [_text(value) for value in colours]))
        axes.set(xlabel=_label(found, first), ylabel="Maximum force (N)")
    return figure


def _label(found: Sweep, key: str) -> str:
    """Return a label of a key, with its place if another has the same last part, or an effect."""
    if key in found.effects:
        unit = found.effects[key]
        return label_of(key) + ("" if unit == "1" else f" ({unit})")
    place = found.names[key].rpartition(".")[0]
    return f"{label_of(key)}, {place}" if place else label_of(key)


def _colours(values: pd.Series) -> dict[object, str]:
    distinct = list(values.unique())
    last = max(len(distinct) - 1, 1)
    return {value: to_hex(SHADES(0.15 + 0.85 * n / last)) for n, value in enumerate(distinct)}


def _legend(figure: Figure, *parts: tuple[str, Sequence[Artist], Sequence[str]]) -> None:
    """Put a legend beside the axes, of one or two parts with their titles above."""
    entries: list[tuple[Artist, str]] = []
    for title, handles, labels in parts:
        last, number = len(labels) - 1, min(len(labels), MOST_NAMED)
        chosen = [round(k) for k in np.linspace(0, last, number)]  # includes the first and the last
        entries.append((Line2D([], [], ls="none"), title))
        entries += [(handles[k], labels[k]) for k in chosen]
    where: Literal["outside right upper"] = "outside right upper"
    figure.legend(*zip(*entries, strict=True), loc=where, fontsize=8)


def _text(value: object) -> str:
    return f"{value:.4g}" if isinstance(value, float) else str(value)

"""Figures of the curves in a discovery: residuals, and predictions of left-out specimens."""

from __future__ import annotations

import itertools
import textwrap
from collections.abc import Iterator

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ramiefenics.discovery.anatomy import Anatomy
from ramiefenics.discovery.curves.blocks import Array
from ramiefenics.discovery.report.outcome import Discovery
from ramiefenics.discovery.report.wording import listed
from ramiefenics.effects import EFFECTS
from ramiefenics.model.laws import law_named
from ramiefenics.results.style import (
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    PURPLE,
    SKY,
    STYLE,
    VERMILION,
)
from ramiefenics.specification import SpecificationError

MOST_CURVES = 12
"""Maximum number of curves drawn one by one."""

TITLE_WIDTH = 45
"""Maximum number of characters of a line above a panel."""


def residual_figure(found: Discovery) -> Figure:
    """Draw the residuals of the baseline, and those of the extended model if there is one."""
    models = [("baseline", found.baseline.fit)]
    if found.extended is not None and found.extended.fit.chosen:
        models.append((f"with {listed(found.extended.fit.chosen)}", found.extended.fit))
    conditions = np.array(found.dataset.condition_labels)
    labels = list(dict.fromkeys(found.dataset.condition_labels))
    with mpl.rc_context(STYLE):
        size = (4.2 * len(models) + 0.3, 0.8 + 2.8 * len(labels))
        figure = Figure(figsize=size, layout="constrained")
        grid = figure.subplots(len(labels), len(models), sharex=True, sharey=True, squeeze=False)
        for column, (title, fit) in zip(grid.T, models, strict=True):
            whole = ~np.isin(found.observed.blocks.specimen, list(fit.evidence.broken))
            left, simulator = (100.0 * part for part in fit.remaining())
            for axes, label in zip(column, labels, strict=True):
                rows = whole & (conditions == label)
                if rows.any():
                    _residuals(axes, found.observed.at_mm[rows], left[rows], simulator[rows])
                axes.set_ylabel(label)
                axes.label_outer()
            column[0].set_title(textwrap.fill(title, TITLE_WIDTH), fontsize=10)
        figure.supxlabel("Displacement (mm)", fontsize=10)
        figure.supylabel("Measured minus fitted (% of peak force)", fontsize=10)
        grid[0, 0].legend(fontsize=8, frameon=False)
    return figure


def _residuals(axes: Axes, at_mm: Array, residuals: Array, simulator: Array) -> None:
    at, mean = at_mm.mean(axis=0), residuals.mean(axis=0)  # at equal shares of the range
    axes.plot(at_mm.T, residuals.T, color=GREY, lw=0.5, alpha=0.6)
    if len(residuals) > 1:
        band = 2.0 * residuals.std(axis=0, ddof=1) / len(residuals) ** 0.5
        label = "± 2 standard errors"
        axes.fill_between(at, mean - band, mean + band, color=BLUE, alpha=0.25, lw=0, label=label)
    axes.plot(at, mean, color=BLUE, lw=2, label="mean of curves")
    label = "attributed to mesh and simulator"
    axes.plot(at, simulator.mean(axis=0), color=VERMILION, lw=1.5, ls="--", label=label)
    axes.axhline(0.0, color="k", lw=0.8)


def anatomy_figure(found: Discovery, anatomy: Anatomy) -> Figure:
    """Draw the function learned, beside the baseline's own and those of shipped effects."""
    place, (mean, low, high) = anatomy.place, anatomy.function
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(5.6, 4.0), layout="constrained")
        axes = figure.subplots()
        axes.fill_between(place.at, low, high, color=VERMILION, alpha=0.25, lw=0)
        axes.plot(place.at, mean, color=VERMILION, lw=2, label="learned, with 95 % band")
        axes.plot(place.at, anatomy.baseline, color=BLUE, lw=1.5, ls="--", label="baseline")
        limits = axes.get_ylim()
        colours = itertools.cycle([GREEN, SKY, ORANGE, PURPLE, GREY])
        for (name, values), colour in zip(_shipped(anatomy), colours, strict=False):
            axes.plot(place.at, values, color=colour, lw=0.8, label=name.replace("_", " "))
        axes.set_ylim(limits)
        axes.set(xlabel=place.x_label, ylabel=place.y_label)
        shares = ", ".join(f"{name} {p:.0%}" for name, p in anatomy.probability.items())
        axes.set_title(shares, fontsize=9)
        axes.legend(fontsize=7, frameon=False)
    return figure


def _shipped(anatomy: Anatomy) -> Iterator[tuple[str, Array]]:
    """Yield the functions with shipped effects of typical size that change them."""
    for effect in EFFECTS.values():
        try:
            test = effect.apply(anatomy.test, effect.typical)
        except SpecificationError:
            continue
        if law_named(test.law).memory is None:
            values = anatomy.place.function(test, anatomy.place.at)
            if not np.allclose(values, anatomy.baseline, rtol=1e-3, atol=1e-9):
                yield effect.name, values


def left_out_figure(found: Discovery) -> Figure:
    """Draw measured curves and the predictions made without them."""
    at, measured = found.observed.at_mm, found.observed.force_N
    peaks = found.observed.peak_N[:, None]
    before = measured - peaks * found.baseline.fit.left_out()
    extended = None if found.extended is None else found.extended.fit
    after = None if extended is None else measured - peaks * extended.left_out()
    number = min(len(measured), MOST_CURVES)
    columns = min(number, 4)
    rows = -(-number // columns)
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(2.3 * columns + 0.4, 2.1 * rows + 0.5), layout="constrained")
        grid = figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False)
        for axes in grid.ravel()[number:]:
            axes.set_axis_off()
        for row, axes in enumerate(grid.ravel()[:number]):
            axes.plot(at[row], measured[row], ".", color="k", ms=3, label="measured")
            axes.plot(at[row], before[row], color=BLUE, lw=1.5, ls="--", label="baseline")
            if after is not None:
                axes.plot(at[row], after[row], color=VERMILION, lw=1.5, label="extended")
            record = found.dataset.records[row]
            broken = record.specimen in found.broken
            axes.set_title(f"{record.name}{' (broken)' if broken else ''}", fontsize=8)
        grid[0, 0].legend(fontsize=7, frameon=False)
        grid[0, 0].set(xlim=(0.0, None), ylim=(0.0, None))
        figure.supxlabel("Displacement (mm)", fontsize=10)
        figure.supylabel("Force (N)", fontsize=10)
    return figure


def gain_figure(found: Discovery) -> Figure:
    """Draw the errors of predicted left-out curves, by several predictors."""
    panels = {
        "curves": found.gain,
        "shapes of curves": found.shape_gain,
        "curves under another condition": found.condition_gain,
    }
    gains = {title: gain for title, gain in panels.items() if gain is not None}
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(8.0, 3.4), layout="constrained")
        grid = figure.subplots(1, len(gains), squeeze=False)[0]
        for axes, (title, gain) in zip(grid, gains.items(), strict=True):
            errors = {"mean of\nothers": gain.rmse_plain_N} if gain.rmse_plain_N else {}
            errors |= {"baseline": gain.rmse_before_N, "extended": gain.rmse_after_N}
            colours = [GREY, BLUE, VERMILION][-len(errors) :]
            bars = axes.bar(list(errors), list(errors.values()), color=colours, width=0.6)
            axes.bar_label(bars, fmt="%.2f", fontsize=8)
            low, high = gain.interval
            axes.set_title(f"{title}\nratio {gain.ratio:.2f} ({low:.2f} to {high:.2f})", fontsize=9)
            axes.grid(axis="x", visible=False)
        grid[0].set_ylabel("Error of prediction (N)")
    return figure

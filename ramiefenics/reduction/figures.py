"""Figures of a reduction: measured curves with their means, and quantities, by group."""

from __future__ import annotations

import math

import matplotlib as mpl
import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ramiefenics.measured import Record
from ramiefenics.measured.noise import Array
from ramiefenics.reduction import ALL, QUANTITIES, Reduction
from ramiefenics.results.style import BLUE, GREY, STYLE, VERMILION
from ramiefenics.results.text import label_of

IN_A_ROW = 3
GRID = 200
"""Number of displacements in a mean curve."""

SHOWN = ("slope_N_per_mm", "peak_N", "energy_to_peak_Nmm", "strength_MPa")
"""Quantities shown in the figure of quantities."""


def curves_by_group_figure(reduction: Reduction) -> Figure:
    """Draw all curves with their mean and standard deviation, in one panel per group.

    The mean begins where all curves have begun, and ends where half of them have ended. It is
    dashed beyond the end of the shortest curve.
    """
    records = zip(reduction.curves["group"], reduction.dataset.records, strict=True)
    groups: dict[str, list[Record]] = {name: [] for name in reduction.names}
    for group, record in records:
        groups[group].append(record)
    across = min(IN_A_ROW, len(groups))
    down = math.ceil(len(groups) / across)
    with mpl.rc_context(STYLE):
        size = (max(3.2 * across + 1.0, 5.0), 3.0 * down + (0.5 if across > 1 else 1.0))
        figure = Figure(figsize=size, layout="constrained")
        panels = figure.subplots(down, across, sharex=True, sharey=True, squeeze=False)
        for axes, (group, members) in zip(panels.flat, groups.items(), strict=False):
            _curves(axes, members)
            number = len(members)
            name = "" if group == ALL else f"{_factor(reduction)}: {group}, "
            axes.set_title(f"{name}n = {number}", fontsize=10)
        for axes in panels.flat[len(groups) :]:
            axes.set_visible(False)
        for axes in panels[:, 0]:
            axes.set_ylabel("Force (N)")
        for index, axes in enumerate(panels.flat[: len(groups)]):
            if index + across >= len(groups):  # no panel below this one
                axes.set_xlabel("Displacement (mm)")
                axes.tick_params(labelbottom=True)
        panels[0, 0].set_xlim(left=0.0)
        panels[0, 0].set_ylim(bottom=0.0)
        handles, labels = panels[0, 0].get_legend_handles_labels()
        figure.legend(
            handles,
            labels,
            loc="outside lower center",
            ncols=3 if across > 1 else 1,
            fontsize=8,
        )
    return figure


def _factor(reduction: Reduction) -> str:
    """Return the name of what the groups differ in, with its unit."""
    return label_of(reduction.by or "")


def _curves(axes: Axes, records: list[Record]) -> None:
    for index, record in enumerate(records):
        curve = record.curve
        label = "one curve" if index == 0 else None
        axes.plot(
            curve["displacement_mm"], curve["force_N"], color=GREY, lw=0.5, alpha=0.6, label=label
        )
    ends = np.sort([record.curve["displacement_mm"].iloc[-1] for record in records])
    start = max(record.curve["displacement_mm"].iloc[0] for record in records)
    at = np.linspace(start, ends[len(ends) // 2], GRID)
    forces = np.array([_force(record.curve, at) for record in records])
    mean = np.nanmean(forces, axis=0)
    if len(records) > 1:
        sd = np.nanstd(forces, axis=0, ddof=1)
        axes.fill_between(
            at, mean - sd, mean + sd, color=BLUE, alpha=0.25, lw=0, label="± 1 standard deviation"
        )
    axes.plot(at, mean, color=BLUE, lw=1.8, ls=(0, (3, 1.5)))
    whole = at <= ends[0]
    axes.plot(at[whole], mean[whole], color=BLUE, lw=1.8, label="mean, dashed where some ended")


def _force(curve: pd.DataFrame, at: Array) -> Array:
    travel = curve["displacement_mm"]
    return np.interp(at, travel, curve["force_N"], right=math.nan)


def quantities_by_group_figure(reduction: Reduction) -> Figure:
    """Draw slope, peak force, energy and strength of every curve, with the means of the groups."""
    groups = reduction.names
    with mpl.rc_context(STYLE):
        width = max(6.0, 2.4 + 0.8 * 2 * len(groups))
        figure = Figure(figsize=(min(width, 14.0), 6.0), layout="constrained")
        panels = figure.subplots(2, 2, sharex=True)
        for axes, quantity in zip(panels.flat, SHOWN, strict=True):
            _quantity(axes, reduction, quantity, groups)
        for axes in panels[1]:
            axes.set_xlabel(_factor(reduction))
        handles, labels = panels[0, 0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=2, fontsize=8)
    return figure


def _quantity(axes: Axes, reduction: Reduction, quantity: str, groups: list[str]) -> None:
    table = reduction.groups[reduction.groups["quantity"] == quantity].set_index("group")
    for place, group in enumerate(groups):
        values = reduction.curves.loc[reduction.curves["group"] == group, quantity].to_numpy()
        # offsets follow from the rank, so that points are well apart and the figure is reproducible
        beside = 0.16 * (2.0 * ((np.arange(len(values)) * 0.618034) % 1.0) - 1.0)
        label = "one curve" if place == 0 else None
        order = np.argsort(values)
        axes.plot(
            place + beside, values[order], "o", ms=3, color=GREY, alpha=0.6, mew=0, label=label
        )
        row = table.loc[group]
        if np.isfinite(row["low"]):
            below, above = row["mean"] - row["low"], row["high"] - row["mean"]
            axes.errorbar(
                place + 0.3,
                row["mean"],
                [[below], [above]],
                fmt="D",
                ms=5,
                color=VERMILION,
                capsize=4,
                label="mean, 95 % confidence interval" if place == 0 else None,
            )
    axes.set_xticks(range(len(groups)), [str(group) for group in groups])
    axes.set_xlim(-0.5, len(groups) - 0.3)
    axes.set_ylim(bottom=0.0)
    if sum(len(str(group)) for group in groups) > 24:  # otherwise the names overlap
        axes.tick_params(axis="x", rotation=60)
    title, unit = QUANTITIES[quantity]
    axes.set_ylabel(f"{title} ({unit})")
    axes.grid(axis="x", visible=False)

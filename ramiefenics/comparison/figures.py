"""Figure of measured and simulated curves, and of their differences."""

from __future__ import annotations

import itertools

import matplotlib as mpl
from matplotlib.figure import Figure

from ramiefenics.comparison.outcome import Comparison
from ramiefenics.results.style import BLUE, GREEN, GREY, ORANGE, PURPLE, STYLE, VERMILION

COLOURS = (BLUE, VERMILION, GREEN, ORANGE, PURPLE)

MANY = 20
"""Number of curves above which lines are thinner, so that those behind them can be seen."""


def comparison_figure(found: Comparison) -> Figure:
    """Draw the curves, and below them simulated minus measured forces."""
    names = list(dict.fromkeys(pair.name for pair in found.pairs))
    colours = dict(zip(names, itertools.cycle(COLOURS), strict=False))
    width = min(1.0, (MANY / len(found.pairs)) ** 0.5)
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(6.4, 6.2), layout="constrained")
        above, below = figure.subplots(2, 1, sharex=True, height_ratios=(3, 2))
        for record in {pair.record.name: pair.record for pair in found.pairs}.values():
            curve = record.curve
            above.plot(
                curve["displacement_mm"], curve["force_N"], color=GREY, lw=0.8 * width, alpha=0.7
            )
        for pair in found.pairs:
            curve, colour = pair.recorded, colours[pair.name]
            above.plot(curve["displacement_mm"], curve["force_N"], color=colour, lw=width)
            share = 100.0 * pair.residual_N / pair.measured_N.max()
            below.plot(pair.at_mm, share, color=colour, lw=0.8 * width)
        above.plot([], [], color=GREY, label="measured")
        for name, colour in colours.items():
            above.plot([], [], color=colour, label=f"simulated, {name}")
        below.axhline(0.0, color="k", lw=0.6)
        above.set(ylabel="Force (N)", xlim=(0.0, None), ylim=(0.0, None))
        below.set(
            xlabel="Displacement (mm)", ylabel="Simulated less measured\n(% of measured maximum)"
        )
        above.legend(fontsize=8, frameon=False)
    return figure

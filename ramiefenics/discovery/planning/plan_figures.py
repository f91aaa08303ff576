"""Figures of a plan: smallest amplitudes found, and effects mistaken for one another."""

from __future__ import annotations

import matplotlib as mpl
from matplotlib.figure import Figure
from matplotlib.ticker import NullLocator

from ramiefenics.discovery.planning.plan import Plan
from ramiefenics.discovery.report.suspect_figures import cosine_figure
from ramiefenics.results.style import BLUE, GREEN, GREY, ORANGE, STYLE, VERMILION

COLOURS = (BLUE, VERMILION, GREEN, ORANGE, GREY)
MARKERS = "osD^v"
SMALLEST, LARGEST = 0.08, 12.0
"""Limits of the axis of amplitudes, relative to the typical ones."""

TICKS = (0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0)


def smallest_figure(plan: Plan) -> Figure:
    """Draw the smallest amplitudes that are found, for each choice of tests."""
    names = list(plan.alone.smallest)
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(6.5, 1.8 + 0.27 * len(names)), layout="constrained")
        axes = figure.subplots()
        for number, (what, found) in enumerate(plan.powers.items()):
            shares = [abs(found.smallest[n] / plan.effects[n].typical) for n in names]
            label = "standard test alone" if number == 0 else f"plus a test with {what}"
            colour, marker = COLOURS[number % len(COLOURS)], MARKERS[number % len(MARKERS)]
            axes.plot(
                shares, range(len(names)), ls="", ms=6, color=colour, marker=marker, label=label
            )
        axes.axvline(1.0, color="k", lw=1.0, ls="--")
        axes.set_yticks(range(len(names)), [name.replace("_", " ") for name in names])
        axes.set_ylim(-0.7, len(names) - 0.3)
        axes.set_xscale("log")
        axes.set_xlim(SMALLEST, LARGEST)
        axes.set_xticks(TICKS, [f"{tick:g}" for tick in TICKS], minor=False)
        axes.xaxis.set_minor_locator(NullLocator())
        axes.set_xlabel("Smallest detectable amplitude / typical amplitude")
        figure.legend(fontsize=8, loc="outside upper center", frameon=False)
    return figure


def mistaken_figure(plan: Plan) -> Figure:
    """Draw the cosines of signatures in the standard test."""
    return cosine_figure(list(plan.alone.smallest), plan.alone.cosines)

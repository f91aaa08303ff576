"""Style of all figures: type, lines, colours."""

from __future__ import annotations

from contextlib import AbstractContextManager
from typing import Any

from cycler import cycler

BLUE, VERMILION, GREY = "#0072B2", "#D55E00", "#666666"
GREEN, SKY, ORANGE, PURPLE = "#009E73", "#56B4E9", "#E69F00", "#CC79A7"
"""Colours from Okabe and Ito's palette, which colour-blind readers can distinguish."""

STYLE: Any = {
    "font.size": 10.0,
    "axes.prop_cycle": cycler(color=[BLUE, VERMILION, GREEN, PURPLE, ORANGE, SKY]),
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.alpha": 0.3,
    "legend.frameon": False,
    "figure.dpi": 200,
}

VECTOR: Any = {"pdf.fonttype": 42, "svg.fonttype": "none", "svg.hashsalt": "ramiefenics"}
"""Settings of vector files: text stays text, and the same figure gives the same file."""


def style() -> AbstractContextManager[None]:
    """Return a context, for ``with``, in which Matplotlib draws as in the figures of results."""
    from matplotlib import rc_context

    return rc_context(STYLE)

"""Figures of a validation: predictions with measurements, and effects of the unknown factors."""

from __future__ import annotations

import matplotlib as mpl
import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from ramiefenics.results.style import BLUE, GREY, ORANGE, PURPLE, SKY, STYLE, VERMILION
from ramiefenics.validation.outcome import Assessment, Validation


def prediction_figure(found: Validation, assessment: Assessment) -> Figure:
    """Draw the measurement and the predictions of each observation."""
    table = found.table(assessment)
    rows = np.arange(len(table))[::-1]
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(6.8, 0.75 * len(table) + 1.6), layout="constrained")
        axes = figure.subplots()
        axes.hlines(
            rows - 0.06,
            table["prior_low"],
            table["prior_high"],
            color=GREY,
            lw=1.5,
            label="uncalibrated, 95 %",
        )
        axes.hlines(
            rows + 0.08, table["low"], table["high"], color=SKY, lw=6.0, label="calibrated, 95 %"
        )
        axes.plot(table["calibrated"], rows + 0.08, "|", color=BLUE, ms=9, mew=2.0, label="median")
        axes.errorbar(
            table["measured"],
            rows + 0.28,
            xerr=1.96 * table["standard_error"],
            fmt="o",
            color=VERMILION,
            ms=5,
            capsize=3,
            label="measured, 95 %",
        )
        for column, mark, colour, words, beside in (
            ("published", "D", ORANGE, "published simulation", 0.2),
            ("rule", "s", PURPLE, "P L / 4 W constant", 0.34),
        ):
            if table[column].notna().any():
                axes.plot(table[column], rows - beside, mark, color=colour, ms=5, label=words)
        axes.set_yticks(rows, _names(table))
        axes.set_ylim(-0.6, len(table) - 0.4)
        axes.set_xlabel(found.response.label)
        figure.legend(
            *axes.get_legend_handles_labels(), loc="outside lower center", ncols=3, fontsize=8
        )
    return figure


def _names(table: pd.DataFrame) -> list[str]:
    calibrated = table["role"] == "calibrated on"
    return [
        f"{n} *" if on else str(n) for n, on in zip(table["observation"], calibrated, strict=True)
    ]


def nuisance_figure(found: Validation, assessment: Assessment) -> Figure:
    """Draw how much each factor changes the predictions, before and after the calibration."""
    swings = found.swings(assessment).set_index("factor")[["before", "after"]].abs()
    table = swings.groupby(level=0).mean()  # of magnitudes, as signs may differ between stalks
    order = table["before"].sort_values().index
    rows = np.arange(len(order))
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(6.8, 0.42 * len(order) + 1.5), layout="constrained")
        axes = figure.subplots()
        axes.barh(rows + 0.2, table.loc[order, "before"], 0.38, color=GREY, label="before")
        axes.barh(rows - 0.2, table.loc[order, "after"], 0.38, color=BLUE, label="after")
        titles = {f.name: f.title or f.name for f in found.study.factors}
        axes.set_yticks(rows, [titles[name] for name in order], fontsize=8)
        axes.set_xlabel("Change of a prediction over the range (%)")
        axes.legend(title="the calibration", fontsize=8, title_fontsize=8, loc="lower right")
    return figure

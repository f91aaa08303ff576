"""What a discovery shows: residuals, suspects, predictions of specimens left out."""

from __future__ import annotations

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ramiefenics.discovery.evidence import Array
from ramiefenics.discovery.outcome import Discovery
from ramiefenics.discovery.verdict import RIVAL
from ramiefenics.results.style import BLUE, GREY, STYLE, VERMILION

MOST_SPECIMENS = 12
"""Drawn one by one; there may be more."""


def residual_figure(found: Discovery) -> Figure:
    """Draw what the baseline leaves, and what the extended model leaves, if there is one."""
    models = [("baseline", found.baseline)]
    if found.extended is not None and found.extended.curves.model.effect is not None:
        name = found.extended.curves.model.effect.name.replace("_", " ")
        models.append((f"with {name}", found.extended))
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(4.2 * len(models) + 0.3, 3.6), layout="constrained")
        panels = figure.subplots(1, len(models), sharey=True, squeeze=False)[0]
        for axes, (title, fitted) in zip(panels, models, strict=True):
            _residuals(axes, found.observed.at_mm, *(100.0 * part for part in fitted.remaining()))
            axes.set_title(title, fontsize=10)
        panels[0].set_ylabel("Measured minus fitted (% of peak force)")
        panels[0].legend(fontsize=8, frameon=False)
    return figure


def _residuals(axes: Axes, at_mm: Array, residuals: Array, nuisance: Array) -> None:
    mean = residuals.mean(axis=0)
    band = 2.0 * residuals.std(axis=0, ddof=1) / len(residuals) ** 0.5
    axes.plot(at_mm, residuals.T, color=GREY, lw=0.5, alpha=0.6)
    axes.fill_between(
        at_mm, mean - band, mean + band, color=BLUE, alpha=0.25, lw=0, label="± 2 standard errors"
    )
    axes.plot(at_mm, mean, color=BLUE, lw=2, label="mean of specimens")
    label = "put down to the simulator"
    axes.plot(at_mm, nuisance.mean(axis=0), color=VERMILION, lw=1.5, ls="--", label=label)
    axes.axhline(0.0, color="k", lw=0.8)
    axes.set_xlabel("Displacement (mm)")


def suspects_figure(found: Discovery) -> Figure:
    """Draw how much more probable every suspect makes the data."""
    gains = {
        n: s.log_likelihood_ratio
        for n, s in found.scores.items()
        if s.log_likelihood_ratio is not None
    }
    names = sorted(gains, key=lambda name: gains[name])
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(6.0, 0.9 + 0.35 * max(len(names), 2)), layout="constrained")
        axes = figure.subplots()
        colours = [VERMILION if name in found.causes else GREY for name in names]
        axes.barh(
            [name.replace("_", " ") for name in names], [gains[n] for n in names], color=colours
        )
        best = max(gains.values(), default=0.0)
        if found.causes:
            axes.axvline(best - RIVAL, color="k", lw=1.0, ls="--")
            axes.set_title("dashed: what is right of it is not told apart", fontsize=8, loc="right")
        axes.set_xlabel("Log-likelihood gained over the baseline")
        axes.set_xlim(left=0.0, right=max(best * 1.05, 5.0))
        axes.grid(axis="y", visible=False)
    return figure


def left_out_figure(found: Discovery) -> Figure:
    """Draw measured curves over predictions made without them."""
    at, measured = found.observed.at_mm, found.observed.force_N
    peaks = found.observed.peak_N[:, None]
    before = measured - peaks * found.baseline.left_out()
    after = None if found.gain is None else measured - found.gain.after_N
    number = min(len(measured), MOST_SPECIMENS)
    columns = min(number, 4)
    rows = -(-number // columns)
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(2.3 * columns + 0.4, 2.1 * rows + 0.5), layout="constrained")
        grid = figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False)
        for axes in grid.ravel()[number:]:
            axes.set_axis_off()
        for s, axes in enumerate(grid.ravel()[:number]):
            axes.plot(at, measured[s], ".", color="k", ms=3, label="measured")
            axes.plot(at, before[s], color=BLUE, lw=1.5, ls="--", label="baseline")
            if after is not None:
                axes.plot(at, after[s], color=VERMILION, lw=1.5, label="extended")
            axes.set_title(found.dataset.specimens[s].name, fontsize=8)
        grid[0, 0].legend(fontsize=7, frameon=False)
        grid[0, 0].set(xlim=(0.0, None), ylim=(0.0, None))
        figure.supxlabel("Displacement (mm)", fontsize=10)
        figure.supylabel("Force (N)", fontsize=10)
    return figure

"""Figures of a calibration: curves, equally good parameters, profiles and posterior."""

from __future__ import annotations

from functools import partial

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from scipy import stats

from ramiefenics.calibration.desirability import Desired
from ramiefenics.calibration.factors import Array
from ramiefenics.calibration.fit import Fit
from ramiefenics.calibration.identifiability import RISE
from ramiefenics.calibration.optimum import level_points
from ramiefenics.calibration.outcome import Calibration
from ramiefenics.calibration.responses import response
from ramiefenics.results.result import Picture
from ramiefenics.results.style import BLUE, GREY, ORANGE, STYLE, VERMILION

BINS = 40

FILLING = 65536
"""Number of points that fill the region, for the maps over two factors."""

DRAWN = 4000
"""Number of points from which a level surface is drawn."""


def of_fit(found: Calibration, fit: Fit) -> dict[str, Picture]:
    """Return the figures of a fit, by the names of their files."""
    number = len(found.space.factors)
    drawn = {}
    if number > 1:
        share = (
            "for each pair of factors, the share of the others' values that fit"
            if number > 2
            else "1 where the parameters fit, 0 where they do not"
        )
        equal = (
            "fit the targets as well as it does, within the errors"
            if fit.optimum.met
            else "miss the targets by about as much as it does"
        )
        drawn["optimum"] = Picture(
            partial(optimum_figure, found, fit),
            f"The set of equally good parameters: {share}. Star: the point of least misfit or, if "
            f"there are several, the one nearest to the centre of the ranges; all points of the "
            f"set {equal}.",
        )
    if number == 3 and len(fit.misfit.surfaces) == 1 and fit.optimum.met:
        drawn["level"] = Picture(
            partial(level_figure, found, fit),
            "Points at which the response equals the target, and the target plus or minus one "
            "standard error: any point of the surface is as good as any other.",
        )
    drawn["profiles"] = Picture(
        partial(profile_figure, found, fit),
        "Profile likelihood: how much chi-squared rises when one parameter is moved and all "
        "others are adjusted. Values at which the curve is below the dashed line are compatible "
        "with the data (95 %).",
    )
    drawn["posterior"] = Picture(
        partial(posterior_figure, found, fit),
        "Posterior for a flat prior in the region of the design.",
    )
    return drawn


def curves_figure(found: Calibration) -> Figure:
    """Draw the force curves of all runs and of the optimum, and the measured forces."""
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(5.5, 4.0), layout="constrained")
        axes = figure.subplots()
        label: str | None = "runs of the design"
        for outcome in found.campaign.outcomes:
            if outcome.recorded is not None:
                axes.plot(*outcome.recorded, color=GREY, lw=0.7, alpha=0.8, label=label)
                label = None
        fit = found.fit
        if fit is not None:
            if fit.confirmation is not None and fit.confirmation.recorded is not None:
                axes.plot(*fit.confirmation.recorded, color=BLUE, lw=1.8, label="at the optimum")
            _mark_targets(axes, fit)
        axes.set(xlabel="Indenter displacement (mm)", ylabel="Force (N)")
        axes.set_xlim(left=0.0)
        axes.set_ylim(bottom=0.0)
        axes.legend(fontsize=8, frameon=False, loc="lower right")
    return figure


def _mark_targets(axes: Axes, fit: Fit) -> None:
    """Draw the targets that are forces."""
    targets = fit.misfit.targets
    for name, value, error in zip(targets.names, targets.values, targets.errors, strict=True):
        if name == "max_force_N":
            axes.axhline(value, color=VERMILION, lw=1.3, ls="--", label="measured maximum ± 2 s.e.")
            axes.axhspan(value - 2.0 * error, value + 2.0 * error, color=VERMILION, alpha=0.15)
        elif name.startswith("force_"):
            at = float(name.removeprefix("force_").removesuffix("mm_N"))
            axes.errorbar(at, value, 2.0 * error, fmt="s", ms=4, color=VERMILION, capsize=3)


def optimum_figure(found: Calibration, fit: Fit) -> Figure:
    """Draw the set of equally good parameters over each pair of factors, and its best point.

    The colour is the share of the values of the other factors for which a point belongs to the set.
    """
    several = len(found.space.factors) > 2
    what = "Share of the other factors' values that fit" if several else "Fits"
    points = found.design.region.sample(FILLING, seed=1)
    least = fit.misfit.of(fit.optimum.best[None])
    good = fit.misfit.of(points) <= least + fit.optimum.tolerance
    return _map_figure(found, points, good.astype(float), "mean", fit.optimum.best, what)


def desirability_figure(found: Calibration, desired: Desired) -> Figure:
    """Draw the greatest overall desirability over each pair of factors."""
    points = found.design.region.sample(FILLING, seed=1)
    what = "Desirability, other factors at their best"
    return _map_figure(found, points, desired.of(points), "max", desired.best, what)


def _map_figure(
    found: Calibration, points: Array, values: Array, statistic: str, best: Array, what: str
) -> Figure:
    """Draw a statistic of the values at many points, in cells of each pair of factors."""
    number = len(found.space.factors)
    with mpl.rc_context({**STYLE, "axes.grid": False}):
        side = 2.3 * (number - 1)
        figure = Figure(figsize=(side + 1.9, side + 0.6), layout="constrained")
        grid = figure.subplots(number - 1, number - 1, squeeze=False, sharex="col")
        for row in range(1, number):
            for column in range(number - 1):
                axes = grid[row - 1, column]
                if column >= row:
                    axes.set_axis_off()
                    continue
                two = [column, row]
                at = found.space.natural(points)[:, two]
                cells, *edges, _ = stats.binned_statistic_2d(*at.T, values, statistic, bins=28)
                drawn = axes.pcolormesh(
                    *edges, cells.T, cmap="cividis", vmin=0.0, vmax=1.0, rasterized=True
                )
                star = found.space.natural(best)[two]
                axes.plot(*star, "*", ms=11, color=VERMILION, mec="w", mew=0.8)
                axes.tick_params(labelsize=7)
                if row == number - 1:
                    axes.set_xlabel(found.space.factors[column].label, fontsize=7)
                if column == 0:
                    axes.set_ylabel(found.space.factors[row].label, fontsize=7)
        bar = figure.colorbar(drawn, ax=grid, shrink=0.8)
        bar.set_label(what, fontsize=8)
        bar.ax.tick_params(labelsize=7)
    return figure


def level_figure(found: Calibration, fit: Fit) -> Figure:
    """Draw the surface, in the space of three factors, on which a response equals its target."""
    surface, targets = fit.misfit.surfaces[0], fit.misfit.targets
    region, value, error = found.design.region, float(targets.values[0]), float(targets.errors[0])
    levels = [(value, BLUE, 6.0), (value - error, GREY, 1.0), (value + error, ORANGE, 1.0)]
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(5.6, 4.8), layout="constrained")
        axes = figure.add_subplot(projection="3d")
        for level, colour, size in levels:
            natural = found.space.natural(level_points(surface, level, region, DRAWN))
            if len(natural):
                axes.scatter(
                    *natural.T, s=size, color=colour, alpha=0.5, lw=0, label=f"{level:.4g}"
                )
        best = found.space.natural(fit.optimum.best)
        axes.computed_zorder = False  # keeps the best point visible within the cloud
        axes.scatter(*best, marker="*", s=160, color=VERMILION, edgecolor="w", zorder=10)
        low, high = (found.space.natural(s * region.reach * np.ones(3)) for s in (-1.0, 1.0))
        for name, factor, a, b in zip("xyz", found.space.factors, low, high, strict=True):
            getattr(axes, f"set_{name}lim")(a, b)
            getattr(axes, f"set_{name}label")(factor.label, fontsize=8)
        axes.tick_params(labelsize=7)
        axes.locator_params(nbins=5)  # otherwise the labels overlap
        title = response(surface.response).label
        axes.legend(title=title, fontsize=8, title_fontsize=8, markerscale=2.0)
        axes.set_box_aspect(None, zoom=0.85)
        axes.view_init(elev=15.0, azim=-35.0)
    return figure


def profile_figure(found: Calibration, fit: Fit) -> Figure:
    """Draw the profile likelihood of each factor, with the limit of its 95 % interval."""
    number = len(fit.profiles)
    columns = min(number, 3)
    rows = -(-number // columns)
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(2.9 * columns + 0.5, 2.7 * rows), layout="constrained")
        grid = figure.subplots(rows, columns, squeeze=False, sharey=True)
        for axes in grid.ravel()[number:]:
            axes.set_axis_off()
        for index, (axes, profile) in enumerate(zip(grid.ravel(), fit.profiles, strict=False)):
            natural = _along(found, index, profile.at)
            axes.plot(natural, profile.rise, color=BLUE, lw=1.8)
            axes.axhline(RISE, color=VERMILION, lw=1.2, ls="--")
            inside = profile.rise <= RISE
            axes.fill_between(natural, 0.0, profile.rise, where=inside, color=BLUE, alpha=0.15)
            axes.set_xlabel(found.space.factors[index].label, fontsize=8)
            axes.set_title(profile.verdict, fontsize=9, loc="left")
            axes.tick_params(labelsize=8)
            axes.set_ylim(0.0, 3.0 * RISE)
        for line in grid[:, 0]:
            line.set_ylabel("Rise of chi-squared")
    return figure


def _along(found: Calibration, index: int, coded: Array) -> Array:
    points = np.zeros((len(coded), len(found.space.factors)))
    points[:, index] = coded
    return found.space.natural(points)[:, index]


def posterior_figure(found: Calibration, fit: Fit) -> Figure:
    """Draw the posterior of each parameter over its prior, and that of each pair of parameters."""
    samples = found.space.natural(fit.posterior.samples)
    prior = found.space.natural(fit.posterior.prior)
    number = samples.shape[1]
    with mpl.rc_context({**STYLE, "axes.grid": False}):
        side = 1.9 * number + 0.6
        figure = Figure(figsize=(side, side), layout="constrained")
        grid = figure.subplots(number, number, squeeze=False, sharex="col")
        for row in range(number):
            for column in range(number):
                axes = grid[row, column]
                if column > row:
                    axes.set_axis_off()
                elif column == row:
                    _marginal(axes, samples[:, row], prior[:, row])
                else:
                    axes.hist2d(samples[:, column], samples[:, row], bins=40, cmap="cividis")
                axes.tick_params(labelsize=7)
                if row == number - 1:
                    axes.set_xlabel(found.space.factors[column].label, fontsize=7)
                if column == 0 and row > 0:
                    axes.set_ylabel(found.space.factors[row].label, fontsize=7)
        grid[0, 0].legend(fontsize=7, frameon=False)
    return figure


def _marginal(axes: Axes, samples: Array, prior: Array) -> None:
    edges = list(np.linspace(prior.min(), prior.max(), BINS + 1))
    axes.hist(samples, edges, density=True, color=BLUE, alpha=0.5, label="posterior")
    axes.hist(prior, edges, density=True, histtype="step", color="k", lw=1.0, label="prior")
    axes.set_yticks([])

"""Figures of response surfaces: contours, main effects and residuals."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from functools import partial
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib import patheffects
from matplotlib.axes import Axes
from matplotlib.contour import QuadContourSet
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from scipy import stats

from ramiefenics.calibration.factors import Array
from ramiefenics.calibration.outcome import Calibration
from ramiefenics.calibration.responses import response
from ramiefenics.calibration.surface import Surface
from ramiefenics.results.result import Picture
from ramiefenics.results.style import BLUE, GREY, STYLE, VERMILION

COLOURS = "cividis"
"""Colour map that also suits colour-blind readers."""

LEVELS = 12
CELLS = 81

PLANE_CELLS = 301
"""Points along a side of a plane, so many that the edge of a design's region looks smooth."""


def of_response(found: Calibration, name: str) -> dict[str, Picture]:
    """Return the figures of a response's surface, by the names of their files."""
    label, drawn = response(name).label, {}
    if len(found.space.factors) > 1:
        drawn[f"contours_{name}"] = Picture(
            partial(contour_figure, found, name),
            f"{label}: response surface; white: runs; star: optimum; dashed: the target; dotted: "
            "within two standard errors of it.",
        )
        drawn[f"main_effects_{name}"] = Picture(
            partial(main_effects_figure, found, name),
            f"{label} against each factor, with the others at the centre of the design and the "
            "surface's 95 % confidence band. White: runs that differ from the centre in this "
            "factor only.",
        )
    drawn[f"diagnostics_{name}"] = Picture(
        partial(diagnostics_figure, found.surfaces[name]), f"{label}: residuals of the surface."
    )
    return drawn


def contour_figure(found: Calibration, name: str) -> Figure:
    """Draw a response over each pair of factors.

    The other factors are at the optimum, or at the centre if there is none. The target is a dashed
    line, and the range within twice its standard error is dotted. Points outside the region of the
    design are left blank.
    """
    surface = found.surfaces[name]
    pairs = list(itertools.combinations(range(len(found.space.factors)), 2))
    columns = min(len(pairs), 3)
    rows = -(-len(pairs) // columns)
    with mpl.rc_context({**STYLE, "axes.grid": False}):
        size = (3.1 * columns + 1.2, 2.9 * rows + 0.3)
        figure = Figure(figsize=size, layout="constrained")
        grid = figure.subplots(rows, columns, squeeze=False)
        planes = [_plane(found, surface, pair) for pair in pairs]
        values = np.concatenate([plane[2][np.isfinite(plane[2])] for plane in planes])
        levels = _levels(values)
        for axes in grid.ravel()[len(pairs) :]:
            axes.set_axis_off()
        for axes, pair, plane in zip(grid.ravel(), pairs, planes, strict=False):
            drawn = axes.contourf(*plane, levels=levels, cmap=COLOURS)
            lines: QuadContourSet = axes.contour(*plane, levels=levels, colors="k", linewidths=0.3)
            _label(axes, lines, levels[::2], size=8)
            _mark_target(axes, found, name, plane)
            _mark_points(axes, found, pair)
        figure.colorbar(drawn, ax=grid, label=response(name).label, shrink=0.9)
    return figure


def _levels(values: Array) -> Array:
    """Return round numbers that span the values drawn, even if these are all equal."""
    low, high = float(values.min()), float(values.max())
    return np.asarray(MaxNLocator(LEVELS, min_n_ticks=3).tick_values(low, high))


def _label(axes: Axes, lines: QuadContourSet, levels: Sequence[float] | Array, size: float) -> None:
    """Label contours with their values, legibly on any colour."""
    halo = patheffects.withStroke(linewidth=1.5, foreground="w")
    for text in axes.clabel(lines, levels, fmt="%.4g", fontsize=size):
        text.set_path_effects([halo])


def _middle(found: Calibration) -> Array:
    return found.fit.optimum.best if found.fit else np.zeros(len(found.space.factors))


def _plane(
    found: Calibration, surface: Surface, pair: tuple[int, int]
) -> tuple[Array, Array, Array]:
    """Return natural values of two factors, and the response; NaN outside the design's region."""
    reach = found.design.region.reach
    line = np.linspace(-reach, reach, PLANE_CELLS)
    first, second = np.meshgrid(line, line)
    points = np.tile(_middle(found), (first.size, 1))
    points[:, pair[0]], points[:, pair[1]] = first.ravel(), second.ravel()
    value = np.where(found.design.region.contains(points), surface.predict(points), np.nan)
    natural = found.space.natural(points)
    shape = first.shape
    x, y = (natural[:, number].reshape(shape) for number in pair)
    return x, y, np.asarray(value.reshape(shape))


def _mark_target(
    axes: Axes, found: Calibration, name: str, plane: tuple[Array, Array, Array]
) -> None:
    if found.fit is None or name not in found.fit.misfit.targets.names:
        return
    targets = found.fit.misfit.targets
    index = targets.names.index(name)
    value, error = float(targets.values[index]), float(targets.errors[index])
    low, high = np.nanmin(plane[2]), np.nanmax(plane[2])
    if low < value < high:
        line: QuadContourSet = axes.contour(
            *plane, levels=[value], colors=VERMILION, linestyles="--", linewidths=1.8
        )
        _label(axes, line, [value], size=8)
    if low < value + 2.0 * error and high > value - 2.0 * error:
        axes.contourf(
            *plane,
            levels=[value - 2.0 * error, value + 2.0 * error],
            colors="none",
            hatches=["..."],
        )


def _mark_points(axes: Axes, found: Calibration, pair: tuple[int, int]) -> None:
    natural = found.space.natural(found.design.coded)
    points = natural[:, pair[0]], natural[:, pair[1]]
    axes.plot(*points, "o", ms=3.5, mfc="w", mec="k", mew=0.6, clip_on=False, zorder=3)
    if found.fit is not None:
        best = found.space.natural(found.fit.optimum.best)
        place = best[pair[0]], best[pair[1]]
        star: Any = {"ms": 11, "color": VERMILION, "mec": "w", "mew": 0.8}
        axes.plot(*place, "*", **star, clip_on=False, zorder=4)
    factors = found.space.factors
    axes.set_xlabel(factors[pair[0]].label, fontsize=8)
    axes.set_ylabel(factors[pair[1]].label, fontsize=8)
    axes.tick_params(labelsize=8)


def main_effects_figure(found: Calibration, name: str) -> Figure:
    """Draw a response over each factor, with the others at the centre of the design.

    The band is the 95 % confidence interval of the surface. Points are runs that differ from the
    centre in this factor only.
    """
    surface, factors = found.surfaces[name], found.space.factors
    reach = found.design.region.reach
    columns = min(len(factors), 4)
    rows = -(-len(factors) // columns)
    freedom = surface.fit.df_resid
    quantile = stats.t.ppf(0.975, freedom) if freedom > 0 else np.nan
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(2.3 * columns + 0.6, 2.4 * rows + 0.2), layout="constrained")
        grid = figure.subplots(rows, columns, squeeze=False, sharey=True)
        for axes in grid.ravel()[len(factors) :]:
            axes.set_axis_off()
        for number, (axes, factor) in enumerate(zip(grid.ravel(), factors, strict=False)):
            line = np.zeros((CELLS, len(factors)))
            line[:, number] = np.linspace(-reach, reach, CELLS)
            points = line[found.design.region.contains(line)]
            x, mean = found.space.natural(points)[:, number], surface.predict(points)
            half = quantile * surface.standard_error(points)
            axes.fill_between(x, mean - half, mean + half, color=BLUE, alpha=0.25, lw=0.0)
            axes.plot(x, mean, color=BLUE, lw=1.5)
            others = np.delete(surface.points, number, axis=1)
            alone = np.all(np.abs(others) < 1e-9, axis=1)
            runs = found.space.natural(surface.points)[alone, number]
            axes.plot(runs, surface.values[alone], "o", ms=4, mfc="w", mec="k", mew=0.6)
            axes.set_xlabel(factor.label, fontsize=8)
            axes.tick_params(labelsize=8)
        for axes in grid[:, 0]:
            axes.set_ylabel(response(name).label)
    return figure


def diagnostics_figure(surface: Surface) -> Figure:
    """Draw fitted over simulated values, a normal plot of the residuals, and Cook's distances."""
    table = surface.diagnostics()
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(9.6, 3.3), layout="constrained")
        fitted, normal, cook = figure.subplots(1, 3)
        ends = [
            table[["value", "fitted"]].min(axis=None),
            table[["value", "fitted"]].max(axis=None),
        ]
        fitted.plot(ends, ends, color=GREY, lw=1.0)
        fitted.plot(table["value"], table["fitted"], "o", color=BLUE, ms=5)
        unit = response(surface.response).unit
        fitted.set(xlabel=f"Simulated ({unit})", ylabel=f"Fitted ({unit})")
        fitted.set_title(response(surface.response).label, fontsize=9, loc="left")
        residuals = np.sort(table["studentised"].to_numpy())
        places = (np.arange(1, len(residuals) + 1) - 0.375) / (len(residuals) + 0.25)
        quantiles = stats.norm.ppf(places)  # Blom (1958)
        normal.plot(quantiles, quantiles, color=GREY, lw=1.0)
        normal.plot(quantiles, residuals, "o", color=BLUE, ms=5)
        normal.set(xlabel="Normal quantile", ylabel="Studentised residual")
        p = surface.normality_p
        if np.isfinite(p):
            normal.set_title(f"Shapiro-Wilk p = {p:.2g}", fontsize=9, loc="left")
        runs = np.arange(1, len(table) + 1)
        cook.vlines(runs, 0.0, table["cook"], color=BLUE, lw=2.0)
        cook.axhline(1.0, color=VERMILION, lw=1.2, ls="--")
        cook.set(xlabel="Fitted run", ylabel="Cook's distance")
        cook.set_ylim(bottom=0.0)
    return figure

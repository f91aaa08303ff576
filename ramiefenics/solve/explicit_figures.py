"""Force and energies of a simulation with inertia, drawn with Matplotlib."""

from __future__ import annotations

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ramiefenics.results.style import BLUE, GREEN, GREY, ORANGE, PURPLE, SKY, STYLE, VERMILION
from ramiefenics.solve.explicit_result import QUASI_STATIC, ExplicitResult

ENERGIES = {
    "indenter_work_Nmm": ("indenter's work", "k", "-"),
    "stored_energy_Nmm": ("stored", BLUE, "--"),
    "friction_work_Nmm": ("friction", GREEN, "-"),
    "kinetic_energy_Nmm": ("kinetic", VERMILION, "-"),
    "damping_work_Nmm": ("damping", ORANGE, "-"),
    "dissipated_Nmm": ("dissipated by the material", PURPLE, "-"),
}
SHOWN = 1e-5
"""Smallest energy that is drawn, relative to the largest."""


def explicit_figure(result: ExplicitResult) -> Figure:
    """Draw force and energies against travel, with the quasi-static force for comparison."""
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(10.0, 4.0), layout="constrained")
        left, right = figure.subplots(1, 2)
        _draw_forces(left, result)
        _draw_energies(right, result)
        if not result.completed:
            figure.suptitle(result.ending.reason, fontsize=8, color=VERMILION, wrap=True)
        for axes in (left, right):
            axes.set_xlabel("Indenter displacement (mm)")
            axes.set_xlim(left=0.0)
    return figure


def _draw_forces(axes: Axes, result: ExplicitResult) -> None:
    curve, travel = result.curve, result.curve["displacement_mm"]
    axes.plot(travel, curve["support_force_N"], color=SKY, lw=1.0, label="explicit, supports")
    axes.plot(travel, curve["force_N"], color=BLUE, lw=1.5, label="explicit, indenter")
    if result.implicit is not None:
        static = result.implicit.curve
        label = "implicit, quasi-static"
        at, force = static["displacement_mm"], static["force_N"]
        axes.plot(at, force, "o", color=VERMILION, ms=4.5, mfc="none", label=label)
    axes.set_ylabel("Force (N)")
    axes.set_ylim(bottom=0.0)
    axes.legend(frameon=False, fontsize=8, loc="lower right")


def _draw_energies(axes: Axes, result: ExplicitResult) -> None:
    curve = result.curve.iloc[1:]  # there is no energy at rest
    travel, stored = curve["displacement_mm"], curve["stored_energy_Nmm"]
    for name, (label, colour, line) in ENERGIES.items():
        if name != "dissipated_Nmm" or curve[name].any():  # zero in elastic laws
            axes.plot(travel, curve[name], color=colour, ls=line, lw=1.5, label=label)
    limit = QUASI_STATIC * stored
    label = f"{100 * QUASI_STATIC:g} % of the stored energy"
    axes.plot(travel, limit, color=GREY, ls=":", lw=1.0, label=label)
    top = float(curve[list(ENERGIES)].max().max())
    if top > 0.0:
        axes.set_yscale("log")
        axes.set_ylim(SHOWN * top, 2.0 * top)
    axes.set_ylabel("Energy (N mm)")
    axes.legend(frameon=False, fontsize=8, loc="upper left", bbox_to_anchor=(1.0, 1.0))

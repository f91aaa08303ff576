"""Figures of the suspects: how probable, how alike, and which test would separate them."""

from __future__ import annotations

from collections.abc import Sequence

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure

from ramiefenics.discovery.curves.blocks import Array
from ramiefenics.discovery.planning.plan import Plan
from ramiefenics.discovery.report.outcome import Discovery
from ramiefenics.discovery.report.wording import listed
from ramiefenics.discovery.statistics.causes import SURE
from ramiefenics.discovery.statistics.verdict import ENOUGH
from ramiefenics.results.style import GREY, STYLE, VERMILION

MOST_SUSPECTS = 15
"""Maximum number of suspects drawn, the most probable first."""

MOST_SETS = 8
"""Maximum number of sets of effects drawn, the most probable first."""

LEAST_PROBABLE = 1e-6
"""Probability below which sets of effects are drawn as a triangle at this one."""

WIDTH = 8.0
"""Width of the figures, inch."""


def suspects_figure(found: Discovery) -> Figure:
    """Draw how probable every suspect is, and how large it may be without being noticed."""
    probable, names = found.posterior.inclusion(), _drawn(found)
    with mpl.rc_context(STYLE):
        height = 1.2 + 0.3 * max(len(names), 2)
        figure = Figure(figsize=(WIDTH, height), layout="constrained")
        left, right = figure.subplots(1, 2, sharey=True)
        labels = [name.replace("_", " ") for name in names]
        colours = [VERMILION if name in found.causes else GREY for name in names]
        left.barh(labels, [probable[n] for n in names], color=colours)
        left.axvline(SURE, color="k", lw=1.0, ls="--")
        left.set_xlim(0.0, 1.02)
        left.set_xlabel("Probability that it is present")
        right.barh(labels, [100.0 * found.limits[n].share for n in names], color=colours)
        right.set_xlabel("Largest effect not excluded (% of peak)")
        for axes in (left, right):
            axes.grid(axis="y", visible=False)
    return figure


def _drawn(found: Discovery) -> list[str]:
    """Return the suspects that are drawn, the most probable last."""
    probable = found.posterior.inclusion()
    names = sorted(found.limits, key=lambda n: (probable[n], found.limits[n].share))
    return names[-MOST_SUSPECTS:]


def sets_figure(found: Discovery) -> Figure:
    """Draw the posterior probabilities of the best sets of effects, and of no effect."""
    posterior = found.posterior
    order = [int(row) for row in np.argsort(-posterior.probability, kind="stable")[:MOST_SETS]]
    rows = order if 0 in order else [*order[: MOST_SETS - 1], 0]
    sets = [[posterior.names[k] for k in posterior.sets[row]] for row in rows]
    labels = [listed(names) if names else "no effect" for names in sets]
    shares = np.maximum(posterior.probability[rows], LEAST_PROBABLE)
    colours = [VERMILION if found.causes and row == order[0] else GREY for row in rows]
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(WIDTH, 1.2 + 0.3 * max(len(rows), 2)), layout="constrained")
        axes = figure.subplots()
        for label, share, colour in zip(labels, shares, colours, strict=True):
            axes.plot(share, label, "<" if share == LEAST_PROBABLE else "o", color=colour, ms=7)
        axes.invert_yaxis()
        axes.set_xscale("log")
        axes.set_xlim(min(0.5 * shares.min(), 0.005), 1.5)
        axes.set_xlabel("Probability of exactly this set of effects")
    return figure


def alike_figure(found: Discovery) -> Figure:
    """Draw the cosines of the signatures of the most probable suspects."""
    names = _drawn(found)[::-1]
    cosines = np.eye(len(names))
    for (a, b), cosine in found.alike.items():
        if a in names and b in names:
            i, j = names.index(a), names.index(b)
            cosines[i, j] = cosines[j, i] = cosine
    return cosine_figure(names, cosines)


def cosine_figure(names: Sequence[str], cosines: Array) -> Figure:
    """Draw absolute values of the cosines between signatures.

    Parameters
    ----------
    names
        Names of the effects.
    cosines
        Cosines, shape (p, p).
    """
    labels = [name.replace("_", " ") for name in names]
    with mpl.rc_context(STYLE | {"axes.grid": False}):
        figure = Figure(figsize=(WIDTH, 2.2 + 0.25 * max(len(names), 6)), layout="constrained")
        axes = figure.subplots()
        shape = (len(names), len(names))
        image = axes.imshow(np.abs(cosines).reshape(shape), cmap="cividis", vmin=0.0, vmax=1.0)
        axes.set_xticks(range(len(names)), labels, rotation=90)
        axes.set_yticks(range(len(names)), labels)
        figure.colorbar(image, label="|cosine|", shrink=0.8)
    return figure


def next_figure(plan: Plan) -> Figure:
    """Draw how well each test would separate the two effects that are hardest to tell apart."""
    labels = [
        "tests like these" if found is plan.alone else f"a second test with\n{what}"
        for what, found in plan.powers.items()
    ]
    weakest = [found.weakest for found in plan.powers.values()]
    best = plan.powers[plan.next_experiment]
    colours = [
        VERMILION if found is best and found is not plan.alone else GREY
        for found in plan.powers.values()
    ]
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(WIDTH, 1.0 + 0.5 * len(labels)), layout="constrained")
        axes = figure.subplots()
        axes.barh(labels, weakest, color=colours)
        axes.axvline(ENOUGH, color="k", lw=1.0, ls="--")
        axes.invert_yaxis()
        axes.set_xlabel("Expected log-evidence between the two most similar effects")
        axes.grid(axis="y", visible=False)
    return figure

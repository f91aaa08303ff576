"""The report of verification studies: Markdown, with a figure each."""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from pathlib import Path

import matplotlib as mpl
import pandas as pd
from matplotlib.figure import Figure

from ramiefenics.results.draft import draft
from ramiefenics.results.figures import BLUE, GREEN, ORANGE, PURPLE, SKY, STYLE, VERMILION
from ramiefenics.results.manifest import versions
from ramiefenics.verification import Plot, Study

NAME = "verification"

COLOURS = (BLUE, VERMILION, GREEN, PURPLE, ORANGE, SKY)
MARKERS = "osD^vx"

HEAD = """# Verification

What the solver claims, each claim with the command that checks it: `./run ramiefenics verify NAME`,
or all of them by `./run ramiefenics verify --out docs`, which wrote this page. The tests run every
study too, and besides: energy, stress and tangent of the laws against finite differences, the
linearisation against the stiffness, objectivity (`tests/test_laws.py`); jumps
(`tests/test_jump.py`); two ranks against one (`tests/test_parallel.py`). How the answer depends on
mesh and steps is in [convergence.md](convergence.md); a second solver, with inertia and explicit
time steps, checks the whole curve in [explicit.md](explicit.md).

"""


def write_verification(studies: Mapping[str, Study], folder: str | Path) -> Path:
    """Write `verification.md`, and a picture for every plot into the folder `verification`.

    They take the place of an earlier report, all at once.

    Returns
    -------
    Path
        The page.
    """
    folder = Path(folder)
    with draft(folder) as made:
        (made / NAME).mkdir()
        for name, study in studies.items():
            if study.plot is not None:
                plot_figure(study.plot).savefig(made / NAME / f"{name}.png")
        (made / f"{NAME}.md").write_text(report(studies), encoding="utf-8")
    return folder / f"{NAME}.md"


def report(studies: Mapping[str, Study]) -> str:
    """Return the page."""
    used = ", ".join(f"{package} {version}" for package, version in versions().items())
    claims = pd.DataFrame(
        [
            {
                "study": f"[{name}](#{_anchor(study.title)})",
                "claim": check.what,
                "found": f"{check.value:.6g}",
                "allowed": check.limits,
                "because": check.why,
                "holds": "yes" if check.passed else "**no**",
            }
            for name, study in studies.items()
            for check in study.checks
        ]
    )
    parts = [HEAD + f"Versions: {used}.\n", markdown(claims)]
    for name, study in studies.items():
        parts += [f"## {study.title}\n", f"`./run ramiefenics verify {name}`. {study.text}\n"]
        if study.plot is not None:
            parts.append(f"![{study.title}]({NAME}/{name}.png)\n")
        if not study.table.empty:
            parts.append(markdown(study.table))
    return "\n".join(parts)


def _anchor(title: str) -> str:
    """Return how GitHub links to a heading."""
    kept = "".join(c for c in title.lower() if c.isalnum() or c in " -")
    return kept.replace(" ", "-")


def markdown(table: pd.DataFrame) -> str:
    """Return a table in Markdown."""

    def cell(value: object) -> str:
        if isinstance(value, float):
            return "" if value != value else f"{value:.6g}"  # NaN is not itself
        return str(value)

    lines = ["| " + " | ".join(map(str, table.columns)) + " |", "|---" * len(table.columns) + "|"]
    lines += ["| " + " | ".join(map(cell, row)) + " |" for row in table.itertuples(index=False)]
    return "\n".join(lines) + "\n"


def plot_figure(plot: Plot) -> Figure:
    """Draw a plot."""
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(5.5, 3.8), layout="constrained")
        axes = figure.subplots()
        styles = zip(itertools.cycle(COLOURS), itertools.cycle(MARKERS), strict=False)
        for series, (colour, marker) in zip(plot.series, styles, strict=False):
            (line,) = axes.plot(series.x, series.y, color=colour, ms=4.5, label=series.label)
            line.set_marker(marker if series.points or plot.log else "")
            line.set_linestyle("none" if series.points else "-")
        if plot.log:
            axes.set_xscale("log")
            axes.set_yscale("log")
        axes.set_xlabel(plot.x_label)
        axes.set_ylabel(plot.y_label)
        if len(plot.series) > 1:
            axes.legend(frameon=False)
    return figure

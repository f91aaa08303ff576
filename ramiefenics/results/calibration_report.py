"""A calibration on one page of HTML that needs no other file."""

from __future__ import annotations

import html
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import pandas as pd

from ramiefenics.calibration.calibrate import Calibration
from ramiefenics.calibration.responses import response
from ramiefenics.calibration.selection import RULES
from ramiefenics.results.html import figure, frame, page, table

CAPTIONS = {
    "curves": "Force curves of all runs, and of the optimum.",
    "optimum": "The set of equally good parameters: the share of the other factors' values that "
    "serve, over every two. Star: the point of the set nearest to the centre of the ranges, which "
    "is as good as any other. Where no point meets the targets: all that miss them about as "
    "much.",
    "desirability": "How far all wishes are met together. Star: the most desirable point.",
    "level": "Where the response is exactly the target, and a standard error beside: any point of "
    "the surface is as good as any other.",
    "profiles": "Profile likelihood: how much chi-squared rises when one parameter is moved and "
    "all others are adjusted. Where the curve stays below the dashed line the data do not object.",
    "posterior": "Posterior over a flat prior in the region of the design.",
    "contours": "Response surface; white: runs; star: optimum; dashed: the target; dotted: within "
    "two standard errors of it.",
    "surface": "Response surface over the two factors that change it most.",
    "diagnostics": "What the surface leaves.",
}


def report(found: Calibration, summary: Mapping[str, Any], pictures: Sequence[Path]) -> str:
    """Return the page.

    Parameters
    ----------
    found
        The study.
    summary
        As it is written.
    pictures
        PNG files, named as in `CAPTIONS`, with the response's name behind an underscore.
    """
    general = [p for p in pictures if p.stem in CAPTIONS]
    findings = "".join(f"<li>{html.escape(text)}</li>" for text in found.findings())
    parts = [
        f'<ul class="lead">{findings}</ul>' if findings else "",
        *(figure(picture, CAPTIONS[picture.stem]) for picture in general),
        _parameters(summary),
        "<h2>Design</h2>",
        _design(found),
        frame(found.runs),
    ]
    for name in found.surfaces:
        of_it = [p for p in pictures if p.stem.endswith(f"_{name}")]
        parts.append(_surface(found, name, of_it))
    parts += [
        "<h2>Made with</h2>",
        table(("program", "version"), list(summary["versions"].items())),
    ]
    return page(found.study.title or "Designed study", "\n".join(parts))


def _parameters(summary: Mapping[str, Any]) -> str:
    if "identifiability" not in summary:
        return ""
    return f"<h2>What the data fix</h2>{frame(pd.DataFrame(summary['identifiability']))}"


def _design(found: Calibration) -> str:
    ranges = [
        (f.name, f.title, ", ".join(f.keys), f"{f.low:g}", f"{f.high:g}")
        for f in found.space.factors
    ]
    told = (
        f"{found.design.kind.capitalize()}, {len(found.design.coded)} runs, of which "
        f"{found.campaign.distinct} differ; {found.campaign.cpu_s:.0f} s of processor time; mesh "
        f"recipe {found.baseline.numerics.mesh.name}. The ends of a range are coded "
        f"-{found.space.coded_high:.4g} and {found.space.coded_high:.4g}."
    )
    head = ("factor", "what", "keys", "low", "high")
    return f"<p>{html.escape(told)}</p>{table(head, ranges)}"


def _surface(found: Calibration, name: str, pictures: Sequence[Path]) -> str:
    surface = found.surfaces[name]
    title = html.escape(response(name).label)
    notes = "".join(f"<p>{html.escape(text)}</p>" for text in surface.notes())
    rule = f"{found.study.polynomial} model; {RULES[found.study.selection]}."
    drawn = "".join(figure(p, CAPTIONS[p.stem.removesuffix(f"_{name}")]) for p in pictures)
    quality = pd.DataFrame([surface.quality])
    return f"""<h2>{title}</h2><p>Kept of the {html.escape(rule)}</p>{notes}{drawn}
<h3>Coefficients, in coded units</h3>{frame(surface.coefficients())}
<h3>Analysis of variance</h3>{frame(surface.anova())}{frame(quality)}"""

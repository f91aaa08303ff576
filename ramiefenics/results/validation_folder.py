"""The folder of a validation: tables, figures, manifest, report."""

from __future__ import annotations

import html
import json
from pathlib import Path
from typing import Any

import pandas as pd

from ramiefenics.results.draft import draft
from ramiefenics.results.html import figure, frame, page, table
from ramiefenics.results.manifest import finite, versions
from ramiefenics.results.validation_figures import nuisance_figure, prediction_figure
from ramiefenics.specification.files import to_dict
from ramiefenics.validation import Validation

CAPTIONS = {
    "predictions": "What was measured, and what each predictor says. Star: calibrated on.",
    "nuisance": "How far a factor moves the predictions, from the lower to the upper fifth of its "
    "range, on average over the stalks predicted and all other factors. No bar: the calibration "
    "rules out one of the fifths.",
}


def write_validation(found: Validation, folder: str | Path) -> Path:
    """Write the tables, figures, manifest and report of a validation.

    ``predictions.csv`` has one row per split and observation, ``scores.csv`` one per split and
    predictor, ``factors.csv`` priors and what the calibration leaves of them, ``swings.csv`` how
    far each factor moves each prediction, ``runs.csv`` all simulations of the designs,
    ``surfaces.csv`` how well the response surfaces predict them. ``summary.json`` is the manifest,
    ``report.html`` needs no other file. They take the place of an earlier result, all
    at once.

    Returns
    -------
    Path
        The folder; made if it does not exist.
    """
    folder = Path(folder)
    with draft(folder) as made:
        written = validation_tables(found)
        for name, content in written.items():
            content.to_csv(made / f"{name}.csv", index=False, float_format="%.8g")
        pictures = []
        for number, assessment in enumerate(found.assessments, start=1):
            drawn = {
                "predictions": prediction_figure(found, assessment),
                "nuisance": nuisance_figure(found, assessment),
            }
            for name, picture in drawn.items():
                pictures.append(made / f"{name}_{number}.png")
                picture.savefig(pictures[-1])
        summary = finite(_summary(found, written))
        (made / "summary.json").write_text(json.dumps(summary, indent=2) + "\n", encoding="utf-8")
        (made / "report.html").write_text(_report(found, written, pictures), encoding="utf-8")
    return folder


def validation_tables(found: Validation) -> dict[str, pd.DataFrame]:
    """Return all tables, by the name of their file."""
    by_split: dict[str, Any] = {
        "predictions": found.table,
        "scores": found.scores,
        "factors": found.factors,
        "swings": found.swings,
    }
    tables = {
        name: _stacked({a.split.title: make(a) for a in found.assessments}, "split")
        for name, make in by_split.items()
    }
    observed = found.observed.items()
    tables["runs"] = _stacked({name: seen.found.runs for name, seen in observed}, "observation")
    qualities = {
        name: pd.DataFrame([seen.found.surfaces[found.study.response].quality])
        for name, seen in observed
    }
    tables["surfaces"] = _stacked(qualities, "observation")
    return tables


def _stacked(parts: dict[str, pd.DataFrame], label: str) -> pd.DataFrame:
    stacked = pd.concat(parts, names=[label])
    return stacked.reset_index(level=0).reset_index(drop=True)


def _summary(found: Validation, tables: dict[str, pd.DataFrame]) -> dict[str, Any]:
    campaigns = [seen.found.campaign for seen in found.observed.values()]
    return {
        "title": found.study.title,
        "findings": found.findings(),
        "predictions": tables["predictions"].to_dict("records"),
        "scores": tables["scores"].to_dict("records"),
        "simulations": sum(campaign.distinct for campaign in campaigns),
        "simulated_now": sum(campaign.simulated for campaign in campaigns),
        "cpu_s": sum(campaign.cpu_s for campaign in campaigns),
        "completed": found.completed,
        "study": {k: part for k, part in to_dict(found.study).items() if k != "folder"},
        "versions": versions(),
        "specifications": {n: to_dict(seen.found.baseline) for n, seen in found.observed.items()},
    }


def _report(found: Validation, tables: dict[str, pd.DataFrame], pictures: list[Path]) -> str:
    findings = "".join(f"<li>{html.escape(text)}</li>" for text in found.findings())
    parts = [f'<ul class="lead">{findings}</ul>']
    for number, assessment in enumerate(found.assessments, start=1):
        title = assessment.split.title
        parts.append(f"<h2>{html.escape(title)}</h2>")
        drawn = [p for p in pictures if p.stem.endswith(f"_{number}")]
        parts += [figure(p, CAPTIONS[p.stem.removesuffix(f"_{number}")]) for p in drawn]
        for name in ("predictions", "scores", "factors"):
            own = tables[name][tables[name]["split"] == title].drop(columns="split")
            parts.append(f"<h3>{name.capitalize()}</h3>{frame(own)}")
    parts += [
        "<h2>Response surfaces</h2>",
        frame(tables["surfaces"]),
        "<h2>Made with</h2>",
        table(("program", "version"), list(versions().items())),
    ]
    return page(found.study.title or "Validation", "\n".join(parts))

"""The folder of a calibration: tables, figures, specification, manifest, report."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from ramiefenics.calibration.calibrate import Calibration, Fit
from ramiefenics.results.calibration_figures import (
    curves_figure,
    desirability_figure,
    level_figure,
    optimum_figure,
    posterior_figure,
    profile_figure,
)
from ramiefenics.results.calibration_report import report
from ramiefenics.results.draft import draft
from ramiefenics.results.manifest import finite, versions
from ramiefenics.results.surface_figures import contour_figure, diagnostics_figure, surface_figure
from ramiefenics.specification import write_test
from ramiefenics.specification.files import to_dict

LISTED = 1000
"""Equally good points that are written."""


def write_calibration(found: Calibration, folder: str | Path) -> Path:
    """Write the tables, figures, specification, manifest and report of a study.

    ``runs.csv`` has the design with responses; ``coefficients.csv``, ``anova.csv``,
    ``quality.csv`` and ``diagnostics.csv`` the surfaces. Where something was measured:
    ``optimum_set.csv``, the best and other equally good parameters; ``identifiability.csv``, one
    row per parameter; ``information.csv``, one per combination; ``calibrated.toml`` for
    ``ramiefenics bend``. Where there are wishes: ``desirable.toml``. ``summary.json`` is the
    manifest, ``report.html`` needs no other file. They take the place of an earlier result, all
    at once.

    Returns
    -------
    Path
        The folder; made if it does not exist.
    """
    folder = Path(folder)
    with draft(folder) as made:
        for name, table in tables(found).items():
            table.to_csv(made / f"{name}.csv", index=False, float_format="%.8g")
        write_test(found.baseline, made / "baseline.toml")
        if found.fit is not None:
            write_test(found.fit.test, made / "calibrated.toml")
        if found.desired is not None:
            write_test(found.desired.test, made / "desirable.toml")
        pictures = _draw(found, made)
        summary = summarise_calibration(found)
        (made / "summary.json").write_text(json.dumps(summary, indent=2) + "\n", encoding="utf-8")
        (made / "report.html").write_text(report(found, summary, pictures), encoding="utf-8")
    return folder


def _draw(found: Calibration, folder: Path) -> list[Path]:
    """Write all figures, and return their files."""
    figures = {"curves": curves_figure(found)}
    if found.fit is not None:
        if len(found.space.factors) > 1:
            figures["optimum"] = optimum_figure(found, found.fit)
        single = len(found.fit.misfit.surfaces) == 1
        if len(found.space.factors) == 3 and single and found.fit.optimum.met:
            figures["level"] = level_figure(found, found.fit)
        figures["profiles"] = profile_figure(found, found.fit)
        figures["posterior"] = posterior_figure(found, found.fit)
    if found.desired is not None and len(found.space.factors) > 1:
        figures["desirability"] = desirability_figure(found, found.desired)
    for name, surface in found.surfaces.items():
        if len(found.space.factors) > 1:
            figures[f"contours_{name}"] = contour_figure(found, name)
            figures[f"surface_{name}"] = surface_figure(found, name)
        figures[f"diagnostics_{name}"] = diagnostics_figure(surface)
    for name, figure in figures.items():
        figure.savefig(folder / f"{name}.png")
    return [folder / f"{name}.png" for name in figures]


def tables(found: Calibration) -> dict[str, pd.DataFrame]:
    """Return all tables, by the name of their file."""
    made = {"runs": found.runs}
    for name in ("coefficients", "anova", "diagnostics"):
        parts = []
        for response, surface in found.surfaces.items():
            part: pd.DataFrame = getattr(surface, name)()
            part.insert(0, "response", response)
            parts.append(part)
        made[name] = pd.concat(parts, ignore_index=True)
    rows = [{"response": n, **surface.quality} for n, surface in found.surfaces.items()]
    made["quality"] = pd.DataFrame(rows)
    if found.fit is not None:
        made["optimum_set"] = optimum_set(found, found.fit)
        made["identifiability"] = identifiability(found, found.fit)
        made["information"] = information_table(found, found.fit)
    return made


def optimum_set(found: Calibration, fit: Fit) -> pd.DataFrame:
    """Return the best point, first, and others that are as good: natural and coded values."""
    good = fit.optimum.good[:LISTED]
    table = pd.DataFrame(found.space.natural(good), columns=list(found.space.names))
    for column, name in enumerate(found.space.names):
        table[f"{name}_coded"] = good[:, column]
    predicted = fit.misfit.predict(good)
    for column, name in enumerate(fit.misfit.targets.names):
        table[name] = predicted[:, column]
    table["chi2"] = fit.misfit.of(good)
    return table


def identifiability(found: Calibration, fit: Fit) -> pd.DataFrame:
    """Return one row per parameter: interval, verdict, and what the posterior says."""
    low, median, high = found.space.natural(fit.posterior.quantiles(0.025, 0.5, 0.975))
    contraction = fit.posterior.contraction
    rows = []
    for index, (factor, profile) in enumerate(zip(found.space.factors, fit.profiles, strict=True)):

        def natural(coded: float | None, index: int = index) -> float:
            if coded is None:
                return math.nan
            point = np.zeros(len(found.space.factors))
            point[index] = coded
            return float(found.space.natural(point)[index])

        rows.append(
            {
                "parameter": factor.name,
                "title": factor.title,
                "baseline": factor.baseline(found.baseline),
                "optimum": natural(float(fit.optimum.best[index])),
                "low": natural(profile.low),
                "high": natural(profile.high),
                "verdict": profile.verdict,
                "share_of_range": profile.share,
                "posterior_low": low[index],
                "posterior_median": median[index],
                "posterior_high": high[index],
                "contraction": contraction[index],
            }
        )
    return pd.DataFrame(rows)


def information_table(found: Calibration, fit: Fit) -> pd.DataFrame:
    """Return one row per combination of parameters, the best known first; coded."""
    told = fit.information
    table = pd.DataFrame(told.directions, columns=list(found.space.names))
    known = {
        "eigenvalue": told.eigenvalues,
        "standard_error": told.errors,
        "determined": told.determined,
    }
    return pd.concat([pd.DataFrame(known), table], axis=1)


def summarise_calibration(found: Calibration) -> dict[str, Any]:
    """Return findings, numbers and the manifest, ready for JSON."""
    summary: dict[str, Any] = {
        "title": found.study.title,
        "findings": found.findings(),
        "design": {
            "kind": found.design.kind,
            "runs": len(found.design.coded),
            "distinct": found.campaign.distinct,
            "alpha": found.design.alpha,
        },
        "simulated_now": found.campaign.simulated,
        "cpu_s": found.campaign.cpu_s,
        "completed": found.completed,
        "surfaces": {
            name: {
                "coefficients_coded": dict(zip(s.labels, s.fit.params, strict=True)),
                **s.quality,
                "notes": s.notes(),
            }
            for name, s in found.surfaces.items()
        },
    }
    if found.fit is not None:
        summary |= _summarise_fit(found, found.fit)
    if found.desired is not None:
        best = found.space.natural(found.desired.best)
        summary["desirable"] = {
            "natural": dict(zip(found.space.names, best, strict=True)),
            "desirability": found.desired.worth,
        }
    summary |= {
        "study": _study(found),
        "mesh": found.baseline.numerics.mesh.name,
        "versions": versions(),
        "specification": to_dict(found.baseline),
    }
    cleaned: dict[str, Any] = finite(summary)
    return cleaned


def _summarise_fit(found: Calibration, fit: Fit) -> dict[str, Any]:
    optimum, targets = fit.optimum, fit.misfit.targets
    best = found.space.natural(optimum.best)
    result = None if fit.confirmation is None else fit.confirmation.result
    return {
        "targets": dict(zip(targets.names, targets.values, strict=True)),
        "target_covariance": [list(row) for row in targets.covariance],
        "optimum": {
            "natural": dict(zip(found.space.names, best, strict=True)),
            "coded": dict(zip(found.space.names, optimum.best, strict=True)),
            "predicted": dict(zip(targets.names, optimum.predicted, strict=True)),
            "simulated_max_force_N": None if result is None else result.max_force_N,
            "chi2": optimum.misfit,
            "targets_met": optimum.met,
            "discrepancy": list(fit.misfit.discrepancy),
            "share_of_region_as_good": optimum.share,
        },
        "identifiability": identifiability(found, fit).to_dict("records"),
        "posterior_chain_length": fit.posterior.chain_length,
    }


def _study(found: Calibration) -> dict[str, Any]:
    return {name: part for name, part in to_dict(found.study).items() if name != "folder"}

"""The folder of a discovery: verdict, extended specification, figures, report."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path
from typing import Any

import numpy as np

from ramiefenics.discovery import Discovery
from ramiefenics.discovery.evidence import Array
from ramiefenics.discovery.verdict import Gain
from ramiefenics.results.discovery_figures import (
    left_out_figure,
    residual_figure,
    suspects_figure,
)
from ramiefenics.results.discovery_findings import findings
from ramiefenics.results.discovery_report import report
from ramiefenics.results.draft import draft
from ramiefenics.results.manifest import versions
from ramiefenics.specification import write_test
from ramiefenics.specification.files import to_dict


def write_discovery(found: Discovery, folder: str | Path) -> Path:
    """Write ``verdict.json``, ``baseline.toml``, ``extended.toml``, figures and ``report.html``.

    ``extended.toml`` is there if a cause was named. They take the place of an earlier
    result, all at once.

    Returns
    -------
    Path
        The folder; made if it does not exist.
    """
    folder = Path(folder)
    verdict = summarise_discovery(found)
    with draft(folder) as made:
        (made / "verdict.json").write_text(json.dumps(verdict, indent=2) + "\n", encoding="utf-8")
        write_test(found.baseline_test(), made / "baseline.toml")
        if found.verdict == "cause":
            write_test(found.extended_test(), made / "extended.toml")
        residual_figure(found).savefig(made / "residual.png")
        suspects_figure(found).savefig(made / "suspects.png")
        left_out_figure(found).savefig(made / "left_out.png")
        pictures = [made / f"{stem}.png" for stem in ("residual", "suspects", "left_out")]
        (made / "report.html").write_text(report(found, verdict, pictures), encoding="utf-8")
    return folder


def _gain(gain: Gain | None) -> dict[str, Any] | None:
    if gain is None:
        return None
    return {
        "rmse_before": gain.rmse_before_N,
        "rmse_after": gain.rmse_after_N,
        "ratio": gain.ratio,
        "interval": list(gain.interval),
        "shown": gain.shown,
    }


def summarise_discovery(found: Discovery) -> dict[str, Any]:
    """Return the verdict, its numbers and the manifest, ready for JSON."""
    amplitudes = {
        name: {
            "value": found.scores[name].amplitude,
            "interval": list(found.interval(name)),
            "unit": found.effects[name].unit,
        }
        for name in found.causes
    }
    fitted = found.fitted
    peak = found.observed.peak_N[:, None]
    return {
        "verdict": found.verdict,
        "findings": findings(found),
        "causes": list(found.causes),
        "amplitudes": amplitudes,
        "explained": found.explained,
        "p_value": found.p_value,
        "baseline_misfit_p_value": found.baseline_misfit_p_value,
        "misfit_p_value": found.misfit_p_value,
        "gain": _gain(found.gain),
        "shape_gain": _gain(found.shape_gain),
        "scores": {name: dataclasses.asdict(score) for name, score in found.scores.items()},
        "confusable_with": list(found.confusable_with),
        "log_factors": {
            factor.name: float(value)
            for factor, value in zip(fitted.curves.model.factors, fitted.log_factors, strict=True)
        },
        "log_factors_over_sd": found.factor_moves,
        "scatter": dataclasses.asdict(fitted.fit.scatter),
        "specimens": [specimen.name for specimen in found.dataset.specimens],
        "range_mm": list(found.dataset.range_mm),
        "dataset": to_dict(found.dataset.layout),
        "specification": to_dict(found.dataset.baseline),
        "simulations": found.simulations,
        "mesh": found.dataset.specimens[0].test.numerics.mesh.name,
        "mesh_correction": _largest(fitted.curves.mesh_correction / peak),
        "put_down_to_simulator": _largest(fitted.remaining()[1]),
        "versions": versions(),
    }


def _largest(shares: Array) -> float:
    """Return the mean over specimens, shape (n, m), where it is largest."""
    mean = shares.mean(axis=0)
    return float(mean[np.abs(mean).argmax()])

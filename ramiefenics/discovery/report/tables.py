"""Tables and numbers of a discovery."""

from __future__ import annotations

import dataclasses
import math
from typing import TYPE_CHECKING, Any

import pandas as pd

from ramiefenics.discovery.report.wording import with_space
from ramiefenics.results.result import Table
from ramiefenics.specification.files import to_dict

if TYPE_CHECKING:
    from ramiefenics.discovery.report.outcome import Discovery

IMITATORS = 3
"""Maximum number of imitators listed for a suspect."""


def overview(found: Discovery) -> pd.DataFrame:
    """Return a table of the suspects, the most probable first."""
    inclusion = dict.fromkeys(found.effects, 0.0) | found.posterior.inclusion()
    names = sorted(inclusion, key=lambda name: -inclusion[name])
    return pd.DataFrame([_row(found, name, inclusion[name]) for name in names])


def _row(found: Discovery, name: str, probability: float) -> dict[str, str]:
    row = dict.fromkeys(("probability", "amplitude", "not excluded", "of the peak"), "")
    imitators = ""
    if name in found.limits:
        unit = with_space(found.effects[name].unit)
        limit, fitted = found.limits[name], name in found.amplitudes
        low, high = found.interval(name) if fitted else (limit.low, limit.high)
        row = {
            "probability": f"{probability:.2f}",
            "amplitude": f"{found.amplitudes[name]:.3g}{unit}" if fitted else "",
            "not excluded": f"{low:.2g} to {high:.2g}{unit}",
            "of the peak": f"{100 * limit.share:.2g} %",
        }
        imitators = ", ".join(limit.imitated_by[:IMITATORS])
    remark = found.reasons.get(name, "")
    return {"suspect": name, **row, "imitated by": imitators, "remark": remark}


def numbers(found: Discovery) -> dict[str, Any]:
    """Return the verdict, and what it rests on, for the summary."""
    mesh, left = found.corrections()
    gains = {name: getattr(found, name) for name in ("gain", "shape_gain", "condition_gain")}
    return {
        "verdict": found.verdict,
        "causes": found.causes,
        "groups": found.groups,
        "amplitudes": {
            name: {
                "value": value,
                "interval": found.interval(name),
                "sd_between_specimens": found.sd_between_specimens.get(name),
                "unit": effect.unit,
            }
            for name, value in found.amplitudes.items()
            for effect in [found.effects[name]]
        },
        "explained": found.explained,
        "p_value": found.p_value,
        "fitted_none": found.fitted_none,
        "baseline_misfit_p_value": found.baseline_misfit_p_value,
        "misfit_p_value": found.misfit_p_value,
        "conflict_p_value": found.conflict_p_value,
        **{name: None if gain is None else gain.numbers() for name, gain in gains.items()},
        "anatomy": None if found.anatomy is None else found.anatomy.numbers(),
        "probability_of_any": 1.0 - found.posterior.none,
        "probabilities": found.posterior.inclusion(),
        "limits": {name: dataclasses.asdict(limit) for name, limit in found.limits.items()},
        "next_experiment": found.next_experiment,
        "reasons": dict(found.reasons),
        "confusable_with": found.confusable_with,
        "broken": found.broken,
        "log_factors": dict(zip(found.factor_moves, found.mean_log_factors(), strict=True)),
        "log_factors_over_sd": found.factor_moves,
        "scatter": dataclasses.asdict(found.fitted.fit.scatter),
        "specimens": list(found.dataset.specimens),
        "range_mm": found.dataset.range_mm,
        "dataset": to_dict(found.dataset.layout),
        "specification": to_dict(found.dataset.baseline),
        **dataclasses.asdict(found.effort),
        "mesh": found.mesh,
        "mesh_correction": mesh,
        "put_down_to_simulator": left,
    }


def tables(found: Discovery) -> dict[str, Table]:
    """Return the suspects' physics, the fitted factors, and how alike signatures are."""
    physics = [(n, e.physics, e.reference) for n, e in found.effects.items()]
    sd, moves = found.dataset.layout.fit_sd, found.factor_moves
    factors = [(name, math.exp(sd * move), move) for name, move in moves.items()]
    alike = [(*pair, cosine) for pair, cosine in found.alike.items()]
    alike.sort(key=lambda row: -abs(row[2]))
    return {
        "suspects": Table(
            pd.DataFrame(physics, columns=["suspect", "physics", "reference"]),
            "The suspects, their physics and references.",
        ),
        "factors": Table(
            pd.DataFrame(factors, columns=["factor", "value", "over_sd"]),
            "Fitted factors, mean of the specimens, and their logarithms in units of fit_sd.",
        ),
        "alike": Table(
            pd.DataFrame(alike, columns=["suspect", "other", "cosine"]),
            "Similarity of signatures after removal of what factors and simulator can imitate: "
            "where the cosine is near 1 or -1, these data cannot tell the two apart.",
        ),
    }

"""The folder of a mesh-convergence study, and the table that sums it up."""

from __future__ import annotations

import dataclasses
import json
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pandas as pd

from ramiefenics.convergence import Convergence, Extrapolation
from ramiefenics.results.convergence_figures import curves_figure, error_figure
from ramiefenics.results.draft import draft
from ramiefenics.results.manifest import versions
from ramiefenics.specification import write_test
from ramiefenics.specification.files import to_dict


def write_convergence(study: Convergence, folder: str | Path) -> Path:
    """Write the tables, figures and manifest of a study.

    ``convergence.csv`` has one row per mesh, ``richardson.csv`` one per quantity, ``curves.csv``
    the curves that ``curves.png`` shows; ``error.png``, ``summary.json``, ``specification.toml``.
    They take the place of an earlier result, all at once.

    Returns
    -------
    Path
        The folder; made if it does not exist.
    """
    folder = Path(folder)
    with draft(folder) as made:
        study.meshes.to_csv(made / "convergence.csv", index=False, float_format="%.8g")
        richardson(study).to_csv(made / "richardson.csv", index=False, float_format="%.8g")
        _curves(study).to_csv(made / "curves.csv", index=False, float_format="%.8g")
        summary = json.dumps(summarise_convergence(study), indent=2)
        (made / "summary.json").write_text(summary + "\n", encoding="utf-8")
        write_test(study.test, made / "specification.toml")
        curves_figure(study).savefig(made / "curves.png")
        error_figure(study).savefig(made / "error.png")
    return folder


def richardson(study: Convergence) -> pd.DataFrame:
    """Return one row per quantity: the fields of `Extrapolation`, and what is behind them."""
    rows = []
    for name, found in study.quantities.items():
        values = study.meshes[name]
        finest = study.meshes["mesh"][values.notna()].iloc[-3:]
        rows.append(
            {
                "quantity": name,
                "meshes": " ".join(finest),
                "finest_value": values.dropna().iloc[-1] if values.notna().any() else math.nan,
                **dataclasses.asdict(found),
                "uncertainty": found.uncertainty,
            }
        )
    return pd.DataFrame(rows)


def _curves(study: Convergence) -> pd.DataFrame:
    parts = []
    for name, run in zip(study.meshes["mesh"], study.runs, strict=True):
        part = run.result.curve[["displacement_mm", "force_N"]].copy()
        part.insert(0, "mesh", name)
        parts.append(part)
    return pd.concat(parts)


def summarise_convergence(study: Convergence) -> dict[str, Any]:
    """Return numbers and manifest of a study, ready for JSON."""
    meshes = {}
    for name, run in zip(study.meshes["mesh"], study.runs, strict=True):
        result = run.result
        meshes[name] = {
            **dataclasses.asdict(result.statistics),
            "cpu_s": run.cpu_s,
            "ending": dataclasses.asdict(result.ending),
            "lost_at_mm": result.losses_mm,
            "jumps": [dataclasses.asdict(jump) for jump in result.jumps],
            "recipe": to_dict(result.test.numerics.mesh),
        }
    return {
        "order": study.order,
        "completed": study.completed,
        "positions_mm": list(study.positions_mm),
        "quantities": {
            name: {**dataclasses.asdict(found), "uncertainty": found.uncertainty}
            for name, found in study.quantities.items()
        },
        "notes": study.notes(),
        "meshes": meshes,
        "versions": versions(),
        "specification": to_dict(study.test),
    }


def convergence_table(study: Convergence) -> str:
    """Return meshes, then orders, limits and errors under their columns, as text of 80 columns."""
    names = list(study.quantities)
    head = ["mesh", "unknowns", *(_heading(name) for name in names), "iterations", "CPU (s)"]
    rows = [
        [
            row["mesh"],
            f"{row['unknowns']:,}",
            *(_number(row[name], ".2f") for name in names),
            f"{row['newton_iterations']}",
            f"{row['cpu_s']:.1f}",
        ]
        for _, row in study.meshes.iterrows()
    ]
    lines: dict[str, Callable[[Extrapolation], str]] = {
        "": lambda found: BRIEF[found.behaviour],
        "order": lambda found: _number(found.order, ".2f"),
        "limit": lambda found: _number(found.limit, ".2f"),
        "GCI (%)": lambda found: _number(found.gci, ".2f", 100.0),
        "half range (%)": lambda found: _number(found.spread, ".2f", 100.0),
    }
    below = [
        [title, "", *(cell(found) for found in study.quantities.values()), "", ""]
        for title, cell in lines.items()
    ]
    widths = [max(map(len, column)) for column in zip(head, *rows, *below, strict=True)]
    texts = []
    for cells in (head, *rows, *below):
        first, *others = (
            text.ljust(width) if place == 0 else text.rjust(width)
            for place, (text, width) in enumerate(zip(cells, widths, strict=True))
        )
        texts.append("  ".join([first, *others]).rstrip())
    return "\n".join(texts)


BRIEF = {
    "converging": "converges",
    "oscillating": "oscillates",
    "not converging": "no order",
    "unchanged": "unchanged",
    "too few": "too few",
}
"""Behaviours as the table has them."""


def _heading(quantity: str) -> str:
    if quantity.startswith("force_"):
        return f"F({quantity.removeprefix('force_').removesuffix('mm_N')} mm)"
    return {"max_force_N": "max. (N)", "slope_N_per_mm": "N/mm"}[quantity]


def _number(value: float | None, how: str, scale: float = 1.0) -> str:
    return "-" if value is None or math.isnan(value) else format(scale * value, how)

"""The folder of a reduction: tables, figures, manifest."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from ramiefenics.reduction import QUANTITIES, Reduction
from ramiefenics.results.draft import draft
from ramiefenics.results.manifest import versions
from ramiefenics.results.reduction_figures import (
    curves_by_group_figure,
    quantities_by_group_figure,
)
from ramiefenics.specification.files import to_dict


def write_reduction(reduction: Reduction, folder: str | Path) -> Path:
    """Write ``curves.csv``, ``groups.csv``, ``curves.png``, ``quantities.png``, ``manifest.json``.

    They take the place of an earlier result, all at once.

    Returns
    -------
    Path
        The folder; made if it does not exist.
    """
    folder = Path(folder)
    with draft(folder) as made:
        reduction.curves.to_csv(made / "curves.csv", index=False, float_format="%.6g")
        reduction.groups.to_csv(made / "groups.csv", index=False, float_format="%.6g")
        curves_by_group_figure(reduction).savefig(made / "curves.png")
        quantities_by_group_figure(reduction).savefig(made / "quantities.png")
        manifest = json.dumps(summarise_reduction(reduction), indent=2)
        (made / "manifest.json").write_text(manifest + "\n", encoding="utf-8")
    return folder


def summarise_reduction(reduction: Reduction) -> dict[str, Any]:
    """Return what was reduced, how, and by what, ready for JSON."""
    return {
        "dataset_folder": str(reduction.dataset.folder.resolve()),
        "dataset": to_dict(reduction.dataset.layout),
        "specification": to_dict(reduction.dataset.baseline),
        "specimens": len(reduction.curves),
        "by": reduction.by,
        "seed": reduction.seed,
        "units": {name: unit for name, (_, unit) in QUANTITIES.items()},
        "notes": reduction.notes(),
        "versions": versions(),
    }


def reduction_table(reduction: Reduction) -> str:
    """Return groups and their main means with intervals, as text."""
    shown = ("slope_N_per_mm", "peak_N", "strength_MPa")
    lines = []
    for group, part in reduction.groups.groupby("group", sort=False):
        rows = part.set_index("quantity")
        number = int(part.loc[part["quantity"] == "peak_N", "n"].iloc[0])
        cells = [f"{group}, n = {number}"]
        for name in shown:
            row, unit = rows.loc[name], QUANTITIES[name][1]
            interval = f" ({row['low']:.4g} to {row['high']:.4g})" if row["n"] > 1 else ""
            cells.append(f"{QUANTITIES[name][0]} {row['mean']:.4g}{interval} {unit}")
        lines.append("; ".join(cells))
    return "\n".join(lines)

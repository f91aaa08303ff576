"""Bend the published stalks, and one of them as half and as full model; tabulate what came out.

    ./run python benchmarks/published_stalks.py

Writes `docs/published_stalks.json` after every run, skips what is in it already (delete the file to
start afresh), and at the end `docs/published_stalks.md`.
"""

from __future__ import annotations

import json
import warnings
from pathlib import Path
from typing import Any

from ramiefenics import SpecificationWarning, override, published_test, simulate

DOCS = Path(__file__).resolve().parents[1] / "docs"
RECORD = DOCS / "published_stalks.json"

RUNS: dict[str, tuple[str, list[str]]] = {
    "Table 3, standard": ("table3", []),
    "Table 8, first, standard": ("table8-1", []),
    "Table 8, second, standard": ("table8-2", []),
    "Table 8, third, standard": ("table8-3", []),
    "Table 3, screening, quarter": ("table3", ["numerics.mesh=screening"]),
    "Table 3, screening, half": (
        "table3",
        ["numerics.mesh=screening", "numerics.domain=half"],
    ),
    "Table 3, screening, full": (
        "table3",
        ["numerics.mesh=screening", "numerics.domain=full"],
    ),
}

HEAD = """# The published stalks

Made by `./run python benchmarks/published_stalks.py`, on one core of a shared two-core virtual
machine with dolfinx 0.9, forms compiled before. Cylinders of 5 mm radius, an assumption. The model
is elastic and has closure constants that nobody has measured: these are no predictions of the
84.8 N that were.

"""

COLUMNS = {
    "max_force_N": ("max force (N)", ".2f"),
    "displacement_at_max_mm": ("at (mm)", ".1f"),
    "reached_mm": ("reached (mm)", ".1f"),
    "dofs": ("unknowns", "d"),
    "newton_iterations": ("Newton iterations", "d"),
    "cut_backs": ("cut-backs", "d"),
    "wall_s": ("wall time (s)", ".1f"),
}


def run(name: str, assignments: list[str]) -> dict[str, Any]:
    """Bend one stalk."""
    result = simulate(override(published_test(name), assignments))
    statistics = result.statistics
    return {
        "max_force_N": result.max_force_N,
        "displacement_at_max_mm": result.displacement_at_max_mm,
        "reached_mm": float(result.curve["displacement_mm"].iloc[-1]),
        "dofs": statistics.dofs,
        "newton_iterations": statistics.newton_iterations,
        "cut_backs": statistics.cut_backs,
        "wall_s": statistics.wall_s,
        "failure": result.failure,
    }


def table(record: dict[str, dict[str, Any]]) -> str:
    """Return the record as a Markdown table."""
    head = ["run", *(title for title, _ in COLUMNS.values())]
    lines = ["| " + " | ".join(head) + " |", "|---" * len(head) + "|"]
    for label, row in record.items():
        cells = [format(row[key], form) for key, (_, form) in COLUMNS.items()]
        lines.append("| " + " | ".join([label, *cells]) + " |")
    return "\n".join(lines) + "\n"


def main() -> None:
    """Do what is not recorded yet, then write the table."""
    warnings.simplefilter("ignore", SpecificationWarning)
    record = json.loads(RECORD.read_text()) if RECORD.exists() else {}
    for label, (name, assignments) in RUNS.items():
        if label not in record:
            print(label, flush=True)
            record[label] = run(name, assignments)
            RECORD.write_text(json.dumps(record, indent=2) + "\n")
    text = HEAD + table({label: record[label] for label in RUNS})
    (DOCS / "published_stalks.md").write_text(text)


if __name__ == "__main__":
    main()

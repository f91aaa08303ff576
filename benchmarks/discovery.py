"""Hidden effects found: blind tests of measured data, each with one effect in it or none.

    ./run python benchmarks/discovery.py [--cases N]

About five hours on two cores. Every case is made by the full simulator on another mesh of another
element order, and handed to `ramiefenics discover`, a process that sees the folder alone. Keeps
finished cases in `records/discovery.json`, and writes `docs/discovery_cases.md`.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
from record import DOCS, read_record, table, write_record

from ramiefenics.discovery.synthetic import Secret, make_dataset
from ramiefenics.effects import SUSPECTS
from ramiefenics.runs import Runs

CASES_EACH, NULLS = 6, 12
NOTHING = "nothing"


def secrets() -> dict[str, tuple[Secret, int]]:
    """Return secret and seed of every case, effects in turn so that any beginning is mixed."""
    cases: dict[str, tuple[Secret, int]] = {}
    for turn in range(CASES_EACH):
        for number, (name, effect) in enumerate(SUSPECTS.items()):
            seed = 3000 + 10 * turn + number
            sign = np.random.default_rng(seed).choice([-1.0, 1.0]) if effect.bounds[0] < 0 else 1.0
            cases[f"{name} {turn + 1}"] = Secret(effect, float(sign * effect.typical)), seed
        for k in range(NULLS // CASES_EACH):
            number = NULLS // CASES_EACH * turn + k
            cases[f"{NOTHING} {number + 1}"] = Secret(None), 4000 + number
    return cases


def run(secret: Secret, seed: int) -> dict[str, Any]:
    """Make one case, and have it solved by a process that is told nothing else."""
    with tempfile.TemporaryDirectory() as name:
        folder, out = Path(name) / "data", Path(name) / "found"
        make_dataset(folder, secret, seed, Runs())
        start = time.perf_counter()
        command = ["ramiefenics", "discover", str(folder), "--out", str(out)]
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
        verdict = json.loads((out / "verdict.json").read_text())
        wall = time.perf_counter() - start
    kept = ("verdict", "causes", "amplitudes", "p_value", "misfit_p_value", "probabilities")
    gains = ("gain", "shape_gain")
    return {
        "hidden": None if secret.effect is None else secret.effect.name,
        "amplitude": secret.amplitude,
        **{key: verdict[key] for key in kept + gains},
        "wall_s": wall,
    }


def summary(record: dict[str, dict[str, Any]]) -> str:
    """Return the confusion table and one row per case, in Markdown."""
    columns = [*SUSPECTS, "ambiguous", "unknown", "none"]
    rows = []
    for hidden in (*SUSPECTS, None):
        cases = [case for case in record.values() if case["hidden"] == hidden]
        said = [c["causes"][0] if c["verdict"] == "cause" else c["verdict"] for c in cases]
        counts = [str(said.count(column) or "") for column in columns]
        rows.append([hidden or NOTHING, str(len(cases)), *counts])
    lines = [
        "# Blind tests",
        "",
        "Made by `./run python benchmarks/discovery.py`; what it is about is in",
        "[discovery.md](discovery.md). Rows: what was hidden; columns: what `discover` said.",
        "",
        table(["hidden", "cases", *columns], rows),
        _totals([*record.values()]),
        "",
        "## Every case",
        "",
        table(
            [
                "case",
                "amplitude",
                "verdict",
                "found",
                "95 % interval",
                "p",
                "error left out",
                "of shape",
            ],
            [_row(label, case) for label, case in record.items()],
        ),
    ]
    return "\n".join(lines)


def _totals(cases: list[dict[str, Any]]) -> str:
    hidden = sum(case["hidden"] is not None for case in cases)
    named = [case for case in cases if case["verdict"] == "cause"]
    right = [case for case in named if case["causes"] == [case["hidden"]]]
    intervals = [(c["amplitude"], *c["amplitudes"][c["hidden"]]["interval"]) for c in right]
    held = sum(low <= amplitude <= high for amplitude, low, high in intervals)
    minutes = [case["wall_s"] / 60 for case in cases]
    return (
        f"{len(right)} of {hidden} named right, {len(named) - len(right)} wrong names. Of the 95 % "
        f"intervals of those named right, {held} hold the amplitude. One `discover` took "
        f"{np.median(minutes):.1f} minutes, {max(minutes):.1f} at most."
    )


def _row(label: str, case: dict[str, Any]) -> list[str]:
    found = case["amplitudes"].get(case["causes"][0]) if case["causes"] else None
    gains = [case["gain"], case["shape_gain"]]
    return [
        label,
        f"{case['amplitude']:g}",
        ", ".join([case["verdict"], *case["causes"]]),
        f"{found['value']:.3g}" if found else "",
        "{:.3g} to {:.3g}".format(*found["interval"]) if found else "",
        f"{case['p_value']:.4f}",
        *(f"{g['rmse_before']:.2f} to {g['rmse_after']:.2f} N" if g else "" for g in gains),
    ]


def main() -> None:
    """Run what is not recorded yet."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cases", type=int, help="stop after so many")
    arguments = parser.parse_args()
    record = read_record("discovery")
    for label, (secret, seed) in list(secrets().items())[: arguments.cases]:
        if label not in record:
            record[label] = run(secret, seed)
            write_record("discovery", record)
            print(label, record[label]["verdict"], record[label]["causes"], flush=True)
    (DOCS / "discovery_cases.md").write_text(summary(record))


if __name__ == "__main__":
    main()

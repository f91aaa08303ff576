"""Blind tests of discovery on synthetic measurements with one, two or no hidden effects.

    ./run python benchmarks/discovery.py [--cases N] [--kept]

Takes two to thirty minutes for each case; two cases run at a time, each on one core. A case is made
by the full simulator on a finer mesh, with stalks, a batch and places on the plant of its own, and
handed to `ramiefenics discover`, a process that sees only the folder. Keeps finished cases in
`records/discovery.json`, and writes `docs/discovery_cases.md`. Every fourth case is held back until
the end, when the program is no longer changed.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
from cases import Case, by_effect, cases, confusion, figure, misled, named, wrong
from record import DOCS, WORKERS, read_record, table, write_record

from ramiefenics.discovery.synthetic import Broken, Secret, make_dataset
from ramiefenics.effects import EFFECTS, SUSPECTS
from ramiefenics.runs import Runs, workers

LISTED = tuple(SUSPECTS)
NUMBERS = {"nothing": 16, "one": 32, "two": 8, "not listed": 8, "one broken": 6, "two tests": 10}
SEED = 500000
KEPT = 4
"""One case in this many is held back, to be run only once, at the end."""

SHORT = {"fixture.span_mm": 70.0, "protocol.travel_mm": 9.8}
"""The second test, with the same ratio of travel to span. At 14 mm the void of a stalk on a short
span is nearly closed, and its bore creases."""


def run(case: Case) -> dict[str, Any]:
    """Make one case, and have it solved by a process that is given only the data and suspects.

    Both use one core.
    """
    rng = np.random.default_rng(case.seed)
    secrets = [
        Secret(EFFECTS[name], size * EFFECTS[name].typical) for name, size in case.hidden.items()
    ]
    broken = []
    if case.kind == "one broken":
        broken = [Broken(0, float(rng.uniform(0.1, 0.3)), float(rng.uniform(4.0, 10.0)))]
    unlisted = case.hidden if case.kind == "not listed" else ()
    with tempfile.TemporaryDirectory() as name:
        folder, out = Path(name) / "data", Path(name) / "found"
        with workers(number=1) as pool:
            make_dataset(
                folder,
                secrets,
                case.seed,
                Runs(executor=pool),
                tests=({}, SHORT)[: case.tests],
                noise=case.noise,
                broken=broken,
            )
        start = time.perf_counter()
        command = ["ramiefenics", "discover", str(folder), "--out", str(out), "--jobs", "1"]
        suspects = [f"--suspect={name}" for name in LISTED if name not in unlisted]
        subprocess.run([*command, *suspects], check=True, stdout=subprocess.DEVNULL)
        verdict = json.loads((out / "verdict.json").read_text())
        wall = time.perf_counter() - start
    kept = ("verdict", "groups", "misfit_p_value", "probabilities", "broken", "gain", "shape_gain")
    return {
        **asdict(case),
        **{key: verdict[key] for key in kept},
        "p": verdict["p_value"],
        "amplitudes": {name: found["value"] for name, found in verdict["amplitudes"].items()},
        "intervals": {name: found["interval"] for name, found in verdict["amplitudes"].items()},
        "limits": {
            name: [limit["low"], limit["high"]] for name, limit in verdict["limits"].items()
        },
        "place": verdict["anatomy"] and verdict["anatomy"]["place"],
        "simulated": verdict["simulations"],
        "wall_s": wall,
    }


def page(records: dict[str, dict[str, Any]]) -> str:
    """Return the page, in Markdown."""
    return "\n".join(
        [
            "# Blind tests",
            "",
            "Made by `./run python benchmarks/discovery.py`; [discovery.md](discovery.md) has the",
            "method. Eight stalks each, simulated on a mesh finer than those",
            "of the analysis (`MESH` in `ramiefenics.discovery.synthetic.curves`);",
            f"{len(LISTED)} suspects, those of [effects.md](effects.md) but",
            f"{', '.join(f'`{name}`' for name in EFFECTS if name not in SUSPECTS)}, of which a",
            "single loading shows hardly anything that others do not.",
            f"{len(records)} of {sum(NUMBERS.values())} cases so far. `named`: each hidden effect",
            "by itself or in a group, and nothing else. `wrong`: a single effect is named that was",
            "not hidden.",
            "",
            confusion(records),
            _totals([*records.values()]),
            "",
            "![P-values where nothing is hidden, and how often probabilities are right]"
            "(discovery_cases.png)",
            "",
            "## One effect",
            "",
            "By amplitude over the typical one, and noise: `+` named alone, the number of members",
            "where it is in a group, `-` not found, `!` another name.",
            "",
            by_effect(records, LISTED),
            "## Every case",
            "",
            table(
                ["case", "hidden", "verdict", "said", "p", "error left out", "of shape"],
                [_row(label, case) for label, case in records.items()],
            ),
        ]
    )


def _totals(found: list[dict[str, Any]]) -> str:
    held = [
        low <= size * EFFECTS[name].typical <= high
        for case in found
        if named(case)
        for name, size in case["hidden"].items()
        if name in case["intervals"]
        for low, high in [case["intervals"][name]]
    ]
    hiding = [
        low <= size * EFFECTS[name].typical <= high
        for case in found
        for name, size in case["hidden"].items()
        if name in case["limits"] and not any(name in group for group in case["groups"])
        for low, high in [case["limits"][name]]
    ]
    simulated = [case["simulated"] for case in found]
    typical = [
        case
        for case in found
        if case["kind"] == "one" and 1.0 in case["hidden"].values() and case["noise"] == 0.01
    ]
    return (
        f"At typical size and 1 % noise, {sum(map(named, typical))} of {len(typical)} single "
        f"effects are named. In {sum(map(wrong, found))} of {len(found)} cases a wrong effect is "
        f"named, in {sum(map(misled, found))} a group without any of the hidden ones. Of "
        f"{len(held)} intervals of those named correctly, {sum(held)} contain the amplitude. Of "
        f"{len(hiding)} listed effects that were hidden and not named, {sum(hiding)} "
        "have an amplitude that the page states as not excluded. One `discover` needed "
        f"{np.median(simulated):.0f} simulations, {max(simulated)} at most."
    )


def _row(label: str, case: dict[str, Any]) -> list[str]:
    gains = [case["gain"], case["shape_gain"]]
    hidden = [f"{size:g} x {name}" for name, size in case["hidden"].items()]
    return [
        label,
        "; ".join(hidden + (["3 % noise"] if case["noise"] > 0.01 else [])),
        case["verdict"] + (f" ({case['place']})" if case["place"] else ""),
        "; ".join(" or ".join(group) for group in case["groups"]),
        f"{case['p']:.4f}",
        *(f"{g['rmse_before']:.2f} to {g['rmse_after']:.2f} N" if g else "" for g in gains),
    ]


def main() -> None:
    """Run the cases that are not recorded yet, then write the page and its figure."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cases", type=int, help="stop after so many")
    parser.add_argument("--kept", action="store_true", help="those that are kept for the end too")
    arguments = parser.parse_args()
    os.environ["OMP_NUM_THREADS"] = "1"
    known = read_record("discovery")
    wanted = {
        label: case
        for number, (label, case) in enumerate(cases(LISTED, NUMBERS, SEED), start=1)
        if number <= (arguments.cases or number)
        and (label in known or number % KEPT or arguments.kept)
    }
    pool = ThreadPoolExecutor(WORKERS)  # each waits for processes of its own
    try:
        left = {pool.submit(run, case): n for n, case in wanted.items() if n not in known}
        for done in as_completed(left):
            label = left[done]
            known[label] = done.result()
            write_record("discovery", known)
            said = [known[label][key] for key in ("hidden", "verdict", "groups")]
            print(label, *said, flush=True)
    finally:
        pool.shutdown(cancel_futures=True)
    records = {label: known[label] for label in wanted}
    (DOCS / "discovery_cases.md").write_text(page(records) + "\n")
    figure(records).savefig(DOCS / "discovery_cases.png")


if __name__ == "__main__":
    main()

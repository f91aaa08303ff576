"""Whether tests show what `ramiefenics plan` promises, and what a second test of each stalk adds.

    ./run python benchmarks/power.py [--draws N]

One stalk is simulated with every effect at its typical size, in the standard test and in three
others. From these signatures, data sets of eight stalks are drawn and judged as in
`discovery_statistics.py`: with each effect at the smallest amplitude that `plan` promises to find,
and at its typical size, with the standard test alone and with each of the others besides. Takes 40
minutes on two cores, simulations included. Keeps finished cases in `records/power.json`, and writes
`docs/power.md`.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from typing import Any

import numpy as np
from cases import Case, named
from discovery_statistics import DRIFT, FIT_SD, OWN, STALKS, draw, run, visible
from record import DOCS, read_record, table, write_record

from ramiefenics.discovery.bootstrap import p_value_of_effect
from ramiefenics.discovery.evidence import Evidence
from ramiefenics.discovery.findings import with_space
from ramiefenics.discovery.fit_scatter import fit_scatter
from ramiefenics.discovery.power import POWER, Design, power, predicted_evidence, repeated
from ramiefenics.discovery.verdict import SIGNIFICANCE
from ramiefenics.effects import EFFECTS, SUSPECTS
from ramiefenics.measured.changes import changed
from ramiefenics.published import published_test
from ramiefenics.runs import Runs, workers
from ramiefenics.specification import override

SECOND = {
    "alone": "",
    "span of 70 mm": "fixture.span_mm=70",
    "indenter of 10 mm": "fixture.indenter_radius_mm=10",
    "turned by 90°": "stalk.rotation_deg=90",
}
"""Settings of the second test, by what the table calls it."""

SMALLEST = "smallest"
AT_SMALLEST = 40
"""Number of data sets with each effect at the smallest amplitude that is promised to be found."""

SEED = 200000


def found(case: Case, one: Evidence) -> bool:
    """Return whether some effect is found in random data."""
    evidence = draw(case, one)
    scatter = fit_scatter(evidence)
    p = p_value_of_effect(evidence, scatter, np.random.default_rng(case.seed))
    return p < SIGNIFICANCE


def judged(case: Case, one: Evidence) -> dict[str, Any]:
    """Return the verdict on random data, or only whether there is an effect."""
    return {"found": found(case, one)} if case.kind == SMALLEST else run(case, one)


def planned(
    one: Evidence, smallest: dict[str, float], draws: int
) -> dict[str, tuple[Case, Evidence]]:
    """Return cases by label, each with the evidence of one stalk under its tests."""
    tests = {s: [0, k] if k else [0] for k, s in enumerate(SECOND)}
    by_second = {second: repeated(one, which, 1) for second, which in tests.items()}
    todo = {}
    for number, name in enumerate(one.names):
        seed = SEED + 1000 * number
        for second, which in tests.items():
            for k in range(draws):
                case = Case("one", {name: 1.0}, tests=len(which), seed=seed + k)
                todo[f"{name}, {second}, {k}"] = case, by_second[second]
        size = smallest[name] / EFFECTS[name].typical
        for k in range(AT_SMALLEST if np.isfinite(size) else 0):
            case = Case(SMALLEST, {name: size}, seed=seed + k)
            todo[f"{name}, {SMALLEST}, {k}"] = case, by_second["alone"]
    return todo


def page(records: dict[str, dict[str, Any]], smallest: dict[str, float], draws: int) -> str:
    """Return the page, in Markdown."""

    def promised(name: str) -> list[str]:
        if not np.isfinite(smallest[name]):
            return ["not found", ""]
        share = [records[f"{name}, {SMALLEST}, {k}"]["found"] for k in range(AT_SMALLEST)]
        return [_size(name, smallest[name]), f"{100 * np.mean(share):.0f} %"]

    def cell(some: Sequence[str], second: str) -> str:
        cases = [records[f"{name}, {second}, {k}"] for name in some for k in range(draws)]
        sizes = [len(case["groups"][0]) for case in cases if named(case)]
        grouped = len(sizes) - sizes.count(1)
        return f"{sizes.count(1)}" + (f" ({grouped})" if grouped else "")

    rows = [
        [name, _size(name, EFFECTS[name].typical), *promised(name)]
        + [cell([name], second) for second in SECOND]
        for name in smallest
    ]
    held = [
        low <= EFFECTS[name].typical <= high
        for case in records.values()
        if "found" not in case
        for name, (low, high) in case["intervals"].items()
    ]
    total = [f"all {len(smallest) * draws}", "", "", "", *(cell([*smallest], s) for s in SECOND)]
    return "\n".join(
        [
            "# What tests can show",
            "",
            f"Made by `./run python benchmarks/power.py`. Data sets of {STALKS} stalks with one",
            "effect and 1 % noise, drawn and judged as in",
            "[discovery_statistics.md](discovery_statistics.md); moduli known to "
            f"{100 * FIT_SD:g} %.",
            "",
            f"- `promised`: the smallest amplitude that is found in {100 * POWER:g} % of data sets",
            "  with the standard test alone, according to `ramiefenics plan`.",
            f"- `kept`: the share of {AT_SMALLEST} data sets with this amplitude in which an",
            "  effect is found.",
            f"- `alone` and the others: of {draws} data sets with an effect of typical size, the",
            "  number in which exactly this effect is named and, in brackets, the number in which",
            "  it is named in a group of several, with the standard test alone or with a second",
            "  test of the same stalks. Moduli of a stalk can imitate an effect in one test, but",
            "  seldom in two.",
            "",
            table(["effect", "typical", "promised", "kept", *SECOND], [*rows, total]),
            f"Of {len(held)} intervals of 95 %, where it is known which effect is present, "
            f"{sum(held)} contain its amplitude ({100 * np.mean(held):.1f} %).",
        ]
    )


def _size(name: str, amplitude: float) -> str:
    return f"{amplitude:.2g}{with_space(EFFECTS[name].unit)}"


def main() -> None:
    """Run the cases that are not recorded yet, then write the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--draws", type=int, default=5, help="data sets of each effect and test")
    draws = parser.parse_args().draws
    test = override(published_test("table3"), ["numerics.mesh=screening"])
    tests = [changed(test, [setting] if setting else []) for setting in SECOND.values()]
    design = Design(STALKS, FIT_SD, OWN, drift=DRIFT)
    with workers() as pool:
        one = visible(predicted_evidence(tests, SUSPECTS, FIT_SD, Runs(executor=pool)))
        smallest = power(repeated(one, [0], STALKS), design).smallest
        todo, records = planned(one, smallest, draws), read_record("power")
        left = {label: both for label, both in todo.items() if label not in records}
        waiting = {label: pool.submit(judged, *both) for label, both in left.items()}
        for label, done in waiting.items():
            records[label] = done.result()
            write_record("power", records)
    (DOCS / "power.md").write_text(page(records, smallest, draws) + "\n")


if __name__ == "__main__":
    main()

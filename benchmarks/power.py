"""Whether tests show what `ramiefenics plan` promises, and what a second test of each stalk adds.

    ./run python benchmarks/power.py [--draws N]

One stalk is simulated with every effect at its typical size, in the standard test and in several
others. From these signatures, data sets of eight stalks are drawn and judged as in
`discovery_statistics.py`: with each effect at the smallest amplitude that `plan` promises to find,
and at its typical size, with the standard test alone and with others besides. Takes an hour on two
cores, simulations included. Keeps finished cases in `records/power.json`, and writes
`docs/power.md`.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from cases import Case, named
from discovery_statistics import DRIFT, FIT_SD, NOISE_LENGTH, OWN, STALKS, draw, run, visible
from record import DOCS, read_record, table, write_record

from ramiefenics.discovery.planning.plan import UNLOADED
from ramiefenics.discovery.planning.power import POWER, Design, power, predicted_evidence, repeated
from ramiefenics.discovery.report.wording import with_space
from ramiefenics.discovery.statistics.bootstrap import p_value_of_effect
from ramiefenics.discovery.statistics.evidence import Evidence
from ramiefenics.discovery.statistics.fit_scatter import fit_scatter
from ramiefenics.discovery.statistics.verdict import SIGNIFICANCE
from ramiefenics.effects import EFFECTS, SUSPECTS
from ramiefenics.measured.changes import changed
from ramiefenics.published import published_test
from ramiefenics.runs import Runs, workers
from ramiefenics.specification import override

SPAN = "fixture.span_mm=70"
CURVES = {
    "loading": [],
    "unloading": [UNLOADED],
    "loading, short": [SPAN],
    "unloading, short": [SPAN, UNLOADED],
    "loading, blunt": ["fixture.indenter_radius_mm=10"],
    "loading, turned": ["stalk.rotation_deg=90"],
}
"""Settings of each curve that a stalk may have."""

TESTS = {
    "alone": ["loading"],
    "span of 70 mm": ["loading", "loading, short"],
    "indenter of 10 mm": ["loading", "loading, blunt"],
    "turned by 90°": ["loading", "loading, turned"],
    "unloaded": ["loading", "unloading"],
    "both spans, unloaded": ["loading", "unloading", "loading, short", "unloading, short"],
}
"""Curves of each stalk, by what the table calls these tests."""

SMALLEST = "smallest"
AT_SMALLEST = 40
"""Number of data sets with each effect at the smallest amplitude that is promised to be found."""

KEPT = ("hidden", "verdict", "groups", "intervals")
"""What the record keeps of a case with an effect of typical size."""

SEED = 200000


def judged(case: Case, one: Evidence) -> dict[str, Any]:
    """Return what is said of random data, or only whether an effect is found in them."""
    if case.kind != SMALLEST:
        all_of_it = run(case, one)
        return {key: all_of_it[key] for key in KEPT}
    evidence = draw(case, one)
    rng = np.random.default_rng(case.seed)
    p = p_value_of_effect(evidence, fit_scatter(evidence), rng)
    return {"found": p < SIGNIFICANCE}


def planned(
    one: Evidence, smallest: dict[str, float], draws: int
) -> dict[str, tuple[Case, Evidence]]:
    """Return cases by label, each with the evidence of one stalk under its tests."""
    by_tests = {tests: _evidence(one, curves) for tests, curves in TESTS.items()}
    todo = {}
    for number, name in enumerate(sorted(one.names, key=lambda name: name not in SUSPECTS)):
        seed = SEED + 1000 * number
        for tests, evidence in by_tests.items():
            for k in range(draws if name in evidence.names else 0):
                case = Case("one", {name: 1.0}, tests=len(TESTS[tests]), seed=seed + k)
                todo[f"{name}, {tests}, {k}"] = case, evidence
        size = smallest.get(name, np.inf) / EFFECTS[name].typical
        for k in range(AT_SMALLEST if np.isfinite(size) else 0):
            case = Case(SMALLEST, {name: size}, seed=seed + k)
            todo[f"{name}, {SMALLEST}, {k}"] = case, by_tests["alone"]
    return todo


def _evidence(one: Evidence, curves: Sequence[str]) -> Evidence:
    """Return the evidence of some curves, with the suspects that `discover` tries for them."""
    evidence = repeated(one, [[*CURVES].index(curve) for curve in curves], 1)
    tried = EFFECTS if "unloading" in curves else SUSPECTS
    suspects = {name: s for name, s in evidence.suspects.items() if name in tried}
    return replace(evidence, suspects=suspects)


def page(records: dict[str, dict[str, Any]], smallest: dict[str, float], draws: int) -> str:
    """Return the page, in Markdown."""

    def promised(name: str) -> list[str]:
        if name not in smallest:
            return ["", ""]
        if not np.isfinite(smallest[name]):
            return ["not found", ""]
        share = [records[f"{name}, {SMALLEST}, {k}"]["found"] for k in range(AT_SMALLEST)]
        return [_size(name, smallest[name]), f"{100 * np.mean(share):.0f} %"]

    def cell(some: Sequence[str], tests: str) -> str:
        labels = [f"{name}, {tests}, {k}" for name in some for k in range(draws)]
        cases = [records[label] for label in labels if label in records]
        if not cases:
            return ""
        sizes = [len(case["groups"][0]) for case in cases if named(case)]
        grouped = len(sizes) - sizes.count(1)
        return f"{sizes.count(1)}" + (f" ({grouped})" if grouped else "")

    def row(name: str) -> list[str]:
        sizes = [_size(name, EFFECTS[name].typical), *promised(name)]
        return [name, *sizes, *(cell([name], tests) for tests in TESTS)]

    others = [n for n in EFFECTS if n not in smallest and f"{n}, unloaded, 0" in records]
    held = [
        low <= EFFECTS[name].typical <= high
        for case in records.values()
        if "found" not in case
        for name, (low, high) in case["intervals"].items()
    ]
    total = ["all", "", "", "", *(cell([*smallest], tests) for tests in TESTS)]
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
            "  it is named in a group of several. The standard test is made alone, with a second",
            "  test of the same stalks, or with its unloading. Moduli of a stalk can imitate an",
            "  effect in one curve, but seldom in several that differ.",
            "",
            f"`all` is of {len(smallest) * draws} data sets. The effects below it are suspects",
            "only where there is unloading.",
            "",
            table(
                ["effect", "typical", "promised", "kept", *TESTS],
                [*map(row, smallest), total, *map(row, others)],
            ),
            f"Of {len(held)} intervals of 95 %, where it is known which effect is present, "
            f"{sum(held)} contain its amplitude ({100 * np.mean(held):.1f} %). Data sets of one "
            "row that have the same number in different columns have the same random moduli, so "
            "these intervals are not independent.",
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
    tests = [changed(test, settings) for settings in CURVES.values()]
    design = Design(STALKS, FIT_SD, OWN, drift=DRIFT, noise_length=NOISE_LENGTH)
    with workers() as pool:
        one = visible(predicted_evidence(tests, EFFECTS, FIT_SD, Runs(executor=pool)))
        smallest = power(repeated(_evidence(one, ["loading"]), [0], STALKS), design).smallest
        todo, records = planned(one, smallest, draws), read_record("power")
        left = {label: both for label, both in todo.items() if label not in records}
        waiting = {label: pool.submit(judged, *both) for label, both in left.items()}
        for label, done in waiting.items():
            records[label] = done.result()
            write_record("power", records)
    (DOCS / "power.md").write_text(page(records, smallest, draws) + "\n")


if __name__ == "__main__":
    main()

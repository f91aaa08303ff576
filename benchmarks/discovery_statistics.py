"""How often the statistics of discovery are right: random data of simulated signatures.

    ./run python benchmarks/discovery_statistics.py [--cases N]

One stalk is simulated with every effect at its typical size, under the standard test and on a
shorter span. From these, data sets of eight stalks are drawn, with scatter, noise and what is
hidden in them, and judged as `discover` judges them, but for fits in the finite-element model: all
is linear here. About an hour on two cores, after ten minutes of simulations. Keeps finished cases
in `records/discovery_statistics.json`, and writes `docs/discovery_statistics.md`.
"""

from __future__ import annotations

import argparse
import itertools
from collections.abc import Iterator
from dataclasses import asdict, dataclass, replace
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure
from record import DOCS, read_record, table, write_record

from ramiefenics.discovery.broken import find_broken
from ramiefenics.discovery.causes import find_causes
from ramiefenics.discovery.chance import chance_of_effect, chance_of_misfit
from ramiefenics.discovery.evidence import Evidence, Suspect
from ramiefenics.discovery.fit import Fit
from ramiefenics.discovery.fit_scatter import fit_scatter
from ramiefenics.discovery.power import predicted_evidence, repeated
from ramiefenics.discovery.scatter import Scatter
from ramiefenics.discovery.verdict import SIGNIFICANCE, decide
from ramiefenics.effects import EFFECTS
from ramiefenics.published import published_test
from ramiefenics.results.style import BLUE, GREEN, STYLE, VERMILION
from ramiefenics.runs import Runs, workers
from ramiefenics.specification import override

STALKS, FIT_SD, OWN, DRIFT = 8, 0.1, 0.05, 0.003
SHORT = "fixture.span_mm=70"
AMPLITUDES, NOISES = (0.5, 1.0, 2.0), (0.01, 0.03)
VISIBLE = 0.002
"""Share of the peak that an effect of typical size has to change: alike stalks show no effect that
is one between stalks."""

NULLS, PAIRS, UNLISTED, BROKEN, TWICE = 200, 40, 40, 20, 40


@dataclass(frozen=True)
class Case:
    """What is drawn.

    Attributes
    ----------
    kind
        One word.
    hidden
        Effects, with amplitudes over the typical ones.
    noise
        Over the peak.
    tests
        Of each stalk.
    seed
        Of everything random.
    """

    kind: str
    hidden: dict[str, float]
    noise: float = NOISES[0]
    tests: int = 1
    seed: int = 0


def cases(names: tuple[str, ...]) -> Iterator[tuple[str, Case]]:
    """Return all cases, kinds mixed, so that any beginning has some of all."""
    rng = np.random.default_rng(20261123)
    pick = lambda k: [str(name) for name in rng.choice(names, k, replace=False)]  # noqa: E731
    drawn = {
        "nothing": [Case("nothing", {}, NOISES[k % 2]) for k in range(NULLS)],
        "one": [
            Case("one", {name: size}, noise)
            for size, noise, name in itertools.product(AMPLITUDES, NOISES, names)
        ],
        "two": [Case("two", dict.fromkeys(pick(2), 1.0)) for _ in range(PAIRS)],
        "not listed": [Case("not listed", dict.fromkeys(pick(1), 1.0)) for _ in range(UNLISTED)],
        "one broken": [Case("one broken", dict.fromkeys(pick(1), 1.0)) for _ in range(BROKEN)],
        "two tests": [
            Case("two tests", dict.fromkeys(pick(1), 1.0), tests=2) for _ in range(TWICE)
        ],
    }
    for turn in range(max(map(len, drawn.values()))):
        for kind, some in drawn.items():
            if turn < len(some):
                yield f"{kind} {turn + 1}", replace(some[turn], seed=100000 + turn)


def draw(case: Case, one: Evidence) -> Evidence:
    """Return drawn data."""
    rng = np.random.default_rng([case.seed, len(case.kind)])
    evidence = repeated(one, list(range(case.tests)), STALKS)
    scatter = Scatter((OWN,) * evidence.by_factors.shape[1], case.noise, 0.04, DRIFT)
    residual = evidence.blocks.curves(evidence.draw(scatter, 1, rng))[:, 0]
    for name, size in case.hidden.items():
        suspect = evidence.suspects[name]
        residual += size * suspect.effect.typical * suspect.signature
    if case.kind == "one broken":
        x = np.linspace(0.0, 1.0, residual.shape[1])
        residual[0] -= rng.uniform(0.1, 0.3) * (x > rng.uniform(0.3, 0.7)) * x
    suspects = evidence.suspects
    if case.kind == "not listed":
        suspects = {n: s for n, s in suspects.items() if n not in case.hidden}
    return replace(evidence, residual=residual, suspects=suspects)


def judge(evidence: Evidence, seed: int) -> dict[str, Any]:
    """Return what is said of data."""
    rng = np.random.default_rng(seed)
    seen = find_broken(evidence, ())
    causes = find_causes(seen)
    seen = find_broken(seen, causes.best)
    causes = find_causes(seen)
    p = chance_of_effect(seen, causes.nothing, rng)
    chosen = causes.best if p < SIGNIFICANCE else ()
    fit = Fit(seen, chosen, fit_scatter(seen, chosen))
    misfit = chance_of_misfit(fit, rng)
    groups = causes.groups()
    conflict = fit.conflict()
    return {
        "verdict": decide(p, misfit, conflict, groups),
        "groups": groups,
        "p": p,
        "misfit": misfit,
        "conflict": conflict,
        "broken": sorted(seen.broken),
        "probabilities": causes.inclusion(),
    }


def intervals(evidence: Evidence, case: Case) -> dict[str, tuple[float, float]]:
    """Return the intervals of hidden amplitudes where all of these are known to be there."""
    names = tuple(name for name in case.hidden if name in evidence.suspects)
    fit = Fit(evidence, names, fit_scatter(evidence, names))
    return {name: fit.interval(name) for name in names}


def run(case: Case, one: Evidence) -> dict[str, Any]:
    """Draw data, and have them judged."""
    evidence = draw(case, one)
    listed = {} if case.kind == "one broken" else intervals(evidence, case)
    return {**asdict(case), **judge(evidence, case.seed), "intervals": listed}


def named(record: dict[str, Any]) -> bool:
    """Return whether exactly what was hidden was named, each effect by itself or in a group."""
    groups = [set(group) for group in record["groups"]]
    hidden = set(record["hidden"])
    if record["verdict"] not in ("cause", "ambiguous"):
        return False
    return all(any(name in g for g in groups) for name in hidden) and len(groups) == len(hidden)


def wrong(record: dict[str, Any]) -> bool:
    """Return whether something that was not hidden was named as a cause."""
    causes = [g[0] for g in record["groups"] if len(g) == 1]
    called = record["verdict"] in ("cause", "ambiguous")
    return called and any(name not in record["hidden"] for name in causes)


def page(records: dict[str, dict[str, Any]], names: tuple[str, ...]) -> str:
    """Return the page, in Markdown."""
    kinds = list(dict.fromkeys(r["kind"] for r in records.values()))
    verdicts = ["none", "cause", "ambiguous", "conflict", "unknown"]
    rows = []
    for kind in kinds:
        some = [r for r in records.values() if r["kind"] == kind]
        said = [r["verdict"] for r in some]
        rows.append(
            [
                kind,
                str(len(some)),
                *(str(said.count(v) or "") for v in verdicts),
                str(sum(map(named, some)) if kind not in ("nothing", "not listed") else ""),
                str(sum(map(wrong, some))),
            ]
        )
    single = [r for r in records.values() if r["kind"] == "one"]
    by_effect = []
    for name in names:
        row = [name]
        for size, noise in itertools.product(AMPLITUDES, NOISES):
            some = [r for r in single if r["hidden"] == {name: size} and r["noise"] == noise]
            row.append(", ".join(_short(r) for r in some))
        by_effect.append(row)
    held = [
        low <= size * EFFECTS[name].typical <= high
        for r in records.values()
        for name, (low, high) in r["intervals"].items()
        for size in [r["hidden"][name]]
    ]
    nulls = np.array([r["p"] for r in records.values() if r["kind"] == "nothing"])
    shares = ", ".join(
        f"{(nulls < level).mean():.3f} below {level:g}" for level in (0.5, 0.1, 0.05)
    )
    head = [f"{s:g} x, {100 * n:g} %" for s, n in itertools.product(AMPLITUDES, NOISES)]
    return "\n".join(
        [
            "# Statistics of discovery",
            "",
            "Made by `./run python benchmarks/discovery_statistics.py`; what it is about is in",
            "[discovery.md](discovery.md). Signatures of one simulated stalk, of which data sets",
            f"of {STALKS} stalks are drawn: moduli known to {100 * FIT_SD:g} %, stalks that differ",
            f"by {100 * OWN:g} %, noise of 1 or 3 %. All is linear: the statistics are tested.",
            "",
            "`named`: each hidden effect by itself or in a group, and nothing else. `wrong`: a",
            "single effect is named that was not hidden.",
            "",
            table(["hidden", "cases", *verdicts, "named", "wrong"], rows),
            f"Of {len(nulls)} p-values where nothing is hidden: {shares}. Of {len(held)} intervals "
            f"of 95 %, where it is known which effects are there, {sum(held)} hold the amplitude "
            f"({np.mean(held):.3f}).",
            "",
            "![P-values where nothing is hidden, and how often probabilities are right]"
            "(discovery_statistics.png)",
            "",
            "## One effect",
            "",
            "By amplitude over the typical one, and noise: `+` named alone, the number of members",
            "where it is in a group, `-` not found, `!` another name.",
            "",
            table(["effect", *head], by_effect),
        ]
    )


def _short(record: dict[str, Any]) -> str:
    (name,) = record["hidden"]
    if record["verdict"] not in ("cause", "ambiguous"):
        return "-"
    groups = [g for g in record["groups"] if name in g]
    if not groups or wrong(record):
        return "!"
    return "+" if len(groups[0]) == 1 else str(len(groups[0]))


def figure(records: dict[str, dict[str, Any]]) -> Figure:
    """Draw p-values of nothing, and how often an effect is there that is said to be."""
    nulls = np.sort([r["p"] for r in records.values() if r["kind"] == "nothing"])
    said, there = [], []
    for r in records.values():
        if r["kind"] != "not listed":
            for name, probability in r["probabilities"].items():
                said.append(probability)
                there.append(name in r["hidden"])
    edges = np.array([0.0, 0.02, 0.05, 0.1, 0.2, 0.4, 0.6, 0.8, 0.9, 0.98, 1.0 + 1e-9])
    place = np.digitize(said, edges) - 1
    with mpl.rc_context(STYLE):
        drawn = Figure(figsize=(8.0, 3.6), layout="constrained")
        left, right = drawn.subplots(1, 2)
        left.step(nulls, (np.arange(len(nulls)) + 1.0) / len(nulls), color=BLUE, where="post")
        left.plot([0, 1], [0, 1], color="k", lw=0.8, ls="--")
        left.set(xlabel="p-value where nothing is hidden", ylabel="Share of data sets below")
        for k in range(len(edges) - 1):
            some = np.array(there)[place == k]
            if len(some):
                mean = some.mean()
                error = np.sqrt(max(mean * (1 - mean), 0.25 / len(some)) / len(some))
                x = np.array(said)[place == k].mean()
                right.errorbar(x, mean, 2 * error, color=VERMILION, marker="o", ms=4, capsize=2)
        right.plot([0, 1], [0, 1], color=GREEN, lw=0.8, ls="--")
        right.set(xlabel="Probability that an effect is there", ylabel="Share in which it is")
    return drawn


def _change(suspect: Suspect) -> float:
    """Return the largest change that the typical amplitude makes, over the peak."""
    return float(np.abs(suspect.effect.typical * suspect.signature).max())


def main() -> None:
    """Run what is not recorded yet."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cases", type=int, help="stop after so many")
    arguments = parser.parse_args()
    test = override(published_test("table3"), ["numerics.mesh=screening"])
    with workers() as pool:
        runs = Runs(executor=pool)
        both = [test, override(test, [SHORT])]
        one = predicted_evidence(both, EFFECTS, FIT_SD, runs)
        seen = {n: s for n, s in one.suspects.items() if _change(s) > VISIBLE}
        one = replace(one, suspects=seen)
        todo = dict(itertools.islice(cases(one.names), arguments.cases))
        records = {k: v for k, v in read_record("discovery_statistics").items() if k in todo}
        waiting = [label for label in todo if label not in records]
        for label, found in zip(
            waiting, pool.map(run, [todo[k] for k in waiting], itertools.repeat(one)), strict=False
        ):
            records[label] = found
            write_record("discovery_statistics", records)
    (DOCS / "discovery_statistics.md").write_text(page(records, one.names) + "\n")
    figure(records).savefig(DOCS / "discovery_statistics.png")


if __name__ == "__main__":
    main()

"""Cases with hidden effects, and tables and a figure of how often the verdicts are right."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure
from record import table
from scipy.stats import binomtest

from ramiefenics.results.style import BLUE, GREEN, STYLE, VERMILION

AMPLITUDES, NOISES = (0.5, 1.0, 2.0), (0.01, 0.03)

APART = 10_000
"""Difference of the seeds of two kinds of case, so that no two cases have the same stalks."""

VERDICTS = ["none", "cause", "ambiguous", "conflict", "unknown"]


@dataclass(frozen=True)
class Case:
    """A case to be solved.

    Attributes
    ----------
    kind
        Kind of case, as in `cases`.
    hidden
        Amplitudes of the hidden effects, relative to the typical ones, by name.
    noise
        Noise of the curves, relative to their peak.
    tests
        Number of tests of each stalk.
    seed
        Seed of all random numbers of the case.
    """

    kind: str
    hidden: dict[str, float]
    noise: float = NOISES[0]
    tests: int = 1
    seed: int = 0


def cases(
    names: Sequence[str], numbers: Mapping[str, int], seed: int
) -> Iterator[tuple[str, Case]]:
    """Yield labels and cases, cycling through the kinds so that the first few include them all.

    Parameters
    ----------
    names
        Effects that may be hidden.
    numbers
        Number of cases by kind: ``nothing``, ``one`` (any size and noise), ``two`` of typical size,
        ``not listed``, ``one broken``, ``two tests``.
    seed
        Seed of the choice of hidden effects.
    """
    rng = np.random.default_rng(seed)
    grid = rng.permutation(list(itertools.product(AMPLITUDES, NOISES, names)))
    drawn: dict[str, list[Case]] = {}
    for kind, number in numbers.items():
        effects = 0 if kind == "nothing" else 2 if kind == "two" else 1
        drawn[kind] = [
            Case(kind, {str(n): 1.0 for n in rng.choice(names, effects, replace=False)})
            for _ in range(number)
        ]
    drawn["nothing"] = [
        replace(case, noise=NOISES[k % len(NOISES)]) for k, case in enumerate(drawn["nothing"])
    ]
    drawn["one"] = [
        Case("one", {str(name): float(size)}, float(noise))
        for size, noise, name in grid[: numbers["one"]]
    ]
    for turn in range(max(map(len, drawn.values()))):
        for number, (kind, some) in enumerate(drawn.items()):
            if turn < len(some):
                tests = 2 if kind == "two tests" else 1
                own = seed + number * APART + turn
                yield f"{kind} {turn + 1}", replace(some[turn], tests=tests, seed=own)


def named(record: Mapping[str, Any]) -> bool:
    """Return whether exactly the hidden effects were named, each by itself or in a group."""
    groups = [set(group) for group in record["groups"]]
    hidden = set(record["hidden"])
    if record["verdict"] not in ("cause", "ambiguous"):
        return False
    return all(any(name in g for g in groups) for name in hidden) and len(groups) == len(hidden)


def wrong(record: Mapping[str, Any]) -> bool:
    """Return whether an effect that was not hidden was named, by itself, as a cause."""
    return any(len(group) == 1 for group in _misnamed(record))


def misled(record: Mapping[str, Any]) -> bool:
    """Return whether a group of effects was named none of which was hidden."""
    return any(len(group) > 1 for group in _misnamed(record))


def _misnamed(record: Mapping[str, Any]) -> list[list[str]]:
    called = record["verdict"] in ("cause", "ambiguous")
    return [g for g in record["groups"] if called and set(g).isdisjoint(record["hidden"])]


def confusion(records: Mapping[str, Mapping[str, Any]]) -> str:
    """Return a table of verdicts by kind of case, in Markdown."""
    rows = []
    for kind in dict.fromkeys(r["kind"] for r in records.values()):
        some = [r for r in records.values() if r["kind"] == kind]
        said = [r["verdict"] for r in some]
        rows.append(
            [
                kind,
                str(len(some)),
                *(str(said.count(v) or "") for v in VERDICTS),
                str(sum(map(named, some)) if kind not in ("nothing", "not listed") else ""),
                str(sum(map(wrong, some))),
            ]
        )
    return table(["hidden", "cases", *VERDICTS, "named", "wrong"], rows)


def by_effect(records: Mapping[str, Mapping[str, Any]], names: Sequence[str]) -> str:
    """Return a table of the verdicts on single effects by amplitude and noise, in Markdown."""
    rows = []
    for name in names:
        row = [name]
        for size, noise in itertools.product(AMPLITUDES, NOISES):
            some = [
                r
                for r in records.values()
                if r["kind"] == "one" and r["hidden"] == {name: size} and r["noise"] == noise
            ]
            row.append(", ".join(_short(r) for r in some))
        rows.append(row)
    head = [f"{s:g} x, {100 * n:g} %" for s, n in itertools.product(AMPLITUDES, NOISES)]
    return table(["effect", *head], rows)


def _short(record: Mapping[str, Any]) -> str:
    (name,) = record["hidden"]
    if record["verdict"] not in ("cause", "ambiguous"):
        return "-"
    groups = [g for g in record["groups"] if name in g]
    if not groups or wrong(record):
        return "!"
    return "+" if len(groups[0]) == 1 else str(len(groups[0]))


def figure(records: Mapping[str, Mapping[str, Any]]) -> Figure:
    """Draw p-values where nothing is hidden, and the calibration of the effects' probabilities.

    Error bars are Wilson's 95 % intervals.
    """
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
                count = binomtest(int(some.sum()), len(some))
                ends = count.proportion_ci(method="wilson")
                x, mean = np.array(said)[place == k].mean(), count.statistic
                error = [[mean - ends.low], [ends.high - mean]]
                right.errorbar(x, mean, error, color=VERMILION, marker="o", ms=4, capsize=2)
        right.plot([0, 1], [0, 1], color=GREEN, lw=0.8, ls="--")
        right.set(xlabel="Probability that an effect is there", ylabel="Share in which it is")
    return drawn

"""How often the statistics of discovery are right, on random data from simulated signatures.

    ./run python benchmarks/discovery_statistics.py [--cases N]

One stalk is simulated with every effect at its typical size, in the standard test and on a shorter
span. From these signatures, data sets of eight stalks are drawn, with scatter, noise and hidden
effects. They are judged as `discover` judges them, except that everything is linear, so that no
finite-element model is fitted. Takes ten minutes on two cores, simulations included. Keeps
finished cases in `records/discovery_statistics.json`, and writes `docs/discovery_statistics.md`.
"""

from __future__ import annotations

import argparse
import itertools
from dataclasses import asdict, replace
from typing import Any

import numpy as np
from cases import NOISES, Case, by_effect, cases, confusion, figure
from record import DOCS, read_record, table, write_record

from ramiefenics.discovery.planning.power import predicted_evidence, repeated
from ramiefenics.discovery.statistics.bootstrap import p_value_of_effect, p_value_of_misfit
from ramiefenics.discovery.statistics.broken import find_broken
from ramiefenics.discovery.statistics.causes import find_causes
from ramiefenics.discovery.statistics.evidence import Evidence, Suspect
from ramiefenics.discovery.statistics.fit import Fit
from ramiefenics.discovery.statistics.fit_scatter import fit_scatter
from ramiefenics.discovery.statistics.scatter import Scatter
from ramiefenics.discovery.statistics.verdict import (
    IMPROBABLE,
    SIGNIFICANCE,
    decide,
    resting_on_one,
)
from ramiefenics.effects import EFFECTS, SUSPECTS
from ramiefenics.published import published_test
from ramiefenics.runs import Runs, workers
from ramiefenics.specification import override

STALKS, FIT_SD, OWN, DRIFT, NOISE_LENGTH = 8, 0.1, 0.05, 0.003, 0.04
KNOWN = 1e-6
"""Standard deviation of the logarithm of a modulus that is known."""

SHORT = "fixture.span_mm=70"
VISIBLE = 0.002
"""Smallest change by an effect of typical size, relative to the peak, for the effect to be used.

The stalks are equal here, so that effects which distinguish specimens change nothing."""

NUMBERS = {
    "nothing": 200,
    "one": 1000,  # more than there are, thus all
    "two": 40,
    "not listed": 40,
    "one broken": 20,
    "two tests": 40,
}
SEED = 100000


def draw(case: Case, one: Evidence) -> Evidence:
    """Return random data for a case."""
    rng = np.random.default_rng([case.seed, len(case.kind)])
    evidence = repeated(one, list(range(case.tests)), STALKS)
    scatter = Scatter((OWN,) * evidence.by_own.shape[1], case.noise, NOISE_LENGTH, DRIFT)
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
    """Return the verdict on some data, and what it is based on."""
    rng = np.random.default_rng(seed)
    seen = find_broken(evidence, ())
    causes = find_causes(seen)
    seen = find_broken(seen, causes.best)
    causes = find_causes(seen)
    p = p_value_of_effect(seen, causes.nothing, rng)
    shown = p < SIGNIFICANCE or causes.none < IMPROBABLE
    chosen = causes.best if shown else ()
    fit = Fit(seen, chosen, fit_scatter(seen, chosen))
    misfit, conflict = p_value_of_misfit(fit, rng), fit.conflict()
    alone = resting_on_one(fit, causes)
    groups = [group for group in causes.groups() if chosen and alone.keys().isdisjoint(group)]
    return {
        "verdict": decide(shown, misfit, conflict, groups, bool(alone)),
        "groups": groups,
        "p": p,
        "misfit": misfit,
        "conflict": conflict,
        "broken": sorted(seen.broken),
        "probabilities": causes.inclusion(),
    }


def intervals(evidence: Evidence, case: Case) -> dict[str, tuple[float, float]]:
    """Return the intervals of the hidden amplitudes, given which effects are hidden."""
    names = tuple(name for name in case.hidden if name in evidence.suspects)
    fit = Fit(evidence, names, fit_scatter(evidence, names))
    return {name: fit.interval(name) for name in names}


def run(case: Case, one: Evidence) -> dict[str, Any]:
    """Draw the data of a case, and judge them."""
    evidence = draw(case, one)
    listed = {} if case.kind == "one broken" else intervals(evidence, case)
    return {**asdict(case), **judge(evidence, case.seed), "intervals": listed}


def uncertainties(evidence: Evidence, own: float = OWN) -> list[float]:
    """Return the standard deviations of amplitudes over typical ones, if an effect is alone.

    Parameters
    ----------
    evidence
        Evidence of all curves.
    own
        Standard deviation of the log factors between stalks.
    """
    scatter = Scatter((own,) * evidence.by_own.shape[1], NOISES[0], NOISE_LENGTH, DRIFT)
    information = np.diagonal(evidence.whiten(scatter).reduce().gram)
    typical = [abs(s.effect.typical) for s in evidence.suspects.values()] / evidence.scale
    return list(1.0 / (typical * np.sqrt(information)))


def limiting(one: Evidence) -> str:
    """Return a table of what limits the detection of effects, in Markdown."""
    first, both = (repeated(one, tests, STALKS) for tests in ([0], [0, 1]))
    known, exact = replace(first, factor_sd=KNOWN), replace(first, nuisance=0.0 * first.nuisance)
    columns = [
        uncertainties(first),
        uncertainties(known, KNOWN),
        uncertainties(exact),
        uncertainties(replace(exact, factor_sd=KNOWN), KNOWN),
        uncertainties(both),
    ]
    head = ["as above", "moduli known", "simulator exact", "both", "with a second test"]
    rows = [[n, *(f"{x:.2f}" for x in row)] for n, *row in zip(one.names, *columns, strict=True)]
    return table(["effect", *head], rows)


def page(records: dict[str, dict[str, Any]], one: Evidence) -> str:
    """Return the page, in Markdown."""
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
    return "\n".join(
        [
            "# Statistics of discovery",
            "",
            "Made by `./run python benchmarks/discovery_statistics.py`;",
            "[discovery.md](discovery.md) has the method.",
            f"Data sets of {STALKS} stalks are drawn from the signatures of one simulated stalk.",
            f"The batch's moduli are known to {100 * FIT_SD:g} %, those of single stalks differ by",
            f"{100 * OWN:g} %, and noise is 1 or 3 % of the peak force. Everything is linear, so",
            "that the statistics alone are tested; [discovery_cases.md](discovery_cases.md) tests",
            "the whole program.",
            "",
            "`named`: each hidden effect is named by itself or in a group, and nothing else is.",
            "`wrong`: a single effect is named that was not hidden. In the cases `not listed`, the",
            "hidden effect is not among the suspects, and a wrong name is that of another effect",
            "which has a similar signature.",
            "",
            confusion(records),
            f"Of {len(nulls)} p-values where nothing is hidden: {shares}. Of {len(held)} intervals "
            f"of 95 %, where it is known which effects are there, {sum(held)} contain the "
            f"amplitude ({100 * np.mean(held):.1f} %).",
            "",
            "![P-values where nothing is hidden, and how often probabilities are right]"
            "(discovery_statistics.png)",
            "",
            "## One effect",
            "",
            "By amplitude over the typical one, and noise: `+` named alone, the number of members",
            "where it is in a group, `-` not found, `!` another name.",
            "",
            by_effect(records, one.names),
            "## What limits it",
            "",
            "Standard deviation of each amplitude over the typical one, at 1 % noise, given that",
            "no other effect is present: as above; if the moduli of all stalks were known; if the",
            "simulator and its mesh had no error; with both; and as above with a second test of",
            f"each stalk, on a span of {SHORT.partition('=')[2]} mm. An effect of typical size is",
            "found in 95 % of data sets if this is below about a fifth, and told apart from others",
            "only if none of them has a similar signature.",
            "",
            limiting(one),
        ]
    )


def visible(one: Evidence) -> Evidence:
    """Return the evidence with those suspects only that change a curve."""

    def change(suspect: Suspect) -> float:
        return float(np.abs(suspect.effect.typical * suspect.signature).max())

    seen = {name: s for name, s in one.suspects.items() if change(s) > VISIBLE}
    return replace(one, suspects=seen)


def main() -> None:
    """Run the cases that are not recorded yet, then write the page and its figure."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cases", type=int, help="stop after so many")
    arguments = parser.parse_args()
    test = override(published_test("table3"), ["numerics.mesh=screening"])
    with workers() as pool:
        runs = Runs(executor=pool)
        both = [test, override(test, [SHORT])]
        one = visible(predicted_evidence(both, SUSPECTS, FIT_SD, runs))
        todo = dict(itertools.islice(cases(one.names, NUMBERS, SEED), arguments.cases))
        records = {k: v for k, v in read_record("discovery_statistics").items() if k in todo}
        waiting = [label for label in todo if label not in records]
        for label, found in zip(
            waiting, pool.map(run, [todo[k] for k in waiting], itertools.repeat(one)), strict=False
        ):
            records[label] = found
            write_record("discovery_statistics", records)
    (DOCS / "discovery_statistics.md").write_text(page(records, one) + "\n")
    figure(records).savefig(DOCS / "discovery_statistics.png")


if __name__ == "__main__":
    main()

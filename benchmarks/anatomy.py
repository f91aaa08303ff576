"""Effects that nobody suspects, hidden in finite-element curves and learned as free functions.

    ./run python benchmarks/anatomy.py [--cases N]

Takes a quarter of an hour for each of eight cases on two cores. Keeps finished cases in
`records/anatomy.json`, and writes `docs/discovery_anatomy.md` with its picture.
"""

from __future__ import annotations

import argparse
import tempfile
import warnings
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure
from record import DOCS, read_record, table, write_record

from ramiefenics import SpecificationWarning, read_dataset
from ramiefenics.discovery.anatomy import Anatomist
from ramiefenics.discovery.curves.observed import observe
from ramiefenics.discovery.curves.prediction import Predictor
from ramiefenics.discovery.search.fitting import Fitter
from ramiefenics.discovery.statistics.verdict import ENOUGH
from ramiefenics.discovery.synthetic import Secret, make_dataset
from ramiefenics.discovery.synthetic.datasets import HEIGHTS_MM
from ramiefenics.effects import EFFECTS, Effect
from ramiefenics.results.style import BLUE, GREY, STYLE, VERMILION
from ramiefenics.runs import Runs, workers
from ramiefenics.specification import BendingTest

SEED = 640000


def _stiffest_half_way(test: BendingTest, amount: float) -> BendingTest:
    """Lower the moduli by a share at both ends of the plant, quadratically from its middle."""
    heights = np.linspace(*HEIGHTS_MM, 13)
    middle, half = np.mean(HEIGHTS_MM), np.ptp(HEIGHTS_MM) / 2.0
    factors = 1.0 - amount * ((heights - middle) / half) ** 2
    stalk = replace(test.stalk, place_mm=tuple(heights), place_factor=tuple(map(float, factors)))
    return replace(test, stalk=stalk)


HALF_WAY = Effect(
    name="stiffest_half_way_up",
    physics="Moduli fall off with the square of the distance from the middle of the plant.",
    reference="",
    unit="1",
    bounds=(0.0, 0.9),
    typical=0.4,
    apply=_stiffest_half_way,
)


@dataclass(frozen=True)
class Case:
    """A hidden effect, its amplitude relative to the typical one, and the place where it acts."""

    effect: Effect
    size: float
    place: str


CASES = (
    Case(EFFECTS["machine_compliance"], 1.0, "machine"),
    Case(EFFECTS["nonlinear_compliance"], 1.0, "machine"),
    Case(EFFECTS["bimodular_fibre"], 1.0, "fibre"),
    Case(HALF_WAY, 1.0, "height"),
    Case(EFFECTS["fibre_damage"], 0.5, "fibre"),
    Case(EFFECTS["bimodular_fibre"], 2.0, "fibre"),
    Case(EFFECTS["fibre_strength"], 2.0, "fibre"),
    Case(EFFECTS["fibre_damage"], 1.0, "fibre"),
)


def run(case: Case, seed: int) -> dict[str, Any]:
    """Hide an effect, learn without suspects, and return the learned and the hidden function."""
    amplitude = case.size * case.effect.typical
    with tempfile.TemporaryDirectory() as folder, workers() as pool:
        runs = Runs(executor=pool)
        make_dataset(Path(folder), Secret(case.effect, amplitude), seed, runs)
        dataset = read_dataset(folder)
        observed = observe(dataset)
        tests = [record.test for record in dataset.records]
        baseline = Fitter(dataset, observed, Predictor(tests, observed, runs)).baseline()
        anatomist = Anatomist(dataset, observed, Predictor(tests, observed, runs))
        learned, gains = anatomist.learn(baseline)
    test = baseline.curves.model.test(dataset.baseline, learned.fit.mean_log_factors)
    place = learned.place
    mean, low, _ = learned.function(test)
    truth = place.function(case.effect.apply(test, amplitude), place.at)
    heights = np.array([test.stalk.position_mm for test in tests])
    if case.place == place.name == "height":
        factors = case.effect.apply(test, amplitude).stalk.factor_at(heights)
        truth = truth / np.mean(factors)
    return {
        "hidden": case.effect.name,
        "amplitude": amplitude,
        "unit": case.effect.unit,
        "right_place": case.place,
        "place": place.name,
        "gains": gains,
        "x": place.x_label,
        "y": place.y_label,
        "at": place.at.tolist(),
        "baseline": place.function(test, place.at).tolist(),
        "truth": truth.tolist(),
        "learned": mean.tolist(),
        "half": (mean - low).tolist(),
    }


def supported(found: dict[str, Any]) -> bool:
    """Return whether a function in some place explains more than chance would."""
    return max(found["gains"].values()) > ENOUGH


def held(found: dict[str, Any]) -> float:
    """Return the share of the points at which the band contains the truth."""
    off = np.abs(np.subtract(found["truth"], found["learned"]))
    return float(np.mean(off <= np.array(found["half"]) + 1e-9))


def picture(found: list[dict[str, Any]]) -> Figure:
    """Draw what is hidden beside what is learned, beyond the baseline's own functions."""
    with mpl.rc_context(STYLE | {"font.size": 8.0}):
        figure = Figure(figsize=(8.2, 2.7 * -(-len(found) // 3)), layout="constrained")
        grid = figure.subplots(-(-len(found) // 3), 3, squeeze=False).ravel()
        for axes, one in zip(grid, found, strict=False):
            at, baseline, half = (np.array(one[key]) for key in ("at", "baseline", "half"))
            mean, truth = (np.array(one[key]) - baseline for key in ("learned", "truth"))
            axes.fill_between(at, mean - half, mean + half, color=VERMILION, alpha=0.25, lw=0)
            axes.plot(at, mean, color=VERMILION, label="learned, with 95 % band")
            axes.plot(at, truth, "--", color=BLUE, label="hidden")
            axes.axhline(0.0, color=GREY, lw=0.8)
            axes.set_title(f"{one['hidden'].replace('_', ' ')} {_amplitude(one)}", fontsize=8)
            axes.set_xlabel(one["x"])
            label = f"Added {one['y'][0].lower()}{one['y'][1:]}"
            axes.set_ylabel(label.replace(", ", ",\n", 1))
        for axes in grid[len(found) :]:
            axes.set_axis_off()
        grid[0].legend(fontsize=7, frameon=False)
    return figure


def _amplitude(one: dict[str, Any]) -> str:
    return f"{one['amplitude']:g} {'' if one['unit'] == '1' else one['unit']}".strip()


def page(found: list[dict[str, Any]]) -> str:
    """Return the page, in Markdown."""
    shown = [one for one in found if supported(one)]
    right = [one for one in shown if one["place"] == one["right_place"]]
    rows = [
        [
            one["hidden"],
            _amplitude(one),
            one["place"] if one in shown else "none",
            ", ".join(f"{name} {gain:.1f}" for name, gain in one["gains"].items()),
            f"{100.0 * held(one):.0f} %" if one in right else "",
        ]
        for one in found
    ]
    head = ["hidden", "amplitude", "place found", "gain in log-evidence", "truth within the band"]
    return (
        "# Anatomy of hidden effects\n\n"
        "Made by `./run python benchmarks/anatomy.py`: eight stalks, simulated by finite elements "
        "on a mesh of their own, 1 % noise, with an effect that is not among the suspects; "
        "[discovery_method.md](discovery_method.md#anatomy-of-the-unknown) describes the method. "
        f"{len(found)} of {len(CASES)} cases so far. Where no place gains more than {ENOUGH:g}, "
        "`discover` says that none explains more than chance would; of the other "
        f"{len(shown)} places, {len(right)} are right. The last column is the share of the points "
        "at which the 95 % band of the learned function contains the hidden one.\n\n"
        + table(head, rows)
        + "\n![What was hidden, and what was learned](discovery_anatomy.png)\n"
    )


def main() -> None:
    """Run the cases that are not recorded yet, then write the page and its picture."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cases", type=int, default=len(CASES), help="stop after so many")
    arguments = parser.parse_args()
    warnings.simplefilter("ignore", SpecificationWarning)
    known, found = read_record("anatomy"), {}
    for number, case in enumerate(CASES[: arguments.cases]):
        label = f"{case.effect.name} {case.size:g}"
        found[label] = known.get(label) or run(case, SEED + number)
        write_record("anatomy", known | found)
        one = found[label]
        print(label, one["place"], one["gains"], f"{held(one):.2f}", flush=True)
    every = list(found.values())
    (DOCS / "discovery_anatomy.md").write_text(page(every))
    picture([one for one in every if supported(one)]).savefig(DOCS / "discovery_anatomy.png")


if __name__ == "__main__":
    main()

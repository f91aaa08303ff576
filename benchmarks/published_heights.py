"""What the published maximum forces, three heights and three stalks, can tell of what is missing.

    ./run python benchmarks/published_heights.py

Simulates the study's stalks with every suspected effect, and compares sets of effects by the
maximum forces alone, because no curves were published as numbers. Takes five minutes on one core.
Keeps the simulated forces in `records/published_heights.json`, and writes
`docs/published_heights.md`.
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from record import DOCS, read_record, table, write_record
from scipy.stats import chi2

from ramiefenics import BendingTest, SpecificationWarning, override, published_test
from ramiefenics.discovery.curves.blocks import Array, Blocks
from ramiefenics.discovery.curves.factors import factors
from ramiefenics.discovery.curves.linearised import Model
from ramiefenics.discovery.curves.observed import Observed
from ramiefenics.discovery.curves.prediction import Predictor
from ramiefenics.discovery.report.wording import words
from ramiefenics.discovery.statistics.causes import Causes, all_sets, log_evidence_gains
from ramiefenics.discovery.statistics.evidence import PRIOR
from ramiefenics.discovery.statistics.scatter import OWN, Scatter
from ramiefenics.discovery.statistics.verdict import SIGNIFICANCE
from ramiefenics.discovery.statistics.whitened import Reduced
from ramiefenics.effects import EFFECTS, SUSPECTS
from ramiefenics.runs import Runs, workers

POINTS = 28
THICKER = 1.05
SPECIMENS = 10
"""Number of specimens behind each mean force."""

HEAD = """# Three heights and three stalks: what the published forces tell

Made by `./run python benchmarks/published_heights.py`. The study tested ten stalks at each of \
three heights above ground, 19, 69 and 119 cm, and prints the mean maximum force of each, and \
those of three single stalks with their dimensions (Table 8). Its curves are not published as \
numbers, so `discover` cannot be used. Its statistics can: here are the six forces, with the \
study's constants and no calibration, and sets of up to three of the usual suspects compared by \
them. The diameters at the heights follow from Table 1; forces are extrapolated to vanishing \
cells.

"""
MIDDLE = """
- **With the diameters of Table 1, the constants predict the mean forces at all three heights**, \
5 to 12 % too high, which is within what moduli known to 10 % allow. Nothing that changes with \
height is missing.
- **The stalks of Table 8 bear much less than simulated.** By their forces they can only be from \
the middle height, where Table 1 has a diameter of 13.5 mm, and they have 14.3 to 15.1 mm. The \
simulated force grows with the power 2.7 of all diameters, yet these thicker stalks bear what the \
thinner ones do.

The table shows what would explain this. Its last column is the change of the moduli along the \
plant, per metre, if that is all that is missing; a group contains at least one effect that is \
present, with a probability of 95 %, and the amplitude that each needs if it is the only one.

"""
TAIL = """
- **No cause can be named from six forces.** The stalks of Table 8 need a load that reads 30 % \
too low, a wall 0.6 mm thinner than printed, or fibres that are damaged three times as much as is \
typical. Each is larger than one would believe. If the moduli are known to 30 % only, all of them \
are lower by a similar factor, and nothing is missing.
- **The printed diameters are the first thing to doubt.** If the plants of Table 1 are thinner \
than those tested, by about a tenth, all six forces are too high by the same factor. If Table 1 \
is right, the forces at the heights and those of Table 8 contradict each other, whatever is \
common to all.
- The study's own simulations of these three stalks are within 5 % of the measured forces, with \
the same constants; [published_peak.md](published_peak.md) says how that may have come about.
- What would tell: the diameters of each stalk at the loaded section, and a second span.

Assumed besides: moduli of single stalks that differ by 5 %, and diameters at each height known \
to 2 %. The printed standard deviations of the forces, 5.01, 5.51 and 4.08 N, are nearly the same \
figures as those printed for the moduli at these heights, in MPa; they may be a copying error.
"""

DIAMETER_SD = 0.02
"""Standard deviation of the logarithm of the diameters at each height of Table 1."""


@dataclass(frozen=True)
class Measured:
    """A maximum force of the study, in N.

    Attributes
    ----------
    force_N, sd_N
        Mean and standard deviation of ten specimens; zero for a single stalk.
    position_mm
        Height above ground. Of the stalks of Table 8 it is not printed, but their forces are
        possible at the middle one of the three heights only.
    """

    force_N: float
    sd_N: float = 0.0
    position_mm: float = 690.0


HEIGHTS = {
    "height-19cm": Measured(132.37, 5.01, 190.0),
    "height-69cm": Measured(84.8, 5.51),
    "height-119cm": Measured(54.87, 4.08, 1190.0),
}
STALKS = {
    "table8-1": Measured(92.42),
    "table8-2": Measured(76.69),
    "table8-3": Measured(83.44),
}
ALL = HEIGHTS | STALKS


@dataclass(frozen=True)
class Account:
    """Which forces are to be explained, and what is assumed.

    Attributes
    ----------
    title
        What the page calls it.
    names
        The forces.
    fit_sd
        How well the moduli are known: standard deviation of their logarithms.
    diameter_sd
        The same of the diameters of Table 1, all together.
    """

    title: str
    names: tuple[str, ...]
    fit_sd: float = 0.1
    diameter_sd: float = 0.0


ACCOUNTS = (
    Account("the heights alone", tuple(HEIGHTS)),
    Account("the stalks of Table 8 alone", tuple(STALKS)),
    Account("all, diameters of Table 1 as printed", tuple(ALL)),
    Account("all, diameters of Table 1 known to 5 %", tuple(ALL), diameter_sd=0.05),
    Account("the same, moduli known to 30 %", tuple(ALL), 0.3, 0.05),
)


def tests() -> list[BendingTest]:
    """Return the tests of all stalks, and of those at the heights with larger diameters."""
    found = []
    for name, measured in ALL.items():
        key = f"stalk.position_mm={measured.position_mm}"
        found.append(override(published_test(name), ["numerics.mesh=screening", key]))
    return found + [thicker(test) for test in found[: len(HEIGHTS)]]


def thicker(test: BendingTest) -> BendingTest:
    """Return the test of a stalk with all diameters larger by the same factor."""
    stalk = test.stalk
    layers = [replace(x, outer_diameter_mm=THICKER * x.outer_diameter_mm) for x in stalk.layers]
    void = THICKER * stalk.void_diameter_mm
    return replace(test, stalk=replace(stalk, void_diameter_mm=void, layers=tuple(layers)))


def simulated() -> dict[str, Any]:
    """Return the maximum forces, and the changes of their logarithms."""
    stalks, number = tests(), len(ALL)
    travel = stalks[0].protocol.travel_mm
    at = np.tile((np.arange(POINTS) + 1.0) / POINTS * travel, (len(stalks), 1))
    blocks = Blocks.of([str(index) for index in range(len(stalks))], POINTS)
    nothing = Observed(at, np.zeros_like(at), np.ones(len(stalks)), blocks)
    suspects = {n: EFFECTS[n].centred(stalks[:number]).as_found(stalks) for n in SUSPECTS}
    used = factors(stalks[0])
    model = Model(used, np.zeros((len(stalks), len(used))))
    with workers() as pool:
        curves = Predictor(stalks, nothing, Runs(executor=pool)).linearise(model, suspects)
    peak = curves.force.max(axis=1)
    top = np.arange(number), slice(None), curves.force.argmax(axis=1)[:number]
    by_effects = {
        name: np.log((curves.force + suspects[name].typical * by).max(axis=1) / peak)[:number]
        for name, by in curves.by_effects.items()
    }
    larger = np.log(peak[number:] / peak[: len(HEIGHTS)]) / np.log(THICKER)
    return {
        "force_N": dict(zip(ALL, peak.tolist(), strict=False)),
        "by_factors": (curves.by_common[top] / peak[:number, None]).tolist(),
        "by_diameter": [*larger.tolist(), *[0.0] * len(STALKS)],
        "by_effects": {name: by.tolist() for name, by in by_effects.items()},
    }


def compared(account: Account, found: dict[str, Any]) -> tuple[Causes, Reduced, Array, float]:
    """Return the posterior over sets of effects, what it rests on, and the p-value of no effect.

    Everything is linear in the logarithms of the forces, and all deviations are Gaussian.
    """
    rows = [list(ALL).index(name) for name in account.names]
    measured = [ALL[name] for name in account.names]
    simulated_N = [found["force_N"][name] for name in account.names]
    y = np.log([m.force_N for m in measured]) - np.log(simulated_N)
    by_factors = np.array(found["by_factors"])[rows]
    by_diameter = np.array(found["by_diameter"])[rows]
    single = np.array([1.0 if m.sd_N == 0.0 else 1.0 / SPECIMENS for m in measured])
    errors = np.array([(m.sd_N / m.force_N) ** 2 / SPECIMENS for m in measured])
    errors += OWN[0] ** 2 * (by_factors**2).sum(axis=1) * single + (DIAMETER_SD * by_diameter) ** 2
    covariance = account.fit_sd**2 * by_factors @ by_factors.T + np.diag(errors)
    covariance += account.diameter_sd**2 * np.outer(by_diameter, by_diameter)
    names = tuple(found["by_effects"])
    typical = np.array([EFFECTS[name].typical for name in names])
    signatures = PRIOR * np.sign(typical) * np.array([*found["by_effects"].values()]).T[rows]
    scale = PRIOR * np.abs(typical)
    weighed = np.linalg.solve(covariance, np.column_stack([signatures, y]))
    reduced = Reduced(signatures.T @ weighed[:, :-1], signatures.T @ weighed[:, -1:], np.zeros(1))
    bounds = np.array([EFFECTS[name].bounds for name in names]) / scale[:, None]
    sets = all_sets(len(names))
    gains = log_evidence_gains(reduced, bounds, sets)[:, 0]
    scatter = Scatter.typical(by_factors.shape[1])
    p = float(chi2.sf(y @ weighed[:, -1], len(y)))
    return Causes(names, sets, gains, scatter, scatter), reduced, scale, p


def alone(name: str, causes: Causes, reduced: Reduced, scale: Array) -> str:
    """Return the amplitude that an effect needs if it is the only one, with its unit."""
    index = causes.names.index(name)
    mean, covariance = reduced.amplitudes([index])
    value, sd = float(scale[index] * mean[0]), float(scale[index] * covariance[0, 0] ** 0.5)
    unit = EFFECTS[name].unit
    return f"{value:.2g} ± {1.96 * sd:.2g}{'' if unit == '1' else ' ' + unit}"


def page(found: dict[str, Any]) -> str:
    """Return the page, in Markdown."""
    force = found["force_N"]
    forces = [
        [name, f"{m.force_N:.1f}", f"{force[name]:.1f}", f"{force[name] / m.force_N:.2f}"]
        for name, m in ALL.items()
    ]
    rows = []
    for account in ACCOUNTS:
        causes, reduced, scale, p = compared(account, found)
        group = causes.groups()[0] if p < SIGNIFICANCE else ()
        said = " or ".join(f"{words(name)} {alone(name, causes, reduced, scale)}" for name in group)
        gradient = alone("stiffness_gradient", causes, reduced, scale)
        rows.append([account.title, f"{p:.2g}", f"{causes.none:.2f}", said, gradient])
    head = ["what is explained", "p of no effect", "probability of none", "group", "gradient"]
    measured = table(["stalk", "measured (N)", "simulated (N)", "ratio"], forces)
    return HEAD + measured + MIDDLE + table(head, rows) + TAIL


def main() -> None:
    """Simulate what is not recorded yet, and write the page."""
    warnings.simplefilter("ignore", SpecificationWarning)
    found = read_record("published_heights") or simulated()
    write_record("published_heights", found)
    (DOCS / "published_heights.md").write_text(page(found))


if __name__ == "__main__":
    main()

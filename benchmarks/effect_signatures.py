"""Change of the force curve by every effect, and the effects for which it can be mistaken.

    OMP_NUM_THREADS=1 ./run python benchmarks/effect_signatures.py

Takes an hour on two cores; simulations done before are reused. Writes
`records/effect_signatures.json` and the figures of `docs/effects.md`; afterwards
`benchmarks/effects.py` writes that page.

The curves are those of a mean ramie stalk on the recipe `screening`, as the machine records them. A
fit of the layers' moduli, each known to 10 %, removes a part of a signature s. With errors of
covariance E, the part ``E C^-1 s`` remains, where ``C = E + D S D^T`` follows from the derivatives
D of the curve by the moduli's logarithms and their prior covariance S (Tarantola 2005, section
3.2). Two effects look alike if their vectors ``C^-1/2 s`` point in the same direction. With a
second test of the same stalk, s and D are those of both tests, one after the other.
"""

from __future__ import annotations

import contextlib
import warnings
from dataclasses import dataclass
from typing import Any

import matplotlib as mpl
import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from numpy.typing import NDArray
from record import DOCS, write_record

from ramiefenics import BendingTest, SpecificationError, SpecificationWarning, override
from ramiefenics.discovery.curves.factors import factors
from ramiefenics.effects import EFFECTS, Effect
from ramiefenics.published.stalks import ramie
from ramiefenics.results.style import BLUE, GREY, SKY, STYLE, VERMILION
from ramiefenics.runs import Done, KeptRun, Runs, Simulation, workers
from ramiefenics.runs.curve import CurveTask

PRIOR_SD, ERROR_SHARE = 0.1, 0.01
"""Standard deviations of the moduli's logarithms, and of the curve relative to its peak."""

LEAST_SHARE = 5e-3
"""Smallest change of the force, relative to the peak, that stands out from errors of the steps."""

ALIKE_DEG = 30.0

SECOND: dict[str, list[str]] = {
    "span 70 mm": ["fixture.span_mm=70"],
    "radii 10 mm": ["fixture.indenter_radius_mm=10", "fixture.support_radius_mm=10"],
    "turned by 90 degrees": ["numerics.domain=full", "stalk.rotation_deg=90"],
    "a hundred times faster": ["protocol.speed_mm_per_s=100"],
    "unloaded": ["protocol.then=[{to_mm=0}]"],
}
"""Settings of second tests of the same stalk, by description.

The last one continues where the first test ends."""

Array = NDArray[np.float64]
GRID_MM = np.linspace(0.25, 14.0, 56)


@dataclass(frozen=True)
class Baseline:
    """A stalk without effects.

    Attributes
    ----------
    force_N
        Force on the grid.
    slopes_N
        Derivatives of the force by the moduli's logarithms, shape (grid, moduli).
    """

    force_N: Array
    slopes_N: Array

    @classmethod
    def read(cls, curve: pd.DataFrame) -> Baseline:
        """Interpolate a curve and its derivatives to the grid."""
        columns = [np.interp(GRID_MM, curve["displacement_mm"], curve[x]) for x in curve.columns]
        return cls(columns[1], np.array(columns[2:]).T)

    @property
    def peak_N(self) -> float:
        """Largest force."""
        return float(self.force_N.max())

    def covariance(self, points: NDArray[np.bool_]) -> Array:
        """Return the joint covariance of errors and moduli at some points of the grid, N^2."""
        slopes = self.slopes_N[points]
        errors = (ERROR_SHARE * self.peak_N) ** 2 * np.eye(len(slopes))
        return np.asarray(errors + PRIOR_SD**2 * slopes @ slopes.T)

    def left(self, signature_N: Array) -> Array:
        """Return the part of a signature that remains after a fit of the moduli, N; NaN stays."""
        found = np.full_like(signature_N, np.nan)
        points = np.isfinite(signature_N)
        explained = np.linalg.solve(self.covariance(points), signature_N[points])
        found[points] = (ERROR_SHARE * self.peak_N) ** 2 * explained
        return found

    def cosine(self, one_N: Array, other_N: Array) -> float:
        """Return the cosine of the angle between two signatures, over their common points."""
        points = np.isfinite(one_N) & np.isfinite(other_N)
        a, b = one_N[points], other_N[points]
        weights = np.linalg.inv(self.covariance(points))
        return float(a @ weights @ b / np.sqrt((a @ weights @ a) * (b @ weights @ b)))

    def with_other(self, other: Baseline) -> Baseline:
        """Return the baseline of two tests of the same stalk, one after the other."""
        slopes = np.concatenate([self.slopes_N, other.slopes_N])
        return Baseline(np.concatenate([self.force_N, other.force_N]), slopes)

    @property
    def band_N(self) -> Array:
        """Half width of the force's 95 % interval due to the uncertain moduli, N."""
        return np.asarray(1.96 * PRIOR_SD * np.sqrt((self.slopes_N**2).sum(axis=1)))


def recorded(curve: pd.DataFrame, unloading: bool = False) -> Array:
    """Return the recorded force on the grid, N; NaN where there is none.

    Parameters
    ----------
    curve
        Curve of a result.
    unloading
        Whether to take the part after the turning point, instead of the part before it.
    """
    travel, force = curve["recorded_displacement_mm"], curve["recorded_force_N"]
    turn = int(np.argmax(travel))
    if unloading:
        part = slice(len(curve) - 1, turn - 1 if turn else None, -1)
        return np.interp(GRID_MM, travel[part], force[part], left=np.nan, right=np.nan)
    return np.interp(GRID_MM, travel[: turn + 1], force[: turn + 1], right=np.nan)


def signature(baseline: Baseline, effect: Effect, test: BendingTest, run: Done[KeptRun]) -> Any:
    """Return an effect's change of the force on the grid, N, or the reason why there is none."""
    if run.error is not None:
        return f"not simulated: {run.error}"
    result = run.result().result
    if result.jumps:
        return f"not smooth: the stalk jumps at {result.jumps[0].displacement_mm:.1f} mm"
    change = recorded(result.curve) - baseline.force_N
    if np.nanmax(np.abs(change)) > LEAST_SHARE * baseline.peak_N:
        return change
    if effect.covariates:
        return "none: it tells specimens apart"
    return "none in this test"


def angle_deg(baseline: Baseline, one: tuple[Effect, Array], other: tuple[Effect, Array]) -> float:
    """Return the angle between signatures, ignoring signs if an amplitude may have both."""
    cosine = baseline.cosine(one[1], other[1])
    if any(effect.bounds[0] < 0.0 for effect, _ in (one, other)):
        cosine = abs(cosine)
    return float(np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0))))


def panels(baseline: Baseline, found: dict[str, Array]) -> Figure:
    """Draw all signatures, each with the band of changes that other moduli could cause."""
    columns = 5
    rows = -(-len(found) // columns)
    with mpl.rc_context(STYLE | {"font.size": 7.0}):
        drawing = Figure(figsize=(8.2, 1.35 * rows + 0.5), layout="constrained")
        grid = drawing.subplots(rows, columns, sharex=True, squeeze=False).ravel()
        share = 100.0 / baseline.peak_N
        band = share * baseline.band_N
        for axes, (name, change) in zip(grid, found.items(), strict=False):
            label = "95 % of what other moduli cause"
            axes.fill_between(GRID_MM, -band, band, color=SKY, alpha=0.35, lw=0, label=label)
            axes.plot(GRID_MM, share * change, color=VERMILION, lw=1.4, label="change")
            left = share * baseline.left(change)
            axes.plot(GRID_MM, left, "--", color=BLUE, lw=1.1, label="left after a fit of moduli")
            axes.axhline(0.0, color=GREY, lw=0.6)
            effect = EFFECTS[name]
            unit = "" if effect.unit == "1" else f" {effect.unit}"
            axes.set_title(f"{name}\n{effect.typical:g}{unit}", fontsize=7)
        for axes in grid[len(found) :]:
            axes.set_axis_off()
        for axes in grid[len(found) - columns : len(found)]:  # without a panel below
            axes.tick_params(labelbottom=True)
        drawing.legend(*grid[0].get_legend_handles_labels(), loc="outside upper center", ncols=3)
        drawing.supxlabel("Displacement (mm)")
        drawing.supylabel("Change of force (% of the peak)")
    return drawing


def heat_map(names: list[str], angles: Array) -> Figure:
    """Draw the matrix of angles."""
    with mpl.rc_context(STYLE | {"font.size": 6.0, "axes.grid": False}):
        drawing = Figure(figsize=(8.2, 7.6), layout="constrained")
        axes = drawing.subplots()
        image = axes.imshow(angles, cmap="cividis", vmin=0.0, vmax=180.0)
        for (i, j), angle in np.ndenumerate(angles):
            colour = "w" if angle < 90.0 else "k"
            axes.text(j, i, f"{angle:.0f}", ha="center", va="center", color=colour, fontsize=5)
        axes.set_xticks(range(len(names)), names, rotation=90)
        axes.set_yticks(range(len(names)), names)
        drawing.colorbar(image, label="Angle (degrees)", shrink=0.7)
    return drawing


def second(runs: Runs, test: BendingTest, what: str) -> tuple[Baseline, dict[str, Array]]:
    """Return the baseline of a second test, and all smooth signatures in it.

    Derivatives in unloading are those in loading, in proportion to the force, because the baseline
    is elastic.
    """
    other, unloading = override(test, SECOND[what]), what == "unloaded"
    loading = override(other, ["protocol.then=[]"])
    (curve,) = runs.map([CurveTask(loading, factors(test))])
    baseline = Baseline.read(curve.result())
    if unloading:
        (back,) = runs.map([Simulation(other)])
        force = np.nan_to_num(recorded(back.result().result.curve, unloading))
        share = force / baseline.force_N
        baseline = Baseline(force, share[:, None] * baseline.slopes_N)
    changes = {}
    tests = _changed(other)
    for name, done in zip(tests, runs.map([Simulation(t) for t in tests.values()]), strict=True):
        if done.error is None and not done.result().result.jumps:
            changed = recorded(done.result().result.curve, unloading)
            changes[name] = changed - baseline.force_N
    return baseline, changes


def main() -> None:
    """Run the simulations that are not kept yet, then write the record and the figures."""
    warnings.simplefilter("ignore", SpecificationWarning)
    settings = ["numerics.mesh=screening", "numerics.acoustic_check=false"]
    test = override(ramie(14.23, 7.28, 0.67), settings)
    with workers() as pool:
        runs = Runs(executor=pool)
        (curve,) = runs.map([CurveTask(test, factors(test))])
        baseline = Baseline.read(curve.result())
        done = runs.map([Simulation(e.apply(test, e.typical)) for e in EFFECTS.values()])
        either = {
            name: signature(baseline, effect, test, run)
            for (name, effect), run in zip(EFFECTS.items(), done, strict=True)
        }
        found = {name: change for name, change in either.items() if not isinstance(change, str)}
        both = {
            what: (baseline.with_other(base), _joined(found, changes))
            for what in SECOND
            for base, changes in [second(runs, test, what)]
        }
    alone = angles(baseline, found)
    together = {what: angles(base, changes) for what, (base, changes) in both.items()}
    record: dict[str, dict[str, Any]] = {}
    for name, change in either.items():
        record[name] = {"amplitude": EFFECTS[name].typical}
        if isinstance(change, str):
            record[name]["word"] = change
            continue
        alike = sorted(
            (angle, other)
            for (one, other), angle in alone.items()
            if one == name != other and angle < ALIKE_DEG
        )
        record[name] |= {
            "rms_percent": percent(change, baseline),
            "left_percent": percent(baseline.left(change), baseline),
            "alike": {other: round(angle) for angle, other in alike},
            "with_second_test": {
                other: _with_second(together, (name, other)) for _, other in alike
            },
        }
    write_record("effect_signatures", record)
    panels(baseline, found).savefig(DOCS / "effects_signatures.png")
    matrix = np.array([[alone[a, b] for b in found] for a in found])
    heat_map(list(found), matrix).savefig(DOCS / "effects_angles.png")


def angles(baseline: Baseline, changes: dict[str, Array]) -> dict[tuple[str, str], float]:
    """Return the angles of all pairs of signatures."""
    pairs = [(EFFECTS[name], change) for name, change in changes.items()]
    return {(a[0].name, b[0].name): angle_deg(baseline, a, b) for a in pairs for b in pairs}


def _with_second(
    together: dict[str, dict[tuple[str, str], float]], pair: tuple[str, str]
) -> dict[str, int]:
    return {what: round(of[pair]) for what, of in together.items() if pair in of}


def _joined(first: dict[str, Array], others: dict[str, Array]) -> dict[str, Array]:
    return {n: np.concatenate([first[n], others[n]]) for n in first if n in others}


def _changed(test: BendingTest) -> dict[str, BendingTest]:
    """Return the test with each of the effects that apply to it, by name."""
    found = {}
    for name, effect in EFFECTS.items():
        with contextlib.suppress(SpecificationError):
            found[name] = effect.apply(test, effect.typical)
    return found


def percent(change_N: Array, baseline: Baseline) -> float:
    """Return the root mean square of a change, in percent of the peak, to two digits."""
    return round(100.0 * float(np.sqrt(np.nanmean(change_N**2))) / baseline.peak_N, 2)


if __name__ == "__main__":
    main()

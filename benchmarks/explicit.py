"""Effect of the speed of an explicit test on the force, for the calibration stalk.

    ./run python benchmarks/explicit.py

Takes ten minutes of CPU time. Keeps every finished run in `records/explicit.json`, and writes
`docs/explicit.md` and the figure `docs/explicit.png` at the end.
"""

from __future__ import annotations

import math
import time
import warnings
from collections.abc import Callable, Mapping
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import StrMethodFormatter
from record import DOCS, run_all, table
from scipy.interpolate import PchipInterpolator

from ramiefenics import (
    BendingTest,
    SpecificationWarning,
    override,
    published_test,
    simulate,
    simulate_explicitly,
)
from ramiefenics.results.style import BLUE, GREY, STYLE, VERMILION
from ramiefenics.solve.explicit_result import QUASI_STATIC

MESH = "ladder_q1_1"
DURATIONS_S = (0.0025, 0.005, 0.01, 0.02, 0.05, 0.1)
SCALED = ((0.1, 25.0), (0.1, 100.0))
"""Durations, s, and mass factors of the tests with scaled mass."""

OTHER_MESHES = {"ladder_q1_2": 0.02, "screening": 0.03}
"""Durations, s, of the tests on two further meshes, the second of which is of second order."""

COLUMNS = (
    "displacement_mm",
    "force_N",
    "support_force_N",
    "kinetic_energy_Nmm",
    "stored_energy_Nmm",
    "indenter_work_Nmm",
)
DRAWN_S = (0.0025, 0.005, 0.01, 0.02, 0.1)

Rows = Mapping[str, Mapping[str, Any]]

HEAD = r"""# Explicit dynamics

Written by `./run python benchmarks/explicit.py`. The stalk of the calibration (`table3`) is bent
to 14 mm of travel with inertia, by explicit time integration, as a quarter model with the default
law and friction. The force is compared with the quasi-static curve on the same mesh (`implicit`,
steps of 0.25 mm).

The published study used LS-DYNA, an explicit code, but states neither the speed of the indenter
nor the mass scaling. With time steps of a microsecond, a test cannot be simulated at the speed of
a testing machine, where it takes minutes. Two questions follow: does explicit integration give the
same force, and how fast may the simulated test be?

![Force against travel at several speeds; errors against duration](explicit.png)

## Method

The weak form, the material laws and the contact are those of the quasi-static simulation. With the
lumped mass $M$ and the residual $\mathcal{R}$, the central difference method (Belytschko, Liu and
Moran 2000, section 6.2) gives

$$
M \frac{v^+ - v^-}{\Delta t} = -\mathcal{R}(u + \beta \, \Delta t \, v^-), \qquad
u^+ = u + \Delta t \, v^+, \qquad
\Delta t = \frac{0.9 \cdot 2}{\omega_\mathrm{max} \sqrt{1 + 2 \beta}}
$$

For $\beta = 0$ this is the limit of Courant, Friedrichs and Lewy (1928). The highest angular
frequency $\omega_\mathrm{max}$ is computed from the tangent by Arnoldi's method (1951) every 0.1 mm
of travel. The damping $\beta = 0.06$ acts fully on vibrations of that frequency, and on slower ones
in proportion to their frequency.
Slow vibrations are damped by a drag on the difference between the velocity and its mean over a
twentieth of the test (Akervik et al. 2006). The velocity of the indenter is

$$
v(t) = V (10 x^3 - 15 x^4 + 6 x^5), \qquad
x = \min \left( \frac{t}{0.2 \, T}, 1 \right), \qquad
V = \frac{14 \text{ mm}}{0.9 \, T}
$$

for a test of duration $T$. Forces are averaged over 0.1 mm of travel on either side and not
filtered otherwise. Because the material does not depend on rate, multiplying all masses by $f$
(mass scaling) has the same effect as shortening the test by the factor $\sqrt{f}$. The energy error
is the difference between the work of the indenter and the sum of stored energy, kinetic energy,
friction and damping. [model.md](model.md) gives the details.

"""
SPEED = """
Errors are relative to the quasi-static maximum. The table gives the error of the maximum and the
largest error at any travel, the largest ratio of kinetic to stored energy after the first tenth of
the travel, and the largest energy error. By the usual rule a test is quasi-static if the kinetic
energy stays below 5 % of the stored energy.

If the test is too fast, the force oscillates about the quasi-static curve with the period of the
whole stalk vibrating between the cylinders. The maximum is then the crest of an oscillation. It is
too large, and its position depends only on the speed. If the test lasts no longer than one or two
periods, the curve consists of a single oscillation: a high maximum followed by a drop, neither of
which is a property of the stalk. Where the kinetic energy is 5 % of the stored energy, the errors
of the force are smaller than 5 %. A test with scaled mass gives the same result as one that is
shorter by the square root of the mass factor, at the same cost. The drag makes the oscillations
decay, so the end of a curve is closer to the quasi-static one than its beginning.

"""
MESHES = """## Other meshes

The second mesh has second-order elements with 20 nodes. Its lumped mass is the scaled diagonal of
the consistent mass matrix.

"""


def case(mesh: str, duration_s: float, mass_factor: float = 1.0) -> BendingTest:
    """Return the calibration stalk's test with a mesh, a duration and scaled mass."""
    return override(
        published_test("table3"),
        [
            f"numerics.mesh={mesh}",
            "numerics.stepping.max_step_mm=0.25",
            "numerics.stepping.first_step_mm=0.25",
            "numerics.acoustic_check=false",
            f"numerics.explicit.duration_s={duration_s}",
            f"numerics.explicit.mass_factor={mass_factor}",
        ],
    )


def run_implicit(test: BendingTest) -> dict[str, Any]:
    """Simulate without inertia, and return the curve and the cost."""
    from mpi4py import MPI

    warnings.simplefilter("ignore", SpecificationWarning)
    start = time.process_time()
    result = simulate(test, MPI.COMM_SELF)
    curve = {name: result.curve[name].round(4).tolist() for name in COLUMNS[:2]}
    return {"curve": curve, "dofs": result.statistics.dofs, "cpu_s": time.process_time() - start}


def run_explicit(test: BendingTest) -> dict[str, Any]:
    """Simulate with inertia, and return the curve and what the tables need."""
    from mpi4py import MPI

    warnings.simplefilter("ignore", SpecificationWarning)
    start = time.process_time()
    result = simulate_explicitly(test, MPI.COMM_SELF)
    statistics = result.statistics
    return {
        "curve": {name: result.curve[name].round(4).tolist() for name in COLUMNS},
        "duration_s": test.numerics.explicit.duration_s,
        "mass_factor": test.numerics.explicit.mass_factor,
        "ending": result.ending.kind,
        "reason": result.ending.reason,
        "max_force_N": result.max_force_N,
        "kinetic_over_stored": result.kinetic_share,
        "energy_error": float(result.curve["energy_error"].abs().max()),
        "steps": statistics.steps,
        "evaluations": statistics.evaluations,
        "least_time_step_s": statistics.least_time_step_s,
        "speed_mm_per_s": statistics.speed_mm_per_s,
        "mass_g": statistics.mass_g,
        "cpu_s": time.process_time() - start,
    }


def label(mesh: str, duration_s: float, mass_factor: float = 1.0) -> str:
    """Return a run's name in the record."""
    scaled = f", mass x {mass_factor:g}" if mass_factor != 1.0 else ""
    return f"{mesh} {1e3 * duration_s:g} ms{scaled}"


def cases() -> dict[str, BendingTest]:
    """Return the tests with inertia by label, the longest ones first."""
    keys: list[tuple[str, float, float]] = [(MESH, t, 1.0) for t in reversed(DURATIONS_S)]
    keys += [(MESH, t, f) for t, f in SCALED]
    keys += [(mesh, t, 1.0) for mesh, t in OTHER_MESHES.items()]
    return {label(*key): case(*key) for key in keys}


def effective_s(row: Mapping[str, Any]) -> float:
    """Return the duration of the equivalent test without mass scaling."""
    return float(row["duration_s"] / math.sqrt(row["mass_factor"]))


def compare(row: Mapping[str, Any], static: Mapping[str, Any]) -> tuple[float, float]:
    """Return the error of the maximum, and the largest error, over the implicit maximum."""
    at, force = static["curve"]["displacement_mm"], static["curve"]["force_N"]
    travel = np.minimum(row["curve"]["displacement_mm"], at[-1])
    exact = PchipInterpolator(at, force)(travel)
    deviation = np.abs(np.array(row["curve"]["force_N"]) - exact).max()
    return row["max_force_N"] / max(force) - 1.0, float(deviation) / max(force)


def ripple_s(row: Mapping[str, Any]) -> float:
    """Return the period, s, of the strongest ripple in the supports' force, from its spectrum."""
    travel = np.array(row["curve"]["displacement_mm"])
    late = travel > 3.0
    travel, force = travel[late], np.array(row["curve"]["support_force_N"])[late]
    ripple = force - np.polynomial.Polynomial.fit(travel, force, 8)(travel)
    spectrum = np.abs(np.fft.rfft(ripple, 4096))
    per_mm = np.fft.rfftfreq(4096, (travel[-1] - travel[0]) / (len(travel) - 1))
    return float(1.0 / per_mm[spectrum.argmax()] / row["speed_mm_per_s"])


def figure(rows: Rows) -> Figure:
    """Draw force against travel at several speeds, and errors against duration."""
    static = rows[f"{MESH} implicit"]
    with mpl.rc_context(STYLE):
        drawing = Figure(figsize=(10.0, 4.2), layout="constrained")
        left, right = drawing.subplots(1, 2)
        shades = mpl.colormaps["viridis"](np.linspace(0.0, 0.9, len(DRAWN_S)))
        for duration, shade in zip(DRAWN_S, shades, strict=True):
            curve = rows[label(MESH, duration)]["curve"]
            name = f"{1e3 * duration:g} ms"
            left.plot(curve["displacement_mm"], curve["force_N"], color=shade, lw=1.3, label=name)
        curve = static["curve"]
        left.plot(curve["displacement_mm"], curve["force_N"], "k--", lw=1.3, label="implicit")
        left.set(xlabel="Indenter displacement (mm)", ylabel="Force (N)", xlim=(0, None))
        left.set_ylim(bottom=0.0)
        left.legend(fontsize=8, title="duration of the test", title_fontsize=8)
        _draw_errors(right, rows, static)
    return drawing


def _draw_errors(axes: Axes, rows: Rows, static: Mapping[str, Any]) -> None:
    plain = [rows[label(MESH, duration)] for duration in DURATIONS_S]
    scaled = [rows[label(MESH, *key)] for key in SCALED]
    measures: tuple[tuple[str, str, str, Callable[[Mapping[str, Any]], float]], ...] = (
        ("largest error of the force", VERMILION, "o-", lambda row: compare(row, static)[1]),
        ("error of the maximum", BLUE, "s--", lambda row: abs(compare(row, static)[0])),
        ("kinetic / stored energy", GREY, "^-", lambda row: row["kinetic_over_stored"]),
    )
    for name, colour, style, measure in measures:
        values = [100.0 * measure(row) for row in plain]
        axes.loglog(
            [1e3 * row["duration_s"] for row in plain], values, style, color=colour, label=name
        )
    for name, _, _, measure in measures:
        at = [1e3 * effective_s(row) for row in scaled]
        text = "with scaled mass" if name == measures[0][0] else None
        axes.loglog(at, [100.0 * measure(row) for row in scaled], "k+", ms=13, label=text)
    axes.axhline(100.0 * QUASI_STATIC, color=GREY, lw=1.0, ls=":", label="limit of kinetic energy")
    ripple = 1e3 * ripple_s(plain[-1])
    axes.axvline(
        ripple, color=GREY, lw=1.0, ls="-.", label=f"period of the ripple, {ripple:.1f} ms"
    )
    axes.set(xlabel="Duration / root of mass factor (ms)", ylabel="Share (%)")
    axes.set_ylim(top=300.0)
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_formatter(StrMethodFormatter("{x:g}"))
    axes.legend(fontsize=8)


def line(row: Mapping[str, Any], static: Mapping[str, Any]) -> list[str]:
    """Return a run as cells of a table."""
    peak, anywhere = compare(row, static)
    return [
        f"{1e3 * row['duration_s']:g}",
        f"{row['mass_factor']:g}",
        f"{row['speed_mm_per_s']:.0f}",
        f"{row['max_force_N']:.2f}",
        f"{100 * peak:+.2f} %",
        f"{100 * anywhere:.2f} %",
        f"{100 * row['kinetic_over_stored']:.3g} %",
        f"{100 * row['energy_error']:.2g} %",
        f"{1e6 * row['least_time_step_s']:.2f}",
        f"{row['steps']:,}",
        f"{row['evaluations'] / row['steps']:.2f}",
        f"{row['cpu_s']:.0f}",
    ]


def tables(rows: Rows) -> str:
    """Return the text and tables of both sections."""
    head = ["duration (ms)", "mass factor", "speed (mm/s)", "max force (N)", "error of the maximum"]
    head += ["largest error", "kinetic / stored", "energy error", "least step (us)", "steps"]
    head += ["residuals per step", "CPU (s)"]
    static = rows[f"{MESH} implicit"]
    keys = [*((MESH, duration, 1.0) for duration in DURATIONS_S), *((MESH, *k) for k in SCALED)]
    text = f"## Speed\n\nOn `{MESH}`, {static['dofs']:,} unknowns; quasi-static maximum "
    text += f"{max(static['curve']['force_N']):.2f} N, {static['cpu_s']:.0f} s of CPU time.\n\n"
    text += table(head, [line(rows[label(*key)], static) for key in keys]) + "\n" + SPEED
    others = []
    for mesh, duration in OTHER_MESHES.items():
        static = rows[f"{mesh} implicit"]
        maximum = f"{max(static['curve']['force_N']):.2f}"
        others.append([mesh, maximum, *line(rows[label(mesh, duration)], static)])
    return text + MESHES + table(["mesh", "implicit maximum (N)", *head], others)


def main() -> None:
    """Run the cases that are not kept yet, then write the page and its figure."""
    warnings.simplefilter("ignore", SpecificationWarning)
    static = {f"{mesh} implicit": case(mesh, 0.1) for mesh in (MESH, *OTHER_MESHES)}
    rows = run_all("explicit", static, run_implicit)
    rows |= run_all("explicit", cases(), run_explicit)
    (DOCS / "explicit.md").write_text(HEAD + tables(rows))
    figure(rows).savefig(DOCS / "explicit.png")


if __name__ == "__main__":
    main()

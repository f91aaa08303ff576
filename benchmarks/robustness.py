"""Sweep over stalks, fixtures and effects: every run completes, or ends for a physical reason.

    ./run python benchmarks/robustness.py

The 264 runs on `ladder_q2_3`, two at a time, take an hour. Keeps every finished run, records them
in `records/robustness.json`, and writes `docs/robustness.md` at the end.
"""

from __future__ import annotations

import warnings
from itertools import product

import numpy as np
import pandas as pd
from record import DOCS, run_all, table

from ramiefenics import BendingTest, SpecificationWarning, override, published_test
from ramiefenics.effects import EFFECTS, Effect
from ramiefenics.effects.combining import with_effects

STALKS = {"table3": "Table 3", "table8-1": "Table 8, first", "table8-2": "second"}
STALKS |= {"table8-3": "third"}
RADII_MM = (2.5, 5.0, 10.0, 15.0)
FRICTION = (0.0, 0.12, 0.59)
NU_XY = (0.2, 0.3, 0.4)

COVARIATES = ["stalk.position_mm=500", "stalk.moisture=0.1"]
"""Covariates of the stalks with effects; effects that distinguish specimens depend on them."""

HEAD = """# Robustness

Written by `./run python benchmarks/robustness.py`, which bends the published stalks to 14 mm on \
the mesh `ladder_q2_3`. All runs are in `benchmarks/records/robustness.json`.

## Stalks, cylinders, friction

Cylinders of four radii, coefficients of friction 0, 0.12 and 0.59 (static and dynamic the same), \
and nu_XY of both layers 0.2, 0.3 and 0.4. Each row summarises nine runs.

"""

EFFECTS_HEAD = """
## Effects

Each [effect](effects.md) is applied at twice its typical size, or at its bound, to the same \
stalks, at a position of 500 mm and with a moisture content higher by 0.1. Each row summarises \
four runs. The forces are those at the indenter, which errors of the machine do not change. If \
damage removes half of the fibres' stiffness, the law loses strong ellipticity; the rest of such \
a run depends on the mesh, and its summary says so.

"""


def case(stalk: str, radius: float, friction: float, nu: float) -> BendingTest:
    """Return one of the sweep's tests."""
    return override(
        published_test(stalk),
        [
            "numerics.mesh=ladder_q2_3",
            f"fixture.indenter_radius_mm={radius}",
            f"fixture.support_radius_mm={radius}",
            f"fixture.friction.static={friction}",
            f"fixture.friction.dynamic={friction}",
            f"stalk.layers.xylem.material.elastic.nu_XY={nu}",
            f"stalk.layers.phloem.material.elastic.nu_XY={nu}",
        ],
    )


def with_effect(stalk: str, name: str) -> BendingTest:
    """Return a published stalk with an effect at twice its typical size."""
    test = override(published_test(stalk), ["numerics.mesh=ladder_q2_3", *COVARIATES])
    return with_effects(test, [(EFFECTS[name], amplitude(EFFECTS[name]))])


def amplitude(effect: Effect) -> float:
    """Return twice the typical size, or the bound that is nearer."""
    return min(2.0 * effect.typical, effect.bounds[1])


def summary(runs: pd.DataFrame) -> list[str]:
    """Return a summary of some runs as cells of a table."""
    ends = ", ".join(f"{n} {kind}" for kind, n in runs["ending"].value_counts().items())
    void = runs["min_void_height_mm"].min()
    lost = runs["ellipticity_lost_at_mm"].dropna()
    return [
        ends,
        f"{runs['max_force_N'].min():.1f} to {runs['max_force_N'].max():.1f}",
        f"{runs['newton_iterations'].min()} to {runs['newton_iterations'].max()}",
        f"{runs['cut_backs'].sum()}",
        f"{runs['jumps'].sum()}",
        f"{void:.2f}" if np.isfinite(void) else "no void",
        f"{runs['min_acoustic_MPa'].min():.2f}",
        f"{len(lost)}, from {lost.min():.0f} mm on" if len(lost) else "none",
    ]


def main() -> None:
    """Run the cases that are not kept yet; write the page after each of its two parts."""
    warnings.simplefilter("ignore", SpecificationWarning)
    head = ["endings", "max force (N)", "Newton iterations", "cut-backs"]
    head += ["jumps", "least void (mm)", "least acoustic eigenvalue (MPa)", "ellipticity lost"]
    keys = list(product(STALKS, RADII_MM, FRICTION, NU_XY))
    rows = run_all("robustness", {" ".join(map(str, key)): case(*key) for key in keys})
    index = pd.MultiIndex.from_tuples(keys, names=["stalk", "radius", "friction", "nu_XY"])
    runs = pd.DataFrame(list(rows.values()), index=index)
    lines = [
        [STALKS[str(stalk)], f"{radius:g}", *summary(group)]
        for (stalk, radius), group in runs.groupby(level=["stalk", "radius"])
    ]
    text = HEAD + table(["stalk", "radius (mm)", *head], lines)
    (DOCS / "robustness.md").write_text(text)

    pairs = list(product(STALKS, EFFECTS))
    rows = run_all("robustness", {" ".join(pair): with_effect(*pair) for pair in pairs})
    effects = pd.DataFrame(list(rows.values()), index=[name for _, name in pairs])
    lines = [
        [f"`{name}`", f"{amplitude(effect):g}", effect.unit, *summary(effects.loc[[name]])]
        for name, effect in EFFECTS.items()
    ]
    text += EFFECTS_HEAD + table(["effect", "amplitude", "unit", *head], lines)
    (DOCS / "robustness.md").write_text(text)


if __name__ == "__main__":
    main()

"""Sweep over stalks and fixtures: every run reaches its end, or a physical one.

    ./run python benchmarks/robustness.py

144 runs on `ladder_q2_3`, two at a time, half an hour. Keeps every finished run
in `records/robustness.json`, and writes `docs/robustness.md` at the end.
"""

from __future__ import annotations

import warnings
from itertools import product
from typing import Any

import pandas as pd
from record import DOCS, run_all, table

from ramiefenics import BendingTest, SpecificationWarning, override, published_test

STALKS = {"table3": "Table 3", "table8-1": "Table 8, first", "table8-2": "second"}
STALKS |= {"table8-3": "third"}
RADII_MM = (2.5, 5.0, 10.0, 15.0)
FRICTION = (0.0, 0.12, 0.59)
NU_XY = (0.2, 0.3, 0.4)

HEAD = """# Robustness

Made by `./run python benchmarks/robustness.py`: the published stalks on cylinders of four radii,
friction 0, 0.12 and 0.59 (static and dynamic alike), nu_XY of both layers 0.2, 0.3 and 0.4, to 14
mm on the mesh `ladder_q2_3`. Each line sums up nine runs; all of them are in `robustness.json`.

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


def summary(runs: pd.DataFrame) -> list[str]:
    """Sum up the runs of one stalk and radius."""
    ends = ", ".join(f"{n} {kind}" for kind, n in runs["ending"].value_counts().items())
    lost = runs["ellipticity_lost_at_mm"].dropna()
    return [
        ends,
        f"{runs['max_force_N'].min():.1f} to {runs['max_force_N'].max():.1f}",
        f"{runs['newton_iterations'].min()} to {runs['newton_iterations'].max()}",
        f"{runs['cut_backs'].sum()}",
        f"{runs['jumps'].sum()}",
        f"{runs['min_void_height_mm'].min():.2f}",
        f"{runs['min_acoustic_MPa'].min():.2f}",
        f"{len(lost)}, from {lost.min():.0f} mm on" if len(lost) else "none",
    ]


def main() -> None:
    """Run what is not recorded yet, then write the table."""
    warnings.simplefilter("ignore", SpecificationWarning)
    keys = list(product(STALKS, RADII_MM, FRICTION, NU_XY))
    cases = {" ".join(str(part) for part in key): case(*key) for key in keys}
    rows: list[dict[str, Any]] = list(run_all("robustness", cases).values())
    index = pd.MultiIndex.from_tuples(keys, names=["stalk", "radius", "friction", "nu_XY"])
    runs = pd.DataFrame(rows, index=index)
    head = ["stalk", "radius (mm)", "endings", "max force (N)", "Newton iterations", "cut-backs"]
    head += ["jumps", "least void (mm)", "least acoustic eigenvalue (MPa)", "ellipticity lost"]
    lines = [
        [STALKS[stalk], f"{radius:g}", *summary(group)]
        for (stalk, radius), group in runs.groupby(level=["stalk", "radius"])
    ]
    (DOCS / "robustness.md").write_text(HEAD + table(head, lines))


if __name__ == "__main__":
    main()

"""Dependence of the answer on mesh, step and the parameters of Nitsche's method.

    ./run python benchmarks/convergence.py

Half an hour on two cores. Keeps every finished run in `docs/convergence.json`, and writes
`docs/convergence.md` at the end.
"""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from typing import Any

from record import DOCS, run_all, table

from ramiefenics import BendingTest, SpecificationWarning, override, published_test

FORCES = {f"force_{at}mm_N": f"F({at} mm)" for at in (4, 8, 12, 14)} | {"max_force_N": "maximum"}

MESHES = {
    "First order": [f"ladder_q1_{step}" for step in (1, 2, 3, 4, 5)],
    "Second order": [f"ladder_q2_{step}" for step in (1, 2, 3, 4, 5)],
    "Recipes for use": ["screening", "standard", "fine"],
}
MAX_STEPS_MM = (1.0, 0.5, 0.25)
DOMAINS = ("quarter", "half", "full")
NITSCHE = ((0, 5), (0, 20), (0, 100), (0, 500), (-1, 5), (-1, 20), (-1, 500), (1, 60), (1, 500))

HEAD = """# Convergence

Made by `./run python benchmarks/convergence.py`: the calibration stalk (`table3`), quarter model,
all cylinders of 5 mm radius, default law. Forces in N. "The finest" is the last mesh of second
order. CPU times are those of one of two runs at a time on a shared two-core virtual machine.

The second-order meshes have 20 nodes per cell and are graded towards the bore and the sides. All
runs are elliptic to the end. What converges last is the hinge at the bore's sides, where the
flattened void bends: there cells are crushed to half their volume, the strain is the larger the
finer the mesh, and beyond 12 mm the force goes on falling by some tenths of a per cent from mesh to
mesh. First-order meshes lock in the bending of the crushed wall.

"""


MESH = "numerics.mesh=ladder_q2_3"
"""On which steps and contact are compared; of `standard`'s cross-section, finer in between."""


def base(*assignments: str) -> BendingTest:
    """Return the calibration stalk's test with some values changed."""
    return override(published_test("table3"), list(assignments))


def mesh_cases() -> dict[str, BendingTest]:
    """Return one test per mesh recipe."""
    return {name: base(f"numerics.mesh={name}") for names in MESHES.values() for name in names}


def step_cases() -> dict[str, BendingTest]:
    """Return one test per largest step."""
    return {
        f"{step:g} mm": base(
            MESH,
            f"numerics.stepping.max_step_mm={step}",
            f"numerics.stepping.first_step_mm={min(step, 0.5)}",
        )
        for step in MAX_STEPS_MM
    }


def domain_cases() -> dict[str, BendingTest]:
    """Return one test per modelled part of the stalk."""
    return {
        domain: base("numerics.mesh=screening", f"numerics.domain={domain}") for domain in DOMAINS
    }


def nitsche_cases() -> dict[str, BendingTest]:
    """Return one test per variant and parameter of Nitsche's method."""
    return {
        f"theta {theta}, {gamma}": base(
            MESH, f"numerics.contact.theta={theta}", f"numerics.contact.stabilisation={gamma}.0"
        )
        for theta, gamma in NITSCHE
    }


def line(label: str, row: Mapping[str, Any]) -> list[str]:
    """Return a run's forces and cost as cells of a table."""
    return [
        label,
        f"{row['dofs']:,}",
        *(f"{row[key]:.2f}" for key in FORCES),
        f"{row['newton_iterations']}",
        f"{row['cut_backs']}",
        f"{row['min_acoustic_MPa']:.2f}",
        f"{row['cpu_s']:.0f}",
    ]


def largest(row: Mapping[str, Any], finest: Mapping[str, Any]) -> float:
    """Return the largest relative difference of the forces between two runs."""
    return max(abs(row[f"force_{at}mm_N"] / finest[f"force_{at}mm_N"] - 1) for at in (4, 8, 12, 14))


def spread(rows: list[Mapping[str, Any]]) -> str:
    """Return the largest differences of the forces among some runs, in per cent."""
    parts = []
    for key, name in FORCES.items():
        values = [row[key] for row in rows]
        parts.append(f"{name} {100 * (max(values) / min(values) - 1):.2f} %")
    return ", ".join(parts)


def main() -> None:
    """Run what is not recorded yet, then write the tables."""
    warnings.simplefilter("ignore", SpecificationWarning)
    meshes, steps, nitsche = mesh_cases(), step_cases(), nitsche_cases()
    domains = domain_cases()
    # the longest first, so that two workers end together
    record = run_all("convergence", dict(reversed((meshes | steps | nitsche | domains).items())))
    head = ["", "unknowns", *FORCES.values(), "iterations", "cut-backs"]
    head += ["least acoustic eigenvalue (MPa)", "CPU (s)"]
    finest = record[MESHES["Second order"][-1]]
    text = HEAD
    for title, names in MESHES.items():
        lines = [
            [*line(name, record[name]), f"{100 * largest(record[name], finest):.1f} %"]
            for name in names
        ]
        text += f"## {title}\n\n" + table([*head, "largest difference to the finest"], lines)
        if title != "Recipes for use":
            last = spread([record[name] for name in names[-2:]])
            text += f"\nDifferences between the two finest: {last}.\n"
        text += "\n"
    text += "## Largest step\n\nOn `ladder_q2_3`.\n\n"
    text += table(head, [line(label, record[label]) for label in steps])
    text += f"\nDifferences: {spread([record[label] for label in steps])}.\n\n"
    text += "## Nitsche's method\n\nVariant and stabilisation, on `ladder_q2_3`.\n\n"
    text += table(head, [line(label, record[label]) for label in nitsche])
    text += f"\nDifferences: {spread([record[label] for label in nitsche])}.\n"
    text += "\n## Modelled part\n\nOn the screening recipe.\n\n"
    text += table(head, [line(label, record[label]) for label in domains])
    (DOCS / "convergence.md").write_text(text)


if __name__ == "__main__":
    main()

"""Dependence of the result on mesh, step and the parameters of Nitsche's method.

    ./run python benchmarks/convergence.py

Takes half an hour on two cores. Keeps every finished run in `records/convergence.json`, and writes
`docs/convergence.md` and the table of errors in `meshes/README.md` at the end.
"""

from __future__ import annotations

import re
import warnings
from collections.abc import Mapping
from typing import Any

from record import DOCS, read_record, row, run_all, table, write_record

from ramiefenics import (
    BendingTest,
    SpecificationWarning,
    converge,
    order_and_limit,
    override,
    published_test,
)
from ramiefenics.convergence import Extrapolation
from ramiefenics.runs import SharedRuns

FORCES = {f"force_{at}mm_N": f"F({at} mm)" for at in (4, 8, 12, 14)} | {"max_force_N": "maximum"}

MESHES = {
    "First order": [f"ladder_q1_{step}" for step in (1, 2, 3, 4, 5)],
    "Second order": [f"ladder_q2_{step}" for step in (1, 2, 3, 4, 5)],
    "Recipes for use": ["screening", "standard", "fine"],
}
COMPARED = {"max_force_N": "maximum", "slope_N_per_mm": "slope"} | {
    key: FORCES[key] for key in ("force_4mm_N", "force_8mm_N", "force_14mm_N")
}
MAX_STEPS_MM = (1.0, 0.5, 0.25)
DOMAINS = ("quarter", "half", "full")
NITSCHE = ((0, 5), (0, 20), (0, 100), (0, 500), (-1, 5), (-1, 20), (-1, 500), (1, 60), (1, 500))

HEAD = """# Convergence

Written by `./run python benchmarks/convergence.py` for the stalk of the calibration (`table3`):
quarter model, default law, all cylinders of 5 mm radius. Forces are in N, the slope is in N/mm.
"The finest" is the last second-order mesh. CPU times were measured with two runs at a time on a
shared virtual machine with two cores.

`ramiefenics converge` (in Python `converge`) makes the mesh study for any specification and either
element order. It compares the maximum force, the slope (the secant between 10 and 40 % of the
maximum), and the forces at 2/7, 4/7 and all of the travel, interpolated linearly between steps.
The representative cell size of a mesh is the cube root of its volume divided by its number of
cells. The observed order, the Richardson limit and the grid-convergence index (GCI, an error of
the finest mesh that should hold in 95 % of cases; Roache 1994) are computed from the three finest
meshes by the procedure of Celik et al. (2008) for unequal refinement ratios. There are three
exceptions. If the differences alternate in sign, the sequence oscillates, and only the index is
given. If they do not decrease, or by less than an order of 0.5 would imply, half the range of the
three meshes is given instead, which is not a bound. The same is done if the observed order exceeds
4, which can only be accidental. "The meshes before" are the three meshes before the finest. If
they do not confirm the observed order, the sequence has not yet reached the range in which the
error decreases at a constant order.

The second-order meshes have 20 nodes per cell and are graded towards the bore and the sides. In
all runs strong ellipticity holds to the end. The region that converges last is the hinge at the
sides of the bore, where the wall of the flattened void bends. Its cells are crushed to half their
volume, the strain increases as the mesh is refined, and beyond 12 mm the force decreases by some
tenths of a per cent from each mesh to the next. First-order meshes lock in the bending of the
crushed wall.

Up to 4 mm of travel the second-order meshes are too coarse under the cylinders to show an order.
Their cells there are 8 to 2.4 mm long, those of the first-order meshes 2 to 0.56 mm, and the
contact is 2 to 4 mm long. On `ladder_q2_3` with cells of 2 and of 1 mm there
(`numerics.mesh.contact_size`) the force at 4 mm is 55.9 and 56.0 N.

"""

MESH = "numerics.mesh=ladder_q2_3"
"""Mesh on which steps and contact are compared.

It has the cross-section of `standard`, and shorter cells between the cylinders."""


def base(*assignments: str) -> BendingTest:
    """Return the calibration stalk's test with some values changed."""
    return override(published_test("table3"), list(assignments))


def record_meshes() -> None:
    """Simulate the ladders and the recipes for use."""
    runs = SharedRuns()
    done: dict[str, Any] = {}
    for order in (1, 2):
        study = converge(base(), order, runs=runs)
        done |= dict(zip(study.meshes["mesh"], study.runs, strict=True))
    for name in MESHES["Recipes for use"]:
        done[name] = runs.run(base(f"numerics.mesh={name}"))
    rows = {name: row(run.result, run.cpu_s) for name, run in done.items()}
    write_record("convergence", read_record("convergence") | rows)


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


def extrapolate(rows: list[Mapping[str, Any]]) -> dict[str, Extrapolation]:
    """Return the extrapolation of every quantity from a ladder of meshes."""
    sizes = [row["cells"] ** (-1.0 / 3.0) for row in rows]
    return {key: order_and_limit(sizes, [row[key] for row in rows]) for key in COMPARED}


def number(value: float | None, how: str = ".2f", unit: str = "") -> str:
    """Return a number as a cell of a table."""
    return "-" if value is None else format(value, how) + unit


def percent(share: float | None) -> str:
    """Return a share, in per cent, as a cell of a table."""
    return number(share if share is None else 100.0 * share, unit=" %")


def richardson(rows: list[Mapping[str, Any]]) -> str:
    """Return the table of orders and limits of a ladder of meshes."""
    found, before = extrapolate(rows), extrapolate(rows[:-1])
    lines = [
        ["the three finest meshes", *(f.behaviour for f in found.values())],
        ["observed order", *(number(f.order) for f in found.values())],
        ["Richardson limit", *(number(f.limit) for f in found.values())],
        ["GCI", *(percent(f.gci) for f in found.values())],
        ["half range", *(percent(f.spread) for f in found.values())],
        ["the meshes before", *(f.behaviour for f in before.values())],
        ["their order", *(number(f.order) for f in before.values())],
        ["their limit", *(number(f.limit) for f in before.values())],
        ["their GCI", *(percent(f.gci) for f in before.values())],
    ]
    return table(["", *COMPARED.values()], lines)


def errors(record: Mapping[str, Mapping[str, Any]]) -> str:
    """Return the table of errors of the recipes for use, against the second-order ladder."""
    found = extrapolate([record[name] for name in MESHES["Second order"]])
    finest = record[MESHES["Second order"][-1]]
    best = {key: f.limit or finest[key] for key, f in found.items()}
    kinds = ["limit" if f.limit else "finest mesh" for f in found.values()]
    lines = [
        ["compared with", *kinds, ""],
        ["which is", *(f"{value:.2f}" for value in best.values()), ""],
        ["uncertain by", *(percent(f.uncertainty) for f in found.values()), ""],
    ]
    for name in MESHES["Recipes for use"]:
        shares = [round(100.0 * (record[name][key] / best[key] - 1.0), 1) for key in COMPARED]
        lines.append(
            [f"`{name}`", *(f"{s + 0.0:+.1f} %" for s in shares), f"{record[name]['cpu_s']:.0f}"]
        )
    return table(["", *COMPARED.values(), "CPU (s)"], lines)


def write_readme(text: str) -> None:
    """Replace the table of errors between its marks in `meshes/README.md`."""
    path = DOCS.parent / "meshes" / "README.md"
    marks = r"(<!-- made by benchmarks/convergence.py -->\n).*?(<!-- end -->)"
    changed, found = re.subn(marks, rf"\g<1>{text}\g<2>", path.read_text(), flags=re.DOTALL)
    assert found == 1
    path.write_text(changed)


def main() -> None:
    """Run the cases that are not kept yet, then write the tables."""
    warnings.simplefilter("ignore", SpecificationWarning)
    steps, nitsche, domains = step_cases(), nitsche_cases(), domain_cases()
    record_meshes()
    # longest runs first, so that both workers finish at about the same time
    run_all("convergence", dict(reversed((steps | nitsche | domains).items())))
    record = read_record("convergence")
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
            text += "\n" + richardson([record[name] for name in names])
        else:
            text += f"\nErrors against the second-order ladder:\n\n{errors(record)}"
        text += "\n"
    text += "## Largest step\n\nOn `ladder_q2_3`.\n\n"
    text += table(head, [line(label, record[label]) for label in steps])
    text += f"\nDifferences: {spread([record[label] for label in steps])}.\n\n"
    text += "## Nitsche's method\n\n"
    text += "The variant (theta) and the stabilisation parameter, on `ladder_q2_3`.\n\n"
    text += table(head, [line(label, record[label]) for label in nitsche])
    text += f"\nDifferences: {spread([record[label] for label in nitsche])}.\n"
    text += "\n## Modelled part\n\nOn the screening recipe.\n\n"
    text += table(head, [line(label, record[label]) for label in domains])
    (DOCS / "convergence.md").write_text(text)
    write_readme(errors(record))


if __name__ == "__main__":
    main()

"""Peak force that the published constants predict, and what they leave open; published is 84.5 N.

    ./run python benchmarks/published_peak.py

Takes a quarter of an hour on two cores. Keeps every finished run in `records/published_peak.json`,
and writes `docs/published_peak_tables.md` and the figure `docs/published_peak.png` at the end.
"""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure
from record import DOCS, run_all, table

from ramiefenics import BendingTest, SpecificationWarning, override, published_test
from ramiefenics.results.style import BLUE, GREY, STYLE, VERMILION

PUBLISHED_N = {"table3": 84.5, "table8-1": 96.2, "table8-2": 78.65, "table8-3": 87.4}
"""Published simulated peak forces of Table 3's stalk (Eq. 5 at its centre) and of Table 8's."""

VALIDATION = tuple(name for name in PUBLISHED_N if name != "table3")

RADII_MM = (2.5, 5.0, 10.0, 15.0)
STRENGTHS, TANGENTS = (0.05, 0.1, 0.2), (0.5, 1.0, 2.0)
COMPARED = (
    "s_c 0.1 h 1.0",
    "s_c 0.05 h 0.5",
    "s_c 0.2 h 1.0",
    "svk ladder_q1_1",
    "svk shorter",
)
"""Labels of the runs made for all stalks.

They have the default large-strain parameters, the weakest and the strongest that stay elliptic, and
the published law on two meshes as coarse as such studies use."""

OTHERS = {
    "shear_yield_strain": (0.03, 0.1),
    "shear_residual_tangent": (0.1, 0.4),
    "densification": (3.0, 24.0),
}
THICKER = "phloem 0.695 mm"
"""Phloem thickness that follows from Table 3's diameters; the table prints 0.67 mm."""

OLD_LAWS = ("svk", "neo_hookean")
OLD_MESHES = {
    "ladder_q1_1": ["numerics.mesh=ladder_q1_1"],
    "shorter": [
        "numerics.mesh=ladder_q1_1",
        "numerics.mesh.contact_size=0.015",
        "numerics.mesh.coarse_size=0.045",
    ],
    "ladder_q1_2": ["numerics.mesh=ladder_q1_2"],
}
"""Meshes for the old laws; "shorter" is the first of the ladder with shorter elements."""
HEAD = """# Peak force of the published stalks: all runs

Made by `./run python benchmarks/published_peak.py`, on the mesh `ladder_q2_3` where no other is
named, cylinders of 5 mm where no other radius is. Read [published_peak.md](published_peak.md)
first.

"""

LAYERS = ("xylem", "phloem")
MESH = "numerics.mesh=ladder_q2_3"
Rows = Mapping[str, Mapping[str, Any]]


def everywhere(key: str, value: float) -> list[str]:
    """Return assignments of a large-strain parameter of both layers."""
    return [f"stalk.layers.{layer}.material.large_strain.{key}={value}" for layer in LAYERS]


def parameters(strength: float, tangent: float) -> list[str]:
    """Return assignments of compressive strength and residual tangent of both layers."""
    return everywhere("fibre_strength", strength) + everywhere("fibre_residual_tangent", tangent)


def as_zx(name: str = "table3") -> list[str]:
    """Return assignments that read the printed nu_XZ as nu_ZX: nu_XZ = nu_ZX E_X / E_Z."""
    assignments = []
    for layer in published_test(name).stalk.layers:
        e = layer.material.elastic
        value = e.nu_XZ * e.E_X_MPa / e.E_Z_MPa
        assignments.append(f"stalk.layers.{layer.name}.material.elastic.nu_XZ={value}")
    return assignments


def radius(value: float) -> list[str]:
    """Return assignments of the radius of all three cylinders."""
    return [f"fixture.indenter_radius_mm={value}", f"fixture.support_radius_mm={value}"]


def cases() -> dict[str, BendingTest]:
    """Return all tests by label."""
    table3 = {f"XZ {r:g}": radius(r) for r in RADII_MM}
    table3 |= {f"ZX {r:g}": [*radius(r), *as_zx()] for r in RADII_MM}
    table3 |= {f"s_c {s} h {h}": parameters(s, h) for s in STRENGTHS for h in TANGENTS}
    table3 |= {f"{k} {v}": everywhere(k, v) for k, values in OTHERS.items() for v in values}
    table3[THICKER] = ["stalk.layers.xylem.outer_diameter_mm=12.84"]
    table3 |= {
        f"{law} {mesh}": [f"law={law}", *settings]
        for law in OLD_LAWS
        for mesh, settings in OLD_MESHES.items()
    }
    runs = {
        label: override(published_test("table3"), [MESH, *change])
        for label, change in table3.items()
    }
    for name in VALIDATION:
        runs |= {
            f"{name} {label}": override(published_test(name), [MESH, *table3[label]])
            for label in COMPARED
        }
    return runs


def figure(rows: Rows) -> Figure:
    """Draw peak force against radius and against the large-strain parameters."""
    with mpl.rc_context(STYLE):
        drawing = Figure(figsize=(8.0, 3.6), layout="constrained")
        left, right = drawing.subplots(1, 2, sharey=True)
        for reading, colour, marker in (("XZ", BLUE, "o"), ("ZX", VERMILION, "s")):
            forces = [rows[f"{reading} {r:g}"]["max_force_N"] for r in RADII_MM]
            label = f"printed Poisson's ratio is nu_{reading}"
            left.plot(RADII_MM, forces, marker=marker, color=colour, label=label)
        old = [rows[f"svk {mesh}"]["max_force_N"] for mesh in OLD_MESHES]
        left.plot([5.0] * len(old), old, "x", color="k", label="published law, three meshes")
        for tangent, line in zip(TANGENTS, (":", "-", "--"), strict=True):
            forces = [rows[f"s_c {s} h {tangent}"]["max_force_N"] for s in STRENGTHS]
            label = f"h = {tangent:g} G_XZ"
            right.plot(STRENGTHS, forces, marker="o", ls=line, color=BLUE, label=label)
        lost = [
            (s, rows[f"s_c {s} h {h}"]["max_force_N"])
            for s in STRENGTHS
            for h in TANGENTS
            if rows[f"s_c {s} h {h}"]["ellipticity_lost_at_mm"] is not None
        ]
        right.plot(
            *np.reshape(lost, (-1, 2)).T, "o", ms=9, mfc="none", mec=VERMILION, label="not elliptic"
        )
        for axes in (left, right):
            axes.axhline(PUBLISHED_N["table3"], color=GREY, lw=1.2)
            axes.annotate(
                "published 84.5 N",
                (1.0, PUBLISHED_N["table3"]),
                xycoords=("axes fraction", "data"),
                xytext=(0, -11),
                textcoords="offset points",
                ha="right",
                color=GREY,
            )
            axes.legend(frameon=False, fontsize=8)
        left.set_xlabel("Radius of indenter and supports (mm)")
        left.set_ylabel("Maximum force (N)")
        right.set_xlabel("Compressive fibre strength s_c / G_XZ")
        right.set_xticks(STRENGTHS)
        left.set_ylim(0.0, 130.0)
    return drawing


def peak(row: Mapping[str, Any]) -> list[str]:
    """Return a run's peak as cells of a table."""
    lost = row["ellipticity_lost_at_mm"]
    rising = "" if row["has_force_maximum"] else ", rising"
    return [
        f"{row['max_force_N']:.1f}{rising}",
        f"{row['displacement_at_max_mm']:.1f}",
        f"{row['max_force_N'] / PUBLISHED_N['table3']:.2f}",
        "elliptic" if lost is None else f"lost at {lost:.1f} mm",
    ]


def section(title: str, first: str, rows: Sequence[tuple[str, Mapping[str, Any]]]) -> str:
    """Return a titled table of peaks."""
    head = [first, "max force (N)", "at (mm)", "over 84.5 N", "ellipticity"]
    return f"## {title}\n\n" + table(head, [[label, *peak(row)] for label, row in rows]) + "\n"


def stalks(rows: Rows) -> str:
    """Return tables of the forces of all stalks, and of their ratios to that of Table 3's stalk."""
    forces = {"published": list(PUBLISHED_N.values())}
    for label in COMPARED:
        names = [label, *(f"{name} {label}" for name in VALIDATION)]
        forces[label.replace(" h", ", h")] = [rows[name]["max_force_N"] for name in names]
    absolute = [[model, *(f"{force:.1f}" for force in row)] for model, row in forces.items()]
    ratios = [
        [model, *(f"{force / row[0]:.3f}" for force in row[1:])] for model, row in forces.items()
    ]
    head = ["", "Table 3", "Table 8, first", "second", "third"]
    text = "## The published stalks\n\nMaximum force, N:\n\n" + table(head, absolute)
    return text + "\nOver that of Table 3:\n\n" + table(["", *head[2:]], ratios) + "\n"


def main() -> None:
    """Run the cases that are not kept yet, then write the tables and the figure."""
    warnings.simplefilter("ignore", SpecificationWarning)
    rows = run_all("published_peak", cases())
    text = HEAD + stalks(rows)
    text += section(
        "Radius and reading of the Poisson's ratios",
        "radius, reading",
        [(f"{r:g} mm, nu_{x}", rows[f"{x} {r:g}"]) for r in RADII_MM for x in ("XZ", "ZX")],
    )
    text += section(
        "Strength and residual tangent of the fibres",
        "s_c / G_XZ, h / G_XZ",
        [(f"{s:g}, {h:g}", rows[f"s_c {s} h {h}"]) for s in STRENGTHS for h in TANGENTS],
    )
    text += section(
        "Other large-strain parameters",
        "constant",
        [(f"{k} = {v:g}", rows[f"{k} {v}"]) for k, values in OTHERS.items() for v in values],
    )
    text += section(
        "Phloem thickness",
        "thickness",
        [("0.67 mm, printed", rows["XZ 5"]), ("0.695 mm, by the diameters", rows[THICKER])],
    )
    text += section(
        "The published law, and the plain neo-Hookean one",
        "law, mesh",
        [(f"{law}, {mesh}", rows[f"{law} {mesh}"]) for law in OLD_LAWS for mesh in OLD_MESHES],
    )
    (DOCS / "published_peak_tables.md").write_text(text)
    figure(rows).savefig(DOCS / "published_peak.png")


if __name__ == "__main__":
    main()

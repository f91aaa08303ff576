"""Six tests of a material point that must recover the nine engineering constants."""

from __future__ import annotations

import pandas as pd

from ramiefenics.model.laws import LAWS
from ramiefenics.published.stalks import PHLOEM, XYLEM
from ramiefenics.specification import Elastic, Material
from ramiefenics.verification.point import Point
from ramiefenics.verification.study import Study, at_most

STRAIN = 1e-5

WITHOUT_FIBRES = Material(
    Elastic.isotropic(PHLOEM.elastic.E_X_MPa, PHLOEM.elastic.nu_XY),
    density_g_per_cm3=PHLOEM.density_g_per_cm3,
)
"""Isotropic material as soft as the phloem is across its fibres, for the isotropic law."""

ELASTIC = sorted(name for name, law in LAWS.items() if law.memory is None)
"""Laws without internal variables.

Laws with internal variables equal elastic ones at rest, but have an update whose tangent takes
minutes to compile.
"""

MATERIALS = {
    name: {"matrix": WITHOUT_FIBRES} if name == "isotropic" else {"xylem": XYLEM, "phloem": PHLOEM}
    for name in ELASTIC
}
"""Materials with which every law is tested, by layer."""

AXES = "XYZ"


def measured(point: Point) -> dict[str, float]:
    """Return the constants, moduli in MPa, from tension along each axis and shear in each plane.

    All other components are free of stress.
    """
    constants = {}
    for i, axis in enumerate(AXES):
        pulled, pushed = (point.free_sides({(i, i): 1 + sign * STRAIN}) for sign in (1, -1))
        change = (pulled - pushed) / (2 * STRAIN)
        stress = point.stress(pulled)[i, i] - point.stress(pushed)[i, i]
        constants[f"E_{axis}"] = stress / (2 * STRAIN)
        for j in range(i + 1, 3):
            constants[f"nu_{axis}{AXES[j]}"] = -change[j, j]
    for i, j in ((0, 1), (0, 2), (1, 2)):
        sheared = point.free_sides({(i, j): STRAIN / 2})
        constants[f"G_{AXES[i]}{AXES[j]}"] = point.stress(sheared)[i, j] / STRAIN
    return constants


def given(elastic: Elastic) -> dict[str, float]:
    """Return the nine constants as specified, moduli in MPa."""
    across = dict.fromkeys(("E_X", "E_Y"), elastic.E_X_MPa)
    along = dict.fromkeys(("nu_XZ", "nu_YZ"), elastic.nu_XZ)
    shear = dict.fromkeys(("G_XZ", "G_YZ"), elastic.G_XZ_MPa)
    rest = {"E_Z": elastic.E_Z_MPa, "nu_XY": elastic.nu_XY, "G_XY": elastic.G_XY}
    return across | along | shear | rest


def constants() -> Study:
    """Recover the engineering constants of both layers with every law."""
    rows = []
    for law, materials in MATERIALS.items():
        for name, material in materials.items():
            found, wanted = measured(Point(law, material)), given(material.elastic)
            worst = max(abs(found[key] / wanted[key] - 1) for key in wanted)
            rows.append({"law": law, "layer": name, **found, "largest relative error": worst})
    table = pd.DataFrame(rows)
    return Study(
        "Engineering constants",
        "A material point is pulled along X, Y and Z and sheared in XY, XZ and YZ by a strain of "
        f"{STRAIN:g}, free in all other components. Moduli in MPa; nu_ij / E_i = nu_ji / E_j.",
        (
            at_most(
                "largest relative error of the nine constants",
                float(table["largest relative error"].max()),
                1e-4,
                "the laws are not linear: the error falls with the strain",
            ),
        ),
        table,
    )

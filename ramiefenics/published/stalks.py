"""The stalks of the published study, from the values that it prints.

Source: Tables 1, 3, 7 and 8 of the study cited in `ramiefenics.published.citation`.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable

from ramiefenics.published.citation import STUDY
from ramiefenics.specification import (
    BendingTest,
    Elastic,
    Fixture,
    Friction,
    Layer,
    Material,
    Protocol,
    SpecificationError,
    Stalk,
)
from ramiefenics.specification.errors import warn

PHLOEM_G_XY_PRINTED_MPA = 3.09
"""G_XY of the phloem as printed in Table 3; Eq. 4 gives 0.88 MPa with the table's other values."""

SPECIMEN_LENGTH_MM = 180.0

XYLEM = Material(
    Elastic(E_X_MPa=7.67, E_Z_MPa=320.0, nu_XY=0.32, nu_XZ=0.04, G_XZ_MPa=69.0),
    density_g_per_cm3=0.95,
)
PHLOEM = Material(
    Elastic(E_X_MPa=2.27, E_Z_MPa=1919.08, nu_XY=0.29, nu_XZ=0.004, G_XZ_MPa=33.8),
    density_g_per_cm3=0.97,
)

FIXTURE = Fixture(span_mm=100.0, friction=Friction(static=0.59, dynamic=0.12))
"""Fixture of the study. The radii of the cylinders are the defaults, as none are printed."""

TABLE_8_MM = ((15.1, 7.5, 0.72), (14.3, 7.45, 0.64), (14.7, 7.5, 0.65))
"""Outer diameter, inner diameter and phloem thickness of the three validation stalks."""


def ramie(outer_mm: float, inner_mm: float, phloem_mm: float) -> BendingTest:
    """Return the study's test of a stalk of given dimensions, with the constants of Table 7.

    Parameters
    ----------
    outer_mm, inner_mm
        Diameters of the stalk and of its void.
    phloem_mm
        Thickness of the phloem.
    """
    xylem = Layer("xylem", outer_mm - 2.0 * phloem_mm, XYLEM)
    stalk = Stalk(SPECIMEN_LENGTH_MM, inner_mm, (xylem, Layer("phloem", outer_mm, PHLOEM)))
    return BendingTest(stalk, FIXTURE, protocol=Protocol(travel_mm=14.0))


def ramie_at_height(height_cm: float) -> BendingTest:
    """Return the study's test of the stalk at a height above ground, by Table 1.

    Diameters are interpolated linearly between the root and 150 cm. Table 1 gives no thickness of
    the phloem. It follows from Eq. 3 with the table's ratio of fresh cortex to stalk, 21.42 %.

    Parameters
    ----------
    height_cm
        Height above ground, between 0 and 150.

    Raises
    ------
    SpecificationError
        If the height is outside Table 1.
    """
    if not 0.0 <= height_cm <= 150.0:
        raise SpecificationError(
            "height_cm", height_cm, f"must be between 0 and 150, the range of Table 1 of {STUDY}"
        )
    share = height_cm / 150.0
    outer = 15.70 + share * (10.90 - 15.70)
    inner = 7.40 + share * (6.20 - 7.40)
    cortex_ratio = 0.2142  # Eq. 3: V1 = (4 D h - 4 h^2) / (D^2 - d^2), solved for h
    phloem = (outer - math.sqrt(outer**2 - cortex_ratio * (outer**2 - inner**2))) / 2.0
    return ramie(outer, inner, phloem)


def _table_8(row: int) -> Callable[[], BendingTest]:
    return lambda: ramie(*TABLE_8_MM[row])


PUBLISHED: dict[str, Callable[[], BendingTest]] = {
    # Table 3 also prints a xylem diameter of 12.84 mm, which would leave 0.695 mm of phloem.
    "table3": lambda: ramie(14.23, 7.28, 0.67),
    "table8-1": _table_8(0),
    "table8-2": _table_8(1),
    "table8-3": _table_8(2),
}
"""Published tests by name; names such as ``height-69cm`` are understood by `published_test`."""


def published_test(name: str) -> BendingTest:
    """Return a published test by its name, and warn of the contradiction in Table 3.

    Parameters
    ----------
    name
        A key of `PUBLISHED`, or ``height-Hcm``, where H is the height above ground (Table 1).

    Raises
    ------
    SpecificationError
        If there is no test of that name.
    """
    height = re.fullmatch(r"height-(\d+(?:\.\d+)?)cm", name)
    if height:
        test = ramie_at_height(float(height[1]))
    elif name in PUBLISHED:
        test = PUBLISHED[name]()
    else:
        known = ", ".join(PUBLISHED)
        allowed = f"must be one of {known}, height-NNcm, or a TOML file"
        raise SpecificationError("test", name, allowed)
    warn(
        f"Table 3 of {STUDY} prints G_XY = {PHLOEM_G_XY_PRINTED_MPA} MPa for the phloem, but its "
        f"Eq. 4 gives {PHLOEM.elastic.G_XY:.2f} MPa, which is used; for the printed value set "
        f"stalk.layers.phloem.material.elastic.G_XY_MPa={PHLOEM_G_XY_PRINTED_MPA}"
    )
    return test

"""Strong ellipticity of the laws when crushed across and compressed along the fibres."""

from __future__ import annotations

import numpy as np
import pandas as pd

from ramiefenics.model.ellipticity import smallest_acoustic_eigenvalue
from ramiefenics.published.stalks import PHLOEM
from ramiefenics.specification import Material
from ramiefenics.verification.constants import MATERIALS
from ramiefenics.verification.point import Point
from ramiefenics.verification.study import Array, Plot, Series, Study, at_least, near

STRETCHES = np.linspace(1.0, 0.36, 17)
FINE = 0.0005
COMPRESSIONS = np.concatenate([np.arange(0.0, 0.03, FINE), np.arange(0.03, 0.101, 0.005)])


def limits(law: str, material: Material) -> Array:
    """Return the axial compression at which ellipticity is lost, one per transverse stretch.

    The value is NaN where ellipticity is not lost within the range.
    """
    point = Point(law, material)
    tangents = [
        point.tangent(np.diag([1.0, stretch, 1.0 - compression]))
        for stretch in STRETCHES
        for compression in COMPRESSIONS
    ]
    lowest = smallest_acoustic_eigenvalue(np.array(tangents)).reshape(len(STRETCHES), -1)
    lost = lowest <= 0.0
    first = COMPRESSIONS[lost.argmax(axis=1)]
    return np.where(lost.any(axis=1), first, np.nan)


def stability() -> Study:
    """Map where all laws lose ellipticity, with the constants of the phloem or its matrix."""
    lost = {law: limits(law, list(layers.values())[-1]) for law, layers in MATERIALS.items()}
    never = [law for law, values in lost.items() if np.isnan(values).all()]
    elastic = PHLOEM.elastic
    collapse = float(STRETCHES[lost["svk"] == 0.0].max())
    kink = elastic.G_XZ_MPa / elastic.E_Z_MPa
    return Study(
        "Stability of the laws under crushing",
        "A material point of the phloem is crushed along Y to a given stretch and compressed along "
        "the fibres, while it is held along X; for the law isotropic, the material has the same "
        "E_X and nu_XY and no fibres. The table gives the axial compression at which the acoustic "
        f"tensor is no longer positive (empty: not within {COMPRESSIONS[-1]:.0%}). Fibres with a "
        "linear law "
        "kink where their stress reaches the shear modulus, at a strain of G_XZ / E_Z "
        f"= {kink:.2%} (Rosen 1965); St. Venant-Kirchhoff collapses under uniaxial strain at a "
        "stretch of 1 / sqrt(3), where the stress (lambda^3 - lambda) C11 / 2 has its extremum.",
        (
            near(
                "axial compression at which neo_hookean kinks, uncrushed",
                float(lost["neo_hookean"][0]),
                kink,
                0.05,
                "a scan in steps of 0.05 %, and a law of finite strain",
            ),
            at_least(
                "transverse stretch at which svk collapses, without axial compression",
                collapse,
                3**-0.5 - (STRETCHES[0] - STRETCHES[1]),
                "shear may make it collapse earlier; a scan in steps of 0.04",
            ),
            at_least(
                "share of the stretches at which saturating_fibre stays elliptic",
                float(np.isnan(lost["saturating_fibre"]).mean()),
                1.0,
                "the purpose of this law",
            ),
        ),
        pd.DataFrame({"transverse stretch": STRETCHES, **lost}),
        Plot(
            "transverse stretch",
            "axial compression where ellipticity is lost",
            tuple(
                Series(law, STRETCHES, values) for law, values in lost.items() if law not in never
            ),
            note=f"Nowhere: {', '.join(never)}",
        ),
    )

"""Bending with long cells of a layer that is 845 times stiffer along its fibres than across."""

from __future__ import annotations

import numpy as np
import pandas as pd
from dolfinx import fem

from ramiefenics.model.jit import compile_form
from ramiefenics.model.solid import Solid
from ramiefenics.published.stalks import PHLOEM
from ramiefenics.verification.block import (
    BoundaryValueProblem,
    block,
    layers,
    on_planes,
    prescribe,
    second_order,
)
from ramiefenics.verification.patch import SPACES
from ramiefenics.verification.study import Array, Plot, Series, Study, at_most

CURVATURE = 1e-6
"""Curvature, 1/mm, so small that strains stay linear."""

HEIGHT, CELLS = 1.0, 8
ASPECTS = (1.0, 2.0, 5.0, 10.0, 20.0)


def pure_bending(x: Array) -> Array:
    """Return the exact displacement of a linearly elastic bar bent in the plane of Y and Z.

    The axial strain is -c y; laterally the bar contracts by Poisson's ratio (Timoshenko and Goodier
    1970, section 102).
    """
    elastic = PHLOEM.elastic
    nu = elastic.nu_XZ * elastic.E_Z_MPa / elastic.E_X_MPa
    c = CURVATURE
    return np.array(
        [
            c * nu * x[0] * x[1],
            c / 2 * (x[2] ** 2 + nu * (x[1] ** 2 - x[0] ** 2)),
            -c * x[1] * x[2],
        ]
    )


def stiffness_ratio(space: tuple[int, bool], aspect: float) -> float:
    """Return the ratio of the energy of a bar, two cells high, to the exact energy."""
    order, serendipity = space
    across = np.linspace(-HEIGHT / 2, HEIGHT / 2, 3)
    along = aspect * HEIGHT / 2 * np.arange(CELLS + 1)
    mesh = block(across, across, along)
    mesh = mesh if order == 1 else second_order(mesh)
    solid = Solid(mesh, layers(mesh), [PHLOEM], "saturating_fibre", serendipity)
    ends = on_planes(mesh, 2, along[0], along[-1])
    BoundaryValueProblem(solid, [prescribe(solid, ends, pure_bending)]).solve(1e-11)
    energy = float(fem.assemble_scalar(compile_form(solid.energy())))
    second_moment = HEIGHT**4 / 12
    exact = PHLOEM.elastic.E_Z_MPa * second_moment * CURVATURE**2 / 2 * along[-1]
    return energy / exact


def locking() -> Study:
    """Bend a bar with cells of increasing length in every displacement space."""
    ratios = {
        name: [stiffness_ratio(space, aspect) for aspect in ASPECTS]
        for name, space in SPACES.items()
    }
    worst = max(
        abs(ratio - 1) for name, found in ratios.items() if name != "order 1" for ratio in found
    )
    return Study(
        "Locking",
        "A bar of phloem, E_Z / E_X = 845 and nu_ZX = 3.4, two cells high, in pure bending, with "
        "cells up to 20 times as long as high. The stiffness is relative to the exact one. "
        "Whatever their length, first-order cells cannot bend without shear, and cannot become "
        "thinner above and thicker below as Poisson's ratio requires: they are for comparison "
        "only. Second-order cells can represent the exact solution.",
        (
            at_most(
                "second order: largest error of the stiffness",
                worst,
                1e-4,
                "the exact solution is in the space; the law is not quite linear",
            ),
        ),
        pd.DataFrame({"length / height of a cell": ASPECTS, **ratios}),
        Plot(
            "length / height of a cell",
            "bending stiffness / exact",
            tuple(Series(name, ASPECTS, found) for name, found in ratios.items()),
        ),
    )

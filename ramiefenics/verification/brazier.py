"""Pure bending of a thin tube: Brazier's largest moment."""

from __future__ import annotations

import numpy as np
import pandas as pd
import ufl
from dolfinx import fem
from dolfinx import mesh as dmesh

from ramiefenics.model.jit import compile_form
from ramiefenics.model.solid import Solid
from ramiefenics.specification import Elastic, Material
from ramiefenics.verification.block import (
    BoundaryValueProblem,
    block,
    hold,
    layers,
    on_planes,
    second_order,
)
from ramiefenics.verification.study import Plot, Series, Study, near

RADIUS, WALL, SLICE = 30.0, 1.0, 4.0
"""Radius of the tube's middle surface, thickness of its wall, and length of the slice, mm."""

YOUNG, POISSON = 1000.0, 0.3
AROUND = 24
"""Number of second-order cells around half the section."""

STIFFNESS = 1e3 * YOUNG / SLICE
"""Stiffness of the springs that hold the end in its plane, N/mm3.

They yield by a thousandth of the slice's elongation.
"""

MATERIAL = Material(Elastic.isotropic(YOUNG, POISSON))

LARGEST_MOMENT = 2 * np.sqrt(2) / 9 * np.pi * YOUNG * RADIUS * WALL**2 / np.sqrt(1 - POISSON**2)
"""Largest moment, N mm (Brazier 1927)."""

ITS_CURVATURE = np.sqrt(2) / 3 * WALL / (RADIUS**2 * np.sqrt(1 - POISSON**2))
"""Curvature at the largest moment, 1/mm; the section is then flattened by 2/9 of its diameter."""


class Slice:
    """Half a slice of a tube between two planes of symmetry, one of which is tilted.

    A tube in pure bending is uniform along its axis: its cross-sections stay plane, and are free to
    flatten. The tilted plane turns about the axis of curvature, at y = -1 / curvature.
    """

    def __init__(self) -> None:
        around = np.linspace(0.0, np.pi, AROUND + 1)
        wall = RADIUS + WALL * np.array([-0.5, 0.5])
        mesh = second_order(block(around, wall, np.array([0.0, SLICE])))
        points = mesh.geometry.x
        angle, radius = points[:, 0].copy(), points[:, 1].copy()
        points[:, 0], points[:, 1] = radius * np.sin(angle), radius * np.cos(angle)
        self._solid = solid = Solid(mesh, layers(mesh), [MATERIAL], "isotropic")
        middle, start, end = (
            on_planes(mesh, axis, at) for axis, at in ((0, 0.0), (2, 0.0), (2, SLICE))
        )
        tags = dmesh.meshtags(mesh, 2, np.sort(end), np.ones(len(end), dtype=np.int32))
        self._curvature = fem.Constant(mesh, 0.0)
        tilt = self._curvature * SLICE
        x = ufl.SpatialCoordinate(mesh) + solid.displacement
        normal = ufl.as_vector((0, -ufl.sin(tilt), ufl.cos(tilt)))
        to_axis = SLICE * (1 - tilt**2 / 6)  # sin(tilt) / curvature, also for no curvature
        at_end = ufl.ds(mesh, subdomain_data=tags)(1)
        pressure = STIFFNESS * (ufl.dot(normal, x) - to_axis)
        bcs = [hold(solid, middle, 0), hold(solid, start, 2)]
        self._problem = BoundaryValueProblem(
            solid, bcs, lambda v: pressure * ufl.dot(normal, v) * at_end
        )
        self._moment = compile_form(-2 * pressure * x[1] * at_end)
        nodes = solid.space.tabulate_dof_coordinates()
        self._top, self._bottom = (
            np.flatnonzero(np.isclose(nodes[:, 0], 0.0, atol=1e-6) & (sign * nodes[:, 1] > 0))
            for sign in (1, -1)
        )

    def bend(self, curvature: float) -> tuple[float, float]:
        """Return the moment, N mm, and the flattening over the diameter at a curvature, 1/mm."""
        last = float(self._curvature.value)
        self._solid.displacement.x.array[:] *= curvature / last if last else 1.0  # prediction
        self._curvature.value = curvature
        self._problem.solve(1e-5 * YOUNG)
        moved = self._solid.displacement.x.array.reshape(-1, 3)[:, 1]
        flattening = (moved[self._bottom].mean() - moved[self._top].mean()) / (2 * RADIUS)
        return float(fem.assemble_scalar(self._moment)), float(flattening)


def brazier() -> Study:
    """Bend a thin tube beyond its largest moment."""
    slice_of_tube = Slice()
    shares = np.arange(0.1, 1.61, 0.1)
    found = np.array([slice_of_tube.bend(share * ITS_CURVATURE) for share in shares])
    moments, flattenings = found.T / np.array([[LARGEST_MOMENT], [1.0]])
    top = int(moments.argmax())
    fine = np.linspace(shares[0], shares[-1], 1000)
    return Study(
        "Brazier's moment",
        f"A tube of radius {RADIUS:g} mm and wall thickness {WALL:g} mm in pure bending, without "
        "contact: its section flattens, and its moment has a maximum of 2 sqrt(2) / 9 pi E r t^2 / "
        "sqrt(1 - nu^2) where the diameter is shorter by 2/9 (Brazier 1927). His theory is of "
        "first order in the flattening.",
        (
            near(
                "largest moment over Brazier's",
                float(moments[top]),
                1.0,
                0.05,
                "the theory neglects the square of a flattening of 2/9",
            ),
            near(
                "curvature at the largest moment over Brazier's",
                float(shares[top]),
                1.0,
                0.15,
                "a flat maximum, in steps of a tenth",
            ),
            near(
                "moment at a tenth of that curvature over pi E r^3 t times it",
                float(
                    moments[0]
                    * LARGEST_MOMENT
                    / (np.pi * YOUNG * RADIUS**3 * WALL * 0.1 * ITS_CURVATURE)
                ),
                1.0,
                0.01,
                "no flattening yet: 1.5 x (0.1)^2 of 2/9",
            ),
        ),
        pd.DataFrame(
            {
                "curvature / Brazier's": shares,
                "moment / Brazier's": moments,
                "flattening": flattenings,
            }
        ),
        Plot(
            "curvature / Brazier's",
            "moment / Brazier's",
            (
                Series("finite elements", shares, moments, points=True),
                Series("Brazier", fine, 1.5 * fine - 0.5 * fine**3),
            ),
        ),
    )

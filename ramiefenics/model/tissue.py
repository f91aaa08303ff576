"""Variation of a stalk's tissue from point to point: moduli, fibre direction, strain at rest."""

from __future__ import annotations

import itertools
import math

import numpy as np
from dolfinx import fem
from numpy.typing import NDArray

from ramiefenics.model.compat import geometry_order
from ramiefenics.model.local_law import FIBRE_X, FIBRE_Y, STIFFNESS, STRETCH, WIDTH
from ramiefenics.model.material_memory import point_element
from ramiefenics.model.shape import round_section, straightened
from ramiefenics.model.tube import TubeMesh
from ramiefenics.specification import Stalk

Array = NDArray[np.float64]


def tissue_fields(stalk: Stalk, tube: TubeMesh) -> dict[str, fem.Function]:
    """Return the fields that vary from point to point within layers, by the names in `local_law`.

    Their values are given at the quadrature points of the cells; between them, and at the surface,
    they are interpolated.
    """
    tissue, mesh = stalk.tissue, tube.mesh
    space = fem.functionspace(mesh, point_element(mesh, geometry_order(mesh)))
    at = space.tabulate_dof_coordinates()
    layer = np.zeros(len(at), dtype=np.int32)
    layer[space.dofmap.list[tube.cells.indices]] = tube.cells.values[:, None]
    radius = np.hypot(*round_section(stalk, at))
    fields: dict[str, Array] = {}
    if tissue.radial_gradient != 0.0:
        fields[STIFFNESS] = 1.0 + tissue.radial_gradient * _outwards(stalk, radius, layer)
    if tissue.fibre_angle_deg != 0.0 or stalk.curvature_per_m != 0.0:
        fields[FIBRE_X], fields[FIBRE_Y] = _fibres(stalk, at)
    if tissue.growth_strain != 0.0:
        grown = layer <= len(stalk.layers)  # a node has no fibres
        fields[STRETCH] = 1.0 + grown * tissue.growth_strain * _balanced(stalk, radius)
        # Poisson's ratio along the fibres, so that sections keep their size to first order
        elastic = [material.elastic for material in stalk.materials]
        ratio = np.array([e.nu_XZ * e.E_Z_MPa / e.E_X_MPa for e in elastic])
        fields[WIDTH] = (
            fields[STRETCH] ** -ratio[np.minimum(layer, len(ratio)) - 1]
        )  # a bond may have any width
    functions = {name: fem.Function(space, name=name) for name in fields}
    for name, function in functions.items():
        function.x.array[:] = fields[name]
        function.x.scatter_forward()
    return functions


def _outwards(stalk: Stalk, radius: Array, layer: NDArray[np.int32]) -> Array:
    """Return a radial coordinate in every layer, of range 1 and of mean 0 over its area."""
    found = np.zeros_like(radius)
    radii = stalk.radii_mm
    for number, (inner, outer) in enumerate(itertools.pairwise(radii), start=1):
        mean = 2.0 / 3.0 * (outer**3 - inner**3) / (outer**2 - inner**2)
        here = layer == number
        found[here] = (radius[here] - mean) / (outer - inner)
    return found


def _balanced(stalk: Stalk, radius: Array) -> Array:
    """Return a radial coordinate, 1 at the surface, that as an axial strain has no net force."""
    radii, young = np.array(stalk.radii_mm), [x.material.elastic.E_Z_MPa for x in stalk.layers]
    mean = 2.0 / 3.0 * np.dot(young, np.diff(radii**3)) / np.dot(young, np.diff(radii**2))
    return np.asarray((radius - mean) / (radii[-1] - mean))


def _fibres(stalk: Stalk, at: Array) -> tuple[Array, Array]:
    """Return X and Y of the fibres' direction: helices around the axis, on similar ellipses."""
    x, y = round_section(stalk, at)
    across, up = -y, stalk.height_mm / stalk.outer_diameter_mm * x
    turn = math.radians(stalk.rotation_deg)
    angle = math.radians(stalk.tissue.fibre_angle_deg)
    lean = math.sin(angle) / np.hypot(across, up)
    cos, sin = math.cos(turn), math.sin(turn)
    aside, above = lean * (cos * across - sin * up), lean * (sin * across + cos * up)
    slope = stalk.curvature_per_m / 1000.0 * straightened(stalk, at)[:, 2]
    return aside, above * np.cos(slope) - math.cos(angle) * np.sin(slope)

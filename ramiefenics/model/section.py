"""Cross-section of the stalk as transfinite quadrilateral blocks in Gmsh."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass

import gmsh

from ramiefenics.specification import MeshRecipe, Stalk

CORE_ON_AXIS, CORE_DIAGONAL = 0.5, 0.55
"""Radius of the corners of a solid core's inner block, over that of the innermost layer.

The first is for corners on an axis, the second for those between axes.
"""


THINNESS = 1e-4
"""Thickness of the film of cells that bonds the outermost layer, over that of the layer."""

FILM = -1
"""Index of the film among the layers."""


@dataclass(frozen=True)
class _Ring:
    """A full or half ring of nodes around the axis.

    The ring around the block that fills a solid core has straight edges, and its radii alternate
    (on an axis, between axes). Any other ring has one radius and circular arcs.
    """

    on_axis: float
    diagonal: float
    straight: bool


def add_section(
    stalk: Stalk, recipe: MeshRecipe, z: float, full: bool, filled: bool = False
) -> dict[int, list[int]]:
    """Add the section's blocks to the current Gmsh model.

    Parameters
    ----------
    stalk
        Stalk, which gives the radii.
    recipe
        Mesh recipe, which gives the numbers of elements.
    z
        Z of the section's plane, mm.
    full
        Whether to mesh the whole section, or else the half X >= 0.
    filled
        Whether the innermost layer fills a void; the other layers are divided as without it.

    Returns
    -------
    dict
        Tags of the surfaces of each layer, by its index from the inside, and of the film if the
        bond is not perfect.
    """
    geo = gmsh.model.geo
    solid = stalk.void_diameter_mm == 0.0
    per_arc = math.ceil(recipe.angular_elements / (4 if solid else 2))
    angles = _angles(solid, full, recipe.side_growth**per_arc)
    rings, layers, counts = _rings(stalk, recipe, filled)

    centre = geo.addPoint(0.0, 0.0, z)
    points = [[_point(ring, angle, z) for angle in angles] for ring in rings]
    if full:  # the last angle is the first one again
        for row in points:
            row[-1] = row[0]
    arcs: list[list[int]] = []
    for ring, row in zip(rings, points, strict=True):
        arcs.append([])
        for first, second in itertools.pairwise(row):
            line = (
                geo.addLine(first, second)
                if ring.straight
                else geo.addCircleArc(first, centre, second)
            )
            arcs[-1].append(line)
        for line, angle in zip(arcs[-1], angles, strict=False):
            # arcs run counter-clockwise: away from a side in the first and third quadrants
            growth = recipe.side_growth if angle % 180 < 90 else 1.0 / recipe.side_growth
            geo.mesh.setTransfiniteCurve(line, per_arc + 1, "Progression", growth)

    surfaces: dict[int, list[int]] = {index: [] for index in sorted(set(layers))}
    for i, (layer, count) in enumerate(zip(layers, counts, strict=True)):
        spokes = [
            geo.addLine(inner, outer) for inner, outer in zip(points[i], points[i + 1], strict=True)
        ]
        if full:
            geo.remove([(1, spokes[-1])])
            spokes[-1] = spokes[0]
        for spoke in set(spokes):
            core = solid and i == 0
            growth = 1.0 if core else recipe.bore_growth
            geo.mesh.setTransfiniteCurve(spoke, count + 1, "Progression", growth)
        for j in range(len(angles) - 1):
            loop = [arcs[i][j], spokes[j + 1], -arcs[i + 1][j], -spokes[j]]
            surfaces[layer].append(_block(loop))
    if solid:
        surfaces[0] += _core(points[0], arcs[0], centre, angles, per_arc, full)
    return surfaces


def _angles(solid: bool, full: bool, share: float) -> list[float]:
    """Return the angles of the spokes between blocks, degrees from X, ascending.

    Parameters
    ----------
    solid
        Whether there is a core, whose block has a corner within each quadrant.
    full
        Whether to cover all four quadrants, or else those at X >= 0.
    share
        Angle between corner and Y over that between X and corner, such that nodes graded towards
        the sides are those of a tube without core.
    """
    corner = 90.0 / (1.0 + share)
    inside = [corner] if solid else []
    quadrants = range(-180, 180, 90) if full else range(-90, 90, 90)
    angles: list[float] = []
    for start in quadrants:
        from_side = start % 180 == 0
        angles.append(start)
        angles += [start + (a if from_side else 90.0 - a) for a in inside]
    return [*angles, 180.0 if full else 90.0]


def _rings(
    stalk: Stalk, recipe: MeshRecipe, filled: bool
) -> tuple[list[_Ring], list[int], list[int]]:
    """Return the rings, and for each gap between two rings its layer and number of elements.

    The film is a gap of its own, whose thickness is taken from the outermost layer.
    """
    radii = list(stalk.radii_mm)
    rings = [_Ring(radius, radius, False) for radius in radii]
    if stalk.void_diameter_mm == 0.0:
        rings[0] = _Ring(CORE_ON_AXIS * radii[1], CORE_DIAGONAL * radii[1], True)
    layers = list(range(len(stalk.layers)))
    thickness = [rings[i + 1].on_axis - rings[i].on_axis for i in layers]
    # a core within a wall has elements of the wall's size, in addition to the wall's
    cored = filled or (stalk.void_diameter_mm == 0.0 and len(layers) > 2)
    tube = thickness[1:] if cored else thickness
    wall = sum(tube[:-1]) or tube[0]
    counts = [max(1, round(recipe.wall_elements * t / wall)) for t in thickness[:-1]]
    single = recipe.wall_elements + recipe.rind_elements  # one layer is wall and rind at once
    counts.append(recipe.rind_elements if len(tube) > 1 else single)
    if not stalk.bond.perfect:
        radius = radii[-2] + THINNESS * (radii[-1] - radii[-2])
        rings.insert(-1, _Ring(radius, radius, False))
        layers.insert(-1, FILM)
        counts.insert(-1, 1)
    return rings, layers, counts


def _point(ring: _Ring, angle: float, z: float) -> int:
    radius = ring.diagonal if angle % 90 else ring.on_axis
    x, y = radius * math.cos(math.radians(angle)), radius * math.sin(math.radians(angle))
    return int(gmsh.model.geo.addPoint(0.0 if angle % 180 == 90 else x, y, z))


def _block(loop: list[int]) -> int:
    geo = gmsh.model.geo
    surface = geo.addPlaneSurface([geo.addCurveLoop(loop)])
    geo.mesh.setTransfiniteSurface(surface)
    geo.mesh.setRecombine(2, surface)
    return int(surface)


def _core(
    ring: list[int], edges: list[int], centre: int, angles: list[float], per_arc: int, full: bool
) -> list[int]:
    """Fill the innermost ring with one four-sided block per quadrant."""
    geo = gmsh.model.geo
    on_axis = [i for i, angle in enumerate(angles) if angle % 90 == 0]
    spokes = {i: geo.addLine(centre, ring[i]) for i in (on_axis[:-1] if full else on_axis)}
    if full:
        spokes[on_axis[-1]] = spokes[on_axis[0]]
    for spoke in set(spokes.values()):
        geo.mesh.setTransfiniteCurve(spoke, per_arc + 1)
    return [_block([spokes[i], edges[i], edges[i + 1], -spokes[i + 2]]) for i in on_axis[:-1]]

"""The layered tube as a distributed mesh of hexahedra with named parts."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

import gmsh
import numpy as np
from dolfinx import mesh as dmesh
from mpi4py import MPI
from numpy.typing import NDArray

from ramiefenics.model.compat import mesh_from_gmsh
from ramiefenics.model.grading import axial_positions
from ramiefenics.model.section import FILM, add_section
from ramiefenics.model.shape import stalk_point
from ramiefenics.specification import (
    BendingTest,
    Cylinder,
    Layer,
    MeshRecipe,
    SpecificationError,
    Stalk,
)

SURFACES = {"outer": 101, "inner": 102, "ends": 103, "symmetry_x": 104, "symmetry_z": 105}
"""Physical tags of the surfaces; the layers have 1, 2, ... from the inside out, then the node."""

NODE = "node"

MOST_CELLS = 3_000_000
"""Largest number of cells of a mesh, which makes tens of millions of unknowns."""

FILM_TAG = 100
"""Physical tag of the film that bonds the outermost layer, if the bond is not perfect."""

Blocks = dict[int, list[int]]
"""Gmsh tags of the surfaces or volumes of each layer, by the layer's index."""


@dataclass(frozen=True)
class TubeMesh:
    """A mesh with tags of its layers and surfaces.

    Attributes
    ----------
    mesh
        Hexahedra of order 1 or 2.
    cells
        Layer of every cell, 1 for the innermost; the next number for the node, `FILM_TAG` for a
        bond.
    facets
        Tags of the boundary facets, those of `SURFACES`.
    """

    mesh: dmesh.Mesh
    cells: dmesh.MeshTags
    facets: dmesh.MeshTags


def build_tube(test: BendingTest, comm: MPI.Comm, others: Sequence[Cylinder] = ()) -> TubeMesh:
    """Mesh a test's stalk and distribute it over `comm`; collective, no file is written.

    Parameters
    ----------
    test
        Test whose stalk to mesh.
    comm
        MPI communicator.
    others
        Cylinders of other tests of the same stalk, for which the mesh is to serve, too.

    Raises
    ------
    SpecificationError
        If Gmsh cannot mesh the stalk; on all ranks.
    """
    with _gmsh_session():
        refused = None
        if comm.rank == 0:
            try:
                _add_tube(test, others)
            except SpecificationError as error:
                refused = error
        refused = comm.bcast(refused)
        if refused is not None:
            raise refused
        mesh, cells, facets = mesh_from_gmsh(gmsh.model, comm)
    return TubeMesh(mesh, cells, facets)


def read_tube(path: str | Path, comm: MPI.Comm, surfaces: Mapping[int, str]) -> TubeMesh:
    """Read a tube from a Gmsh file and distribute it; collective.

    Parameters
    ----------
    path
        Gmsh file of hexahedra whose physical volumes are 1, 2, ... from the inside out.
    comm
        MPI communicator.
    surfaces
        Key of `SURFACES` for each physical surface of the file.
    """
    with _gmsh_session():
        if comm.rank == 0:
            gmsh.merge(str(path))
        mesh, cells, facets = mesh_from_gmsh(gmsh.model, comm)
    tags = np.array([SURFACES[surfaces[tag]] for tag in facets.values], dtype=np.int32)
    renamed = dmesh.meshtags(mesh, facets.dim, facets.indices, tags)
    return TubeMesh(mesh, cells, renamed)


def write_tube(test: BendingTest, path: str | Path) -> None:
    """Mesh a test's stalk and write it as a Gmsh file, physical names included."""
    with _gmsh_session():
        _add_tube(test)
        gmsh.write(str(path))


@contextmanager
def _gmsh_session() -> Iterator[None]:
    """Use a separate Gmsh model, without disturbing a session that the caller may have open."""
    ours = not gmsh.isInitialized()
    if ours:
        gmsh.initialize(interruptible=False)
    verbose = gmsh.option.getNumber("General.Terminal")
    gmsh.option.setNumber("General.Terminal", 0)
    gmsh.model.add("ramiefenics")
    try:
        yield
    finally:
        gmsh.model.remove()
        gmsh.option.setNumber("General.Terminal", verbose)
        if ours:
            gmsh.finalize()


def _add_tube(test: BendingTest, others: Sequence[Cylinder] = ()) -> None:
    z = axial_positions(test, others)
    stalk, numerics = test.stalk, test.numerics
    full = numerics.domain == "full"
    _check_number(numerics.mesh, len(z) - 1, full)
    if stalk.node_mm is None:
        section = add_section(stalk, numerics.mesh, float(z[0]), full)
        volumes, _ = _extrude(section, z)
    else:
        section = add_section(_filled(stalk), numerics.mesh, float(z[0]), full, filled=True)
        volumes = _extrude_with_node(section, z, stalk.node_mm)
    gmsh.model.geo.synchronize()
    names = dict(enumerate([*(layer.name for layer in stalk.layers), NODE])) | {FILM: "bond"}
    for index, solids in volumes.items():
        tag = FILM_TAG if index == FILM else index + 1
        gmsh.model.addPhysicalGroup(3, solids, tag, names[index])
    for name, surfaces in _classify(volumes, test).items():
        if surfaces:
            gmsh.model.addPhysicalGroup(2, surfaces, SURFACES[name], name)
    try:
        gmsh.model.mesh.generate(3)
    except Exception as error:  # Gmsh raises no other type
        allowed = f"cannot be meshed ({error})"
        raise SpecificationError("stalk", None, allowed) from error
    gmsh.model.mesh.setOrder(numerics.mesh.order)
    straight = replace(
        stalk,
        section_height_mm=None,
        rotation_deg=0.0,
        taper=0.0,
        void_offset_mm=0.0,
        curvature_per_m=0.0,
    )
    if stalk != straight:
        _shape(stalk)


def _check_number(recipe: MeshRecipe, along: int, full: bool) -> None:
    """Check that a mesh is small enough to be made in minutes and to have its matrix stored."""
    around = recipe.angular_elements * (2 if full else 1)
    cells = along * around * (recipe.wall_elements + recipe.rind_elements)
    if cells > MOST_CELLS:
        allowed = f"must make at most {MOST_CELLS:,} cells, but would make {cells:,}"
        raise SpecificationError("numerics.mesh", recipe.name, allowed)


def _shape(stalk: Stalk) -> None:
    """Move the nodes of a straight circular tube to their positions in the stalk."""
    tags, coordinates, _ = gmsh.model.mesh.getNodes()
    for tag, place in zip(tags, coordinates.reshape(-1, 3).tolist(), strict=True):
        gmsh.model.mesh.setNode(tag, stalk_point(stalk, *place), [])


def _filled(stalk: Stalk) -> Stalk:
    """Return the stalk with its void filled by the node's material over the whole length."""
    core = Layer(NODE, stalk.void_diameter_mm, stalk.materials[-1])
    return Stalk(stalk.length_mm, 0.0, (core, *stalk.layers), bond=stalk.bond)


def _extrude_with_node(
    section: Blocks, z: NDArray[np.float64], node_mm: tuple[float, float]
) -> Blocks:
    """Extrude a section that has a core, and return the volumes, the core in the node only.

    The core has the last index. Outside the node it is removed at the end, because the volumes that
    adjoin it are extruded from its faces.
    """
    cuts = [0, *(int(np.abs(z - at).argmin()) for at in node_mm if at > z[0]), len(z) - 1]
    place = {index: index if index == FILM else index - 1 for index in section}
    place[0] = max(section)
    volumes: Blocks = {index: [] for index in sorted(place.values())}
    void: list[int] = []
    for start, stop in itertools.pairwise(cuts):
        made, section = _extrude(section, z[start : stop + 1])
        if not node_mm[0] < (z[start] + z[stop]) / 2.0 < node_mm[1]:
            void += made.pop(0)
        for index, solids in made.items():
            volumes[place[index]] += solids
    gmsh.model.geo.remove([(3, solid) for solid in void])
    return volumes


def _extrude(section: Blocks, z: NDArray[np.float64]) -> tuple[Blocks, Blocks]:
    """Extrude a section; return the volumes, and the section at the far end."""
    length = float(z[-1] - z[0])
    heights = ((z[1:] - z[0]) / length).tolist()
    volumes: Blocks = {}
    ends: Blocks = {}
    for index, surfaces in section.items():
        made = gmsh.model.geo.extrude(
            [(2, surface) for surface in surfaces],
            0.0,
            0.0,
            length,
            numElements=[1] * len(heights),
            heights=heights,
            recombine=True,
        )
        solids = [at for at, (dimension, _) in enumerate(made) if dimension == 3]
        volumes[index] = [made[at][1] for at in solids]
        ends[index] = [made[at - 1][1] for at in solids]  # the face at the far end precedes it
    return volumes, ends


def _classify(volumes: Blocks, test: BendingTest) -> dict[str, list[int]]:
    """Sort the boundary surfaces by their position, not by the order in which Gmsh has them."""
    quarter = test.numerics.domain == "quarter"
    inner, outer = test.stalk.void_diameter_mm / 2.0, test.stalk.outer_diameter_mm / 2.0
    tolerance = 1e-3 * outer
    parts: dict[str, list[int]] = {name: [] for name in SURFACES}
    solids = [(3, tag) for tags in volumes.values() for tag in tags]
    for _, tag in gmsh.model.getBoundary(solids, combined=True, oriented=False):
        x0, y0, z0, x1, y1, z1 = gmsh.model.getBoundingBox(2, tag)
        if z1 - z0 < tolerance:
            if abs(z0) > (0.5 - 1e-6) * test.stalk.length_mm:
                name = "ends"
            else:  # a plane of symmetry, or a face of the node
                name = "symmetry_z" if quarter and abs(z0) < tolerance else "inner"
        elif max(abs(x0), abs(x1)) < tolerance:
            name = "symmetry_x"
        else:
            radius = max(abs(x0), abs(x1), abs(y0), abs(y1))  # as an arc ends on an axis
            name = "outer" if radius > (inner + outer) / 2.0 else "inner"
        parts[name].append(tag)
    return parts

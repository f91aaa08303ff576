"""Meshes, compared with the geometry that they represent."""

from __future__ import annotations

from pathlib import Path

import gmsh
import numpy as np
import pytest
import ufl
from dolfinx import fem
from mpi4py import MPI

from ramiefenics import BendingTest, Stalk, override
from ramiefenics.model.grading import axial_positions
from ramiefenics.model.tube import SURFACES, TubeMesh, build_tube, write_tube

SHARE = {"quarter": 0.25, "half": 0.5, "full": 1.0}


def _volume(tube: TubeMesh, layer: int) -> float:
    dx = ufl.Measure("dx", tube.mesh, subdomain_data=tube.cells)
    return float(fem.assemble_scalar(fem.form(fem.Constant(tube.mesh, 1.0) * dx(layer))))


def _area(tube: TubeMesh, name: str) -> float:
    ds = ufl.Measure("ds", tube.mesh, subdomain_data=tube.facets)
    return float(fem.assemble_scalar(fem.form(fem.Constant(tube.mesh, 1.0) * ds(SURFACES[name]))))


def _exact_volumes(stalk: Stalk) -> list[float]:
    areas = np.pi * np.diff(np.square(stalk.radii_mm))
    return [float(area) * stalk.length_mm for area in areas]


@pytest.mark.parametrize("domain", SHARE)
@pytest.mark.parametrize("void", [7.28, 0.0])
def test_second_order_tube_has_the_layers_volumes(
    screening: BendingTest, domain: str, void: float
) -> None:
    test = override(
        screening,
        [
            f"numerics.domain={domain}",
            f"stalk.void_diameter_mm={void}",
            "numerics.mesh.order=2",
            "numerics.mesh.contact_size=0.04",
        ],
    )
    tube = build_tube(test, MPI.COMM_SELF)
    for layer, exact in enumerate(_exact_volumes(test.stalk), start=1):
        # quadratic arcs of 22.5 degrees have an error of 1e-4 of the outermost, thin layer
        assert _volume(tube, layer) == pytest.approx(SHARE[domain] * exact, rel=3e-4)


def test_straight_edges_leave_out_what_a_polygon_leaves_out(coarse: BendingTest) -> None:
    tube = build_tube(coarse, MPI.COMM_SELF)
    arc = np.pi / coarse.numerics.mesh.angular_elements
    polygon = np.sin(arc) / arc  # area of a regular polygon over that of its circle
    for layer, exact in enumerate(_exact_volumes(coarse.stalk), start=1):
        assert _volume(tube, layer) == pytest.approx(0.25 * exact * polygon, rel=1e-10)


@pytest.mark.parametrize("domain", SHARE)
def test_surfaces_cover_the_boundary_once(screening: BendingTest, domain: str) -> None:
    test = override(screening, [f"numerics.domain={domain}", "numerics.mesh.order=2"])
    tube = build_tube(test, MPI.COMM_SELF)
    ds = ufl.Measure("ds", tube.mesh)
    whole = fem.assemble_scalar(fem.form(fem.Constant(tube.mesh, 1.0) * ds))
    assert sum(_area(tube, name) for name in SURFACES) == pytest.approx(whole, rel=1e-12)
    radii, length = test.stalk.radii_mm, test.stalk.length_mm
    share = SHARE[domain]
    assert _area(tube, "outer") == pytest.approx(2 * np.pi * radii[-1] * length * share, rel=1e-3)
    assert _area(tube, "inner") == pytest.approx(2 * np.pi * radii[0] * length * share, rel=1e-3)
    ring = np.pi * (radii[-1] ** 2 - radii[0] ** 2)
    sections = {"quarter": (0.5, 0.5), "half": (1.0, 0.0), "full": (2.0, 0.0)}[domain]
    assert _area(tube, "ends") == pytest.approx(sections[0] * ring, rel=1e-3)
    assert _area(tube, "symmetry_z") == pytest.approx(sections[1] * ring, rel=1e-3)


def test_any_number_of_layers(screening: BendingTest) -> None:
    xylem, phloem = screening.stalk.layers
    import dataclasses

    bark = dataclasses.replace(phloem, name="bark", outer_diameter_mm=15.0)
    for layers in [(phloem,), (xylem, phloem, bark)]:
        stalk = dataclasses.replace(screening.stalk, layers=layers)
        tube = build_tube(dataclasses.replace(screening, stalk=stalk), MPI.COMM_SELF)
        assert sorted(set(tube.cells.values)) == list(range(1, len(layers) + 1))


@pytest.mark.parametrize("domain", SHARE)
def test_sections_are_fine_at_the_bore_and_at_the_sides(
    screening: BendingTest, domain: str
) -> None:
    changes = ["bore_growth=2.0", "side_growth=1.5", "angular_elements=6", "wall_elements=3"]
    test = override(
        screening,
        [f"numerics.domain={domain}", *(f"numerics.mesh.{change}" for change in changes)],
    )
    x = build_tube(test, MPI.COMM_SELF).mesh.geometry.x
    x = x[np.abs(x[:, 2] - x[:, 2].min()) < 1e-9]
    radius, angle = np.hypot(x[:, 0], x[:, 1]), np.degrees(np.arctan2(x[:, 1], x[:, 0]))
    bore = np.unique(np.abs(angle[np.isclose(radius, test.stalk.radii_mm[0])]).round(3))
    # every other node is a corner: 1 + 1.5 + 2.25 parts of 90 degrees
    corners = 90.0 / 4.75 * np.array([0.0, 1.0, 2.5, 4.75])
    expected = corners if domain != "full" else np.concatenate([corners, 180 - corners[-2::-1]])
    assert bore[::2] == pytest.approx(expected, abs=2e-3)
    wall = np.unique(radius[np.abs(x[:, 1]) < 1e-9].round(6))[:7:2]
    inner, outer = test.stalk.radii_mm[:2]
    assert wall == pytest.approx(inner + (outer - inner) / 7.0 * np.array([0, 1, 3, 7]), abs=1e-5)


def test_fine_under_the_cylinders_and_coarse_between(coarse: BendingTest) -> None:
    recipe = coarse.numerics.mesh
    z = axial_positions(coarse)
    size, middle = np.diff(z), (z[1:] + z[:-1]) / 2
    zone = 100.0 * recipe.contact_zone  # of the span
    near = (middle < 0.8 * zone) | (np.abs(middle - 50.0) < 0.8 * zone)
    assert size[near].max() <= 100.0 * recipe.contact_size * 1.01
    assert size.max() > 2.0 * 100.0 * recipe.contact_size
    assert size.max() <= 100.0 * recipe.coarse_size * 1.01
    assert (z[0], z[-1]) == (0.0, 90.0)
    assert np.abs(z - 50.0).min() < 1e-12


def test_cells_follow_the_shortest_of_span_diameter_and_radius(screening: BendingTest) -> None:
    def longest_and_under(*changes: str) -> tuple[float, float]:
        size = np.diff(axial_positions(override(screening, changes)))
        return float(size.max()), float(size[0])

    usual = longest_and_under()
    # if everything is three times as large, so is the mesh
    large = longest_and_under(
        "stalk.layers.phloem.outer_diameter_mm=42.69",
        "stalk.layers.xylem.outer_diameter_mm=38.52",
        "stalk.void_diameter_mm=21.84",
        "stalk.length_mm=540",
        "fixture.span_mm=300",
        "fixture.indenter_radius_mm=15",
        "fixture.support_radius_mm=15",
    )
    assert large == pytest.approx([3 * length for length in usual], rel=1e-9)
    sharp = longest_and_under("fixture.indenter_radius_mm=0.5")
    assert sharp[1] <= 0.06 * 21 * 0.5 * (1 + 1e-9)
    assert sharp[0] == pytest.approx(usual[0], rel=0.2)  # unchanged far from the indenter


def test_written_mesh_has_physical_names(screening: BendingTest, tmp_path: Path) -> None:
    path = tmp_path / "stalk.msh"
    write_tube(screening, path)
    gmsh.initialize(interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.open(str(path))
        groups = {gmsh.model.getPhysicalName(*group) for group in gmsh.model.getPhysicalGroups()}
        nodes = len(gmsh.model.mesh.getNodes()[0])
    finally:
        gmsh.finalize()
    assert groups == {"xylem", "phloem", "outer", "inner", "ends", "symmetry_x", "symmetry_z"}
    built = build_tube(screening, MPI.COMM_SELF)
    assert nodes == built.mesh.geometry.x.shape[0]


def test_callers_gmsh_session_is_left_alone(screening: BendingTest) -> None:
    gmsh.initialize(interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.model.add("mine")
        build_tube(screening, MPI.COMM_SELF)
        assert gmsh.isInitialized()
        assert "mine" in gmsh.model.list()
    finally:
        gmsh.finalize()

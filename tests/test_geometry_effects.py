"""Effects on the geometry: second moments of the mesh and bending forces, in closed form."""

from __future__ import annotations

import math

import numpy as np
import pytest
import ufl
from dolfinx import fem
from mpi4py import MPI
from slender import SPAN, force, slender, with_

import ramiefenics as rf
from ramiefenics.effects.combining import exclusions
from ramiefenics.model.tube import SURFACES, build_tube

OUTER, INNER = 8.0, 4.0


def tube(*changes: str) -> rf.BendingTest:
    """Return a thick-walled tube, which hardly flattens."""
    fixture = rf.Fixture(span_mm=SPAN, friction=rf.Friction(0.0, 0.0))
    elements = ("numerics.mesh.wall_elements=1", "numerics.mesh.rind_elements=1")
    return slender(INNER, OUTER, fixture, *elements, *changes)


@pytest.fixture(scope="module")
def force_N() -> float:
    """Force on the tube without any error."""
    return force(tube())


def ring(outer: float, inner: float) -> float:
    return math.pi / 64 * (outer**4 - inner**4)


def eccentric(offset: float) -> float:
    """Return the second moment about the centroid, which is off the axis (parallel axes)."""
    void, area = math.pi / 4 * INNER**2, math.pi / 4 * (OUTER**2 - INNER**2)
    centroid = -void * offset / area
    return ring(OUTER, INNER) - void * offset**2 - area * centroid**2


def oval(amplitude: float) -> float:
    return ring(OUTER, INNER) * (1 + amplitude / 2) * (1 - amplitude / 2) ** 3


CASES = [
    ("ovality", 0.2, oval(0.2)),
    ("ovality", -0.2, oval(-0.2)),
    ("wall_thickness_error", 0.5, ring(OUTER, INNER - 1.0)),
    ("wall_thickness_error", -0.5, ring(OUTER, INNER + 1.0)),
    ("eccentric_void", 1.2, eccentric(1.2)),
]


@pytest.mark.parametrize(("name", "amplitude", "second_mm4"), CASES)
def test_meshes_have_the_sections_second_moment(
    name: str, amplitude: float, second_mm4: float
) -> None:
    test = with_(tube("numerics.mesh.angular_elements=8"), **{name: amplitude})
    mesh = build_tube(test, MPI.COMM_SELF).mesh
    y = ufl.SpatialCoordinate(mesh)[1]
    dx = ufl.dx(domain=mesh)
    area, first, second = (
        fem.assemble_scalar(fem.form(value * dx)) for value in (fem.Constant(mesh, 1.0), y, y**2)
    )
    # a quarter of a stalk of 240 mm; quadratic arcs of 22.5 degrees, where the wall changes
    assert (second - first**2 / area) / 60.0 == pytest.approx(second_mm4, rel=2e-3)


@pytest.mark.parametrize(("name", "amplitude", "second_mm4"), [CASES[0], CASES[2], CASES[4]])
def test_forces_follow_the_second_moment(
    force_N: float, name: str, amplitude: float, second_mm4: float
) -> None:
    """Shear takes 0.5 % and contact about 1 % of a beam 25 times as long as high, in both cases."""
    changed = force(with_(tube(), **{name: amplitude}))
    assert changed / force_N == pytest.approx(second_mm4 / ring(OUTER, INNER), rel=0.01)


def test_an_eccentric_void_keeps_the_outer_surface_and_its_own_size() -> None:
    built = build_tube(with_(tube(), eccentric_void=1.2), MPI.COMM_SELF)
    x, facets = built.mesh.geometry.x, built.facets
    for name, radius, centre in (("outer", OUTER / 2, 0.0), ("inner", INNER / 2, 1.2)):
        found = facets.find(SURFACES[name])
        nodes = fem.functionspace(built.mesh, ("Lagrange", 1))
        at = nodes.tabulate_dof_coordinates()[fem.locate_dofs_topological(nodes, 2, found)]
        distance = ((at[:, 0] ** 2) + (at[:, 1] - centre) ** 2) ** 0.5
        assert distance == pytest.approx([radius] * len(at), rel=1e-9)
    assert x[:, 2].max() == pytest.approx(120.0)


def test_a_void_that_leaves_its_layer_is_refused() -> None:
    cases = [
        (tube(), "eccentric_void", 2.0, r"void_offset_mm = 2\.0 must be at most 1\.8 mm"),
        (tube("stalk.void_diameter_mm=2"), "wall_thickness_error", 1.0, "must be above 2 mm"),
        (tube("stalk.void_diameter_mm=0"), "wall_thickness_error", 1.0, "must be above 0 mm for"),
        (tube("stalk.void_diameter_mm=0"), "eccentric_void", 1.0, "there is no void to move"),
    ]
    for test, name, amplitude, message in cases:
        with pytest.raises(rf.SpecificationError, match=message):
            with_(test, **{name: amplitude})


def test_there_is_no_wall_nor_void_where_pith_is(screening: rf.BendingTest) -> None:
    names = ("pith_core", "ovality", "wall_thickness_error", "eccentric_void", "node", "taper")
    refused = exclusions(screening, {name: rf.EFFECTS[name] for name in names})
    assert set(refused) == {
        ("pith_core", "wall_thickness_error"),
        ("pith_core", "eccentric_void"),
        ("eccentric_void", "pith_core"),
        ("pith_core", "node"),
        ("node", "pith_core"),
    }


def volume(test: rf.BendingTest, tag: int) -> float:
    """Return the volume of the cells with a tag, mm3, in the modelled part of the stalk."""
    built = build_tube(test, MPI.COMM_SELF)
    dx = ufl.Measure("dx", built.mesh, subdomain_data=built.cells)
    return float(fem.assemble_scalar(fem.form(fem.Constant(built.mesh, 1.0) * dx(tag))))


@pytest.mark.parametrize(("at_mm", "share"), [(0.0, 0.25), (37.0, 0.5)])
def test_a_node_closes_the_void_where_it_is(at_mm: float, share: float) -> None:
    noded = with_(tube(f"stalk.node_at_mm={at_mm}"), node=3.0)
    assert noded.numerics.domain == ("quarter" if at_mm == 0.0 else "half")
    # quadratic arcs of 45 degrees have an error of 1e-3 of a circle
    assert volume(noded, 2) == pytest.approx(share * math.pi / 4 * INNER**2 * 3.0, rel=2e-3)
    assert volume(noded, 1) == pytest.approx(volume(tube(), 1) * 4 * share, rel=1e-6)
    built = build_tube(noded, MPI.COMM_SELF)
    inside = np.hypot(*built.mesh.geometry.x[:, :2].T) < 0.99 * INNER / 2
    assert np.abs(built.mesh.geometry.x[inside, 2] - at_mm).max() == pytest.approx(1.5)
    ds = ufl.Measure("ds", built.mesh, subdomain_data=built.facets)
    one = fem.Constant(built.mesh, 1.0)
    bore, ends = (
        fem.assemble_scalar(fem.form(one * ds(SURFACES[name]))) for name in ("inner", "ends")
    )
    # in a whole stalk the bore includes two faces of the node, and there are two ends
    faces, wall = 2 * math.pi / 4 * INNER**2, math.pi * INNER * (240.0 - 3.0)
    assert bore == pytest.approx(share * (faces + wall), rel=2e-3)
    assert ends == pytest.approx(share * 2 * math.pi / 4 * (OUTER**2 - INNER**2), rel=2e-3)


def test_a_node_as_long_as_the_stalk_is_a_core(force_N: float) -> None:
    """A node of 210 mm fills all that is bent, as nothing beyond the supports bears load.

    In a stalk of one isotropic material it makes the tube a rod, whose second moment is known.
    """
    filled = force(with_(tube("stalk.node_thickness_mm=190"), node=20.0))
    # shear and contact take different shares in rod and tube, of 1 % each
    assert filled / force_N == pytest.approx(ring(OUTER, 0.0) / ring(OUTER, INNER), rel=0.02)


@pytest.mark.slow
def test_a_node_beside_the_supports_bears_nothing() -> None:
    friction = ("fixture.friction.static=0.1", "fixture.friction.dynamic=0.1")  # prevents sliding
    beside = with_(tube(*friction, "stalk.node_at_mm=114"), node=3.0)
    # the section is meshed differently around a core
    assert force(beside) == pytest.approx(force(tube(*friction)), rel=2e-3)


def test_a_node_under_the_indenter_holds_the_section_up(coarse: rf.BendingTest) -> None:
    short = rf.override(coarse, ["protocol.travel_mm=1", "numerics.acoustic_check=false"])
    results = [rf.simulate(test, MPI.COMM_SELF) for test in (short, with_(short, node=4.0))]
    plain, noded = (result.curve.iloc[-1] for result in results)
    assert noded["force_N"] > 1.02 * plain["force_N"]
    # a section that flattens widens
    gained = [row["section_width_mm"] - 14.23 for row in (plain, noded)]
    assert gained[1] < 0.5 * gained[0]
    assert math.isnan(noded["void_height_mm"])


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ("node_at_mm=119", r"node_at_mm = 119\.0 must be within 118\.5 mm of midspan"),
        ("node_at_mm=10", "must be half or full for a stalk with a node off midspan"),
        ("void_diameter_mm=0", r"node_thickness_mm = 3\.0 must be 0 for a solid core"),
    ],
)
def test_impossible_nodes_are_told(change: str, message: str) -> None:
    with pytest.raises(rf.SpecificationError, match=message):
        rf.override(tube("stalk.node_thickness_mm=3"), [f"stalk.{change}"])

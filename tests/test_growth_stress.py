"""Growth stress: axial stress in tubes, strips cut out of them, and bending."""

from __future__ import annotations

import numpy as np
import pytest
import ufl
from dolfinx import fem
from mpi4py import MPI
from scipy.optimize import brentq
from slender import SPAN, YOUNG, force, slender, with_

import ramiefenics as rf
from ramiefenics.model.bending import BendingProblem
from ramiefenics.model.jit import compile_expression, compile_form
from ramiefenics.model.solid import Solid
from ramiefenics.model.tissue import tissue_fields
from ramiefenics.model.tube import SURFACES, TubeMesh, build_tube
from ramiefenics.solve.rest import come_to_rest
from ramiefenics.verification.block import BoundaryValueProblem, block, layers, second_order
from ramiefenics.verification.point import Point

INNER, OUTER, STRAIN = 4.0, 8.0, 0.002
ELASTIC = rf.Elastic(20.0, 300.0, 0.3, 0.03, 30.0)
MEAN_RADIUS = 2 / 3 * (OUTER**3 - INNER**3) / (OUTER**2 - INNER**2) / 2


def tube(*changes: str) -> rf.BendingTest:
    """Return a thick-walled tube, which hardly flattens."""
    fixture = rf.Fixture(span_mm=SPAN, friction=rf.Friction(0.0, 0.0))
    elements = ("numerics.mesh.wall_elements=1", "numerics.mesh.rind_elements=1")
    return slender(INNER, OUTER, fixture, *elements, *changes)


@pytest.fixture(scope="module")
def rested() -> Solid:
    """Half the length of a tube of fibres that has come to rest."""
    around = ("numerics.mesh.angular_elements=8", "numerics.mesh.side_growth=1")
    test = with_(tube(*around), growth_stress=STRAIN)
    built = build_tube(test, MPI.COMM_SELF)
    test = rf.override(test, [f"stalk.layers.wall.material.elastic.{k}={v}" for k, v in CONSTANTS])
    fields = tissue_fields(test.stalk, built)
    solid = Solid(built.mesh, built.cells, test.stalk.materials, "svk", True, fields)
    planes = (("symmetry_x", 0), ("symmetry_z", 2))
    bcs = [solid.symmetry(built.facets.find(SURFACES[name]), axis) for name, axis in planes]
    BoundaryValueProblem(solid, bcs).solve(1e-9)
    return solid


CONSTANTS = [
    (name, getattr(ELASTIC, name)) for name in ("nu_XZ", "E_X_MPa", "E_Z_MPa", "nu_XY", "G_XZ_MPa")
]


def test_fibres_are_in_tension_outside_and_in_balance(rested: Solid) -> None:
    """Far from the ends nothing moves, and the stress is E times the given strain."""
    points = np.array([[0.5, 0.5, 0.5]])
    cells = np.arange(rested.mesh.topology.index_map(3).size_local, dtype=np.int32)
    x = ufl.SpatialCoordinate(rested.mesh)
    stated = ufl.as_vector((*x, *(rested.stress(rested.displacement)[i, i] for i in range(3))))
    values = compile_expression(stated, points).eval(rested.mesh, cells).reshape(-1, 6)
    values = values[values[:, 2] < 60.0]
    radius = np.hypot(values[:, 0], values[:, 1])
    expected = ELASTIC.E_Z_MPa * STRAIN * (radius - MEAN_RADIUS) / (OUTER / 2 - MEAN_RADIUS)
    largest = ELASTIC.E_Z_MPa * STRAIN
    assert values[:, 5] == pytest.approx(expected, abs=0.01 * largest)  # strains of 0.003 are small
    assert np.abs(values[:, 3:5]).max() < 0.01 * largest
    dx = ufl.dx(rested.mesh, metadata={"quadrature_degree": 4})
    middle = ufl.conditional(ufl.lt(x[2], 60.0), 1.0, 0.0)
    axial = rested.stress(rested.displacement)[2, 2] * middle
    resultant = fem.assemble_scalar(compile_form(axial * dx))
    size = fem.assemble_scalar(compile_form(abs(axial) * dx))
    assert abs(resultant) < 1e-3 * size


def test_a_strip_cut_out_bends_outwards_until_it_is_free_of_stress() -> None:
    """The strain is linear in the radius, so its release is a curvature of this slope."""
    test = with_(tube(), growth_stress=STRAIN)
    across, along = np.linspace(INNER / 2, OUTER / 2, 3), np.linspace(0.0, 20.0, 6)
    mesh = second_order(block(np.array([-0.1, 0.1]), across, along))
    tags = layers(mesh)
    strip = TubeMesh(mesh, tags, tags)
    stalk = test.stalk
    solid = Solid(mesh, tags, stalk.materials, "isotropic", local=tissue_fields(stalk, strip))
    BoundaryValueProblem(solid, []).solve(1e-10)
    y, dx = ufl.SpatialCoordinate(mesh)[1] - 3.0, ufl.dx(mesh)
    fibres = solid.fibres(solid.gradient(solid.displacement))
    stretch = ufl.sqrt(ufl.dot(fibres, fibres)) - 1
    bend, second = (fem.assemble_scalar(compile_form(f * y * dx)) for f in (stretch, y))
    released = -STRAIN / (OUTER / 2 - MEAN_RADIUS)
    assert bend / second == pytest.approx(released, rel=5e-3)  # strains of 0.003 are small
    density = YOUNG * STRAIN**2 / 2  # energy density at the surface
    assert solid.energies()[0] < 1e-3 * density * 0.2 * 2.0 * 20.0


@pytest.mark.slow
def test_it_does_not_change_a_linear_stalk() -> None:
    grown = force(with_(tube(), growth_stress=STRAIN))
    assert grown == pytest.approx(force(tube()), rel=2e-3)  # strains of 0.002


def test_cylinders_just_touch_the_stalk_at_rest(coarse: rf.BendingTest) -> None:
    test = with_(rf.override(coarse, ["numerics.domain=half"]), growth_stress=0.004)
    problem = BendingProblem(test, MPI.COMM_SELF)
    fronts = [obstacle.front_mm for obstacle in problem.contact.obstacles]
    come_to_rest(problem)
    assert np.linalg.norm(problem.displacement.x.array) > 0.0
    sums = problem.contact.sums()
    assert [s.force_y_N for s in sums] == [0.0] * 3
    moved = [o.front_mm - f for o, f in zip(problem.contact.obstacles, fronts, strict=True)]
    assert 0.0 < np.abs(moved).max() < 0.1


@pytest.mark.slow
@pytest.mark.parametrize("strain", [STRAIN, -STRAIN])
def test_fibres_give_way_later_or_earlier_as_the_bent_section_has_it(strain: float) -> None:
    """The ratio to the force without growth stress is that of a beam whose fibres saturate."""
    changes = [f"stalk.layers.wall.material.elastic.{k}={v}" for k, v in CONSTANTS]
    changes += ["stalk.layers.wall.material.large_strain.fibre_strength=0.02"]
    changes += ["law=saturating_fibre", f"protocol.travel_mm={TRAVEL}"]
    test = rf.override(tube(), changes)
    found = force(with_(test, growth_stress=strain)) / force(test)
    beam = [beam_force(test.stalk.layers[0].material, given) for given in (strain, 0.0)]
    assert (beam[0] / beam[1] - 1.0) * strain > 0.0
    assert found == pytest.approx(beam[0] / beam[1], rel=0.01)


TRAVEL = 5.0


def beam_force(material: rf.Material, strain: float) -> float:
    """Return the force on a slender beam of fibres at the travel, from their uniaxial curve."""
    point, strains = Point("saturating_fibre", material), np.linspace(-0.03, 0.03, 241)
    pulled = [point.free_sides({(2, 2): 1.0 + e}) for e in strains]
    stresses = [point.stress(F)[2, 2] for F in pulled]
    radius = np.linspace(INNER / 2, OUTER / 2, 21)
    radius = (radius[1:] + radius[:-1]) / 2.0
    angle = (np.arange(48) + 0.5) / 48 * 2 * np.pi
    r, a = (grid.ravel() for grid in np.meshgrid(radius, angle))
    area, y = r * (OUTER - INNER) / 2 / 20 * 2 * np.pi / 48, r * np.sin(a)
    grown = strain * (r - MEAN_RADIUS) / (OUTER / 2 - MEAN_RADIUS)

    def moment(curvature: float) -> float:
        def axial(mean: float) -> float:
            return float(area @ np.interp(grown + mean + curvature * y, strains, stresses))

        mean = brentq(axial, -0.01, 0.01)
        return float((area * y) @ np.interp(grown + mean + curvature * y, strains, stresses))

    curvatures = np.linspace(0.0, 0.004, 41)
    moments = np.array([moment(k) for k in curvatures])
    at = np.linspace(0.0, SPAN / 2, 401)  # from a support

    def deflection(load: float) -> float:
        return float(np.trapezoid(np.interp(load / 2 * at, moments, curvatures) * at, at))

    return float(brentq(lambda load: deflection(load) - TRAVEL, 0.0, 2 * moments[-1] / (SPAN / 2)))

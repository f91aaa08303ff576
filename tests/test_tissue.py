"""Moduli, fibres and strains at rest that vary from point to point, against closed forms."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable

import numpy as np
import pytest
import ufl
from dolfinx import fem
from mpi4py import MPI
from numpy.typing import NDArray
from slender import SPAN, YOUNG, force, slender, with_

import ramiefenics as rf
from ramiefenics.model.jit import compile_form
from ramiefenics.model.laws.base import Expr
from ramiefenics.model.local_law import STIFFNESS
from ramiefenics.model.shape import round_section, stalk_point
from ramiefenics.model.solid import Solid
from ramiefenics.model.tissue import tissue_fields
from ramiefenics.model.tube import SURFACES, TubeMesh, build_tube
from ramiefenics.verification.block import BoundaryValueProblem

Array = NDArray[np.float64]

INNER, OUTER = 4.0, 8.0


def tube(*changes: str) -> rf.BendingTest:
    """Return a thick-walled tube, which hardly flattens."""
    fixture = rf.Fixture(span_mm=SPAN, friction=rf.Friction(0.0, 0.0))
    elements = ("numerics.mesh.wall_elements=1", "numerics.mesh.rind_elements=1")
    return slender(INNER, OUTER, fixture, *elements, *changes)


AMPLITUDE = 0.8


def stiffer_by(amplitude: float) -> float:
    """Return the ratio of EI, the integral of E r^3 with E linear about the mean radius by area."""
    a, b = INNER / 2, OUTER / 2
    r = np.linspace(a, b, 10001)
    mean = 2 / 3 * (b**3 - a**3) / (b**2 - a**2)
    factor = 1 + amplitude * (r - mean) / (b - a)
    assert np.trapezoid(factor * r, r) == pytest.approx(np.trapezoid(r, r))
    return float(np.trapezoid(factor * r**3, r) / np.trapezoid(r**3, r))


def bent_energy(amplitude: float) -> float:
    """Return the energy stored in a tube that is bent into an arc.

    The curvature is so small that only E y^2 matters, and large enough for the sum of squares to
    stand out from rounding.
    """
    round_tube, curvature = tube("numerics.mesh.angular_elements=16"), 1e-6
    test = with_(round_tube, radial_gradient=amplitude)
    built = build_tube(test, MPI.COMM_SELF)
    material = rf.Material(rf.Elastic.isotropic(YOUNG, 0.0))
    fields = tissue_fields(test.stalk, built)
    solid = Solid(built.mesh, built.cells, [material], "isotropic", True, fields)
    solid.displacement.interpolate(
        lambda x: curvature * np.array([0 * x[0], x[2] ** 2 / 2, -x[1] * x[2]])
    )
    return solid.energies()[0]


def test_a_radial_gradient_changes_the_bending_stiffness() -> None:
    expected = stiffer_by(AMPLITUDE) / stiffer_by(-AMPLITUDE)
    # quadratic arcs of 11 degrees
    found = bent_energy(AMPLITUDE) / bent_energy(-AMPLITUDE)
    assert found == pytest.approx(expected, rel=1e-3)


@pytest.mark.slow
def test_a_radial_gradient_changes_the_force_as_the_bending_stiffness() -> None:
    graded = with_(tube(), radial_gradient=AMPLITUDE)
    # quadratic arcs of 45 degrees; shear and contact take 2 % with and without the gradient
    assert force(graded) / force(tube()) == pytest.approx(stiffer_by(AMPLITUDE), rel=4e-3)


SHAPES = (
    {},
    {"section_height_mm": 12.0, "taper": 0.01, "measured_at_mm": 20.0},
    {"void_offset_mm": 1.5},
    {"section_height_mm": 16.0, "void_offset_mm": -1.5, "rotation_deg": 25.0, "taper": 0.01},
    {"curvature_per_m": -3.0, "taper": 0.01},
)


@pytest.mark.parametrize("shape", SHAPES)
def test_a_stalks_points_are_found_on_the_round_tube(shape: dict[str, float]) -> None:
    stalk = dataclasses.replace(rf.ramie(14.23, 7.28, 0.67).stalk, **shape)
    rng = np.random.default_rng(2)
    radius, angle = rng.uniform(3.64, 7.1, 200), rng.uniform(-np.pi, np.pi, 200)
    x, y, z = radius * np.cos(angle), radius * np.sin(angle), rng.uniform(-90, 90, 200)
    points = np.array([stalk_point(stalk, *at) for at in zip(x, y, z, strict=True)])
    assert np.array(round_section(stalk, points)) == pytest.approx(np.array([x, y]), rel=1e-9)


@pytest.mark.parametrize("shape", SHAPES)
def test_a_radial_gradient_keeps_the_mean_of_every_layer(shape: dict[str, float]) -> None:
    test = rf.override(rf.ramie(14.23, 7.28, 0.67), ["numerics.mesh=ladder_q2_1"])
    numerics = dataclasses.replace(test.numerics, domain="full")
    tissue = rf.Tissue(radial_gradient=0.8)
    stalk = dataclasses.replace(test.stalk, **shape, tissue=tissue)
    built = build_tube(dataclasses.replace(test, numerics=numerics, stalk=stalk), MPI.COMM_SELF)
    factor = tissue_fields(stalk, built)[STIFFNESS]
    dx = ufl.Measure("dx", built.mesh, subdomain_data=built.cells)
    for layer in (1, 2):
        one, whole = (
            fem.assemble_scalar(fem.form(f * dx(layer)))
            for f in (fem.Constant(built.mesh, 1.0), factor)
        )
        # quadratic arcs have an error of a few thousandths of the outer layer's thickness
        assert whole / one == pytest.approx(1.0, abs=3e-3)
    low, high = factor.x.array.min(), factor.x.array.max()
    assert low < 0.75
    assert 1.2 < high < 1.4


class Pulled:
    """A thin tube of helical fibres, free except for a small axial stress on its ends."""

    ELASTIC = rf.Elastic(60.0, 300.0, 0.3, 0.05, 40.0)
    ANGLE = math.radians(20.0)
    MIDDLE = 3.9

    def __init__(self, stress: Callable[[Expr], Expr]) -> None:
        fixture = rf.Fixture(span_mm=SPAN)
        coarse = ("numerics.mesh.contact_size=0.09", "numerics.mesh.coarse_size=0.09")
        test = slender(2 * self.MIDDLE - 0.2, 2 * self.MIDDLE + 0.2, fixture, *coarse)
        around = ("numerics.mesh.angular_elements=8", "numerics.mesh.side_growth=1")
        short = ("fixture.span_mm=60", "stalk.length_mm=80")
        test = with_(rf.override(test, [*around, *short]), fibre_angle=math.degrees(self.ANGLE))
        self.tube: TubeMesh = build_tube(test, MPI.COMM_SELF)
        fields = tissue_fields(test.stalk, self.tube)
        material = rf.Material(self.ELASTIC)
        self.solid = Solid(self.tube.mesh, self.tube.cells, [material], "svk", True, fields)
        x = ufl.SpatialCoordinate(self.tube.mesh)
        ends = ufl.Measure("ds", self.tube.mesh, subdomain_data=self.tube.facets)(SURFACES["ends"])
        outwards = ufl.sign(x[2])
        problem = BoundaryValueProblem(
            self.solid, [], lambda v: -outwards * stress(x) * v[2] * ends
        )
        problem.solve(1e-9)

    def slope(self, share: Callable[[Expr, Expr], Expr]) -> float:
        """Return a mean, over the middle of the stalk, linear in the displacement gradient."""
        mesh = self.tube.mesh
        x, u = ufl.SpatialCoordinate(mesh), self.solid.displacement
        middle = ufl.conditional(ufl.lt(abs(x[2]), 20.0), 1.0, 0.0)
        parts = (share(x, ufl.grad(u)) * middle, middle)
        dx = ufl.dx(mesh, metadata={"quadrature_degree": 4})
        whole, volume = (fem.assemble_scalar(compile_form(part * dx)) for part in parts)
        return float(whole / volume)

    @classmethod
    def compliances(cls) -> tuple[float, float]:
        """Return axial strain and axial-hoop shear per axial stress (Lekhnitskii 1963)."""
        e, c, s = cls.ELASTIC, math.cos(cls.ANGLE), math.sin(cls.ANGLE)
        along, across, cross = 1 / e.E_Z_MPa, 1 / e.E_X_MPa, -e.nu_XZ / e.E_X_MPa
        mixed = 2 * cross + 1 / e.G_XZ_MPa
        stretch = along * c**4 + mixed * c**2 * s**2 + across * s**4
        shear = (2 * along - mixed) * c**3 * s - (2 * across - mixed) * c * s**3
        return stretch, shear


def test_helical_fibres_stretch_and_twist_as_the_rotated_compliance_has_it() -> None:
    """Every piece of a thin wall is under axial stress alone, as the tube is free to twist."""
    stress = 1e-3
    pulled = Pulled(lambda _x: stress)
    stretch, shear = Pulled.compliances()
    # half the wall is 1/39 of the radius; pieces at different radii share one twist
    assert pulled.slope(lambda _x, H: H[2, 2]) == pytest.approx(stress * stretch, rel=2e-3)
    around = pulled.slope(lambda x, H: (x[0] * H[1, 2] - x[1] * H[0, 2]) / Pulled.MIDDLE)
    assert around == pytest.approx(stress * shear, rel=2e-3)
    assert around < 0  # the helical fibres straighten


def test_helical_fibres_bend_as_the_rotated_compliance_has_it() -> None:
    stress, R = 1e-3, Pulled.MIDDLE
    bent = Pulled(lambda x: stress * x[1] / R)
    stretch, _ = Pulled.compliances()
    # y H_zz has the mean stress stretch R / 2 where H_zz is linear in y
    found = bent.slope(lambda x, H: x[1] * H[2, 2])
    assert found == pytest.approx(stress * stretch * R / 2, rel=2e-3)


@pytest.mark.slow
def test_forces_differentiate_by_what_differs_from_point_to_point(coarse: rf.BendingTest) -> None:
    short = ["protocol.travel_mm=1", "protocol.save_every_mm=1", "numerics.acoustic_check=false"]
    test = rf.override(coarse, short)
    typical = {"radial_gradient": 0.4, "curved_stalk": 0.8, "growth_stress": 0.002}
    typical["fibre_angle"] = 5.0

    def parameter(name: str) -> rf.Parameter:
        return rf.Parameter(lambda given, a: with_(given, **{name: a}), typical[name])

    found = rf.sensitivities(test, {name: parameter(name) for name in typical}, MPI.COMM_SELF)
    assert found.by_differences == ("fibre_angle",)  # which needs the full model
    last = found.curve.iloc[-1]
    for name, amount in typical.items():
        low, high = (force(with_(test, **{name: a * amount})) for a in (-0.1, 0.1))
        slope = (high - low) / (0.2 * amount)
        # steps of the simulations differ; a mirror image has the same force
        assert last[name] * amount == pytest.approx(slope * amount, abs=0.01 * last["force_N"])

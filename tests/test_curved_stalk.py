"""A bowed stalk: its contacts, its fibre directions, and the stiffness of an arch on rollers."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
import ufl
from dolfinx import fem
from mpi4py import MPI
from slender import SPAN, force, slender, with_

import ramiefenics as rf
from ramiefenics.model.local_law import FIBRE_X, FIBRE_Y
from ramiefenics.model.tissue import tissue_fields
from ramiefenics.model.tube import build_tube

RADIUS, OUTER = 5.0, 8.0
ELEMENTS = ("numerics.mesh.wall_elements=1", "numerics.mesh.rind_elements=1")


def rod(curvature: float, *changes: str) -> rf.BendingTest:
    fixture = rf.Fixture(SPAN, RADIUS, RADIUS, rf.Friction(0.0, 0.0))
    test = slender(4.0, OUTER, fixture, *ELEMENTS, *changes)
    return with_(test, curved_stalk=curvature)


@pytest.mark.parametrize("curvature", [-2.0, 1.0, 3.0])
def test_every_cylinder_touches_at_the_start(curvature: float) -> None:
    """Sections of the mesh are 0.05 of 72 mm apart at the supports, with arcs in between."""
    test = rod(curvature, "numerics.mesh.contact_size=0.005")
    mesh = build_tube(test, MPI.COMM_SELF).mesh
    at = mesh.geometry.x[np.abs(mesh.geometry.x[:, 0]) < 1e-9]
    for cylinder in (test.fixture.indenter, test.fixture.support):
        axis = test.front_mm(cylinder) + cylinder.up * cylinder.radius_mm
        distance = np.hypot(at[:, 1] - axis, at[:, 2] - cylinder.z_mm) - RADIUS
        # nodes are 0.18 mm apart: the gap at the nearest is up to 0.09^2 / 2 / 5
        assert distance.min() == pytest.approx(5e-4, abs=6e-4)


def test_the_axis_keeps_its_length_and_fibres_follow_it() -> None:
    test = rod(3.0)
    built = build_tube(test, MPI.COMM_SELF)
    volumes = []
    for mesh in (built.mesh, build_tube(rod(0.0), MPI.COMM_SELF).mesh):
        one = fem.Constant(mesh, 1.0)
        volumes.append(fem.assemble_scalar(fem.form(one * ufl.dx(mesh))))
    assert volumes[0] == pytest.approx(volumes[1], rel=1e-6)  # Pappus
    fields = tissue_fields(test.stalk, built)
    at = fields[FIBRE_Y].function_space.tabulate_dof_coordinates()
    assert np.abs(fields[FIBRE_X].x.array).max() == 0.0
    y, z = fields[FIBRE_Y].x.array, np.sqrt(1 - fields[FIBRE_Y].x.array ** 2)
    # at right angles to the line from the centre of the arc
    radial = np.column_stack([at[:, 1] + 1000.0 / 3.0, at[:, 2]])
    cosine = (radial[:, 0] * y + radial[:, 1] * z) / np.hypot(*radial.T)
    assert np.abs(cosine).max() < 1e-12


@pytest.mark.slow
def test_an_arch_on_rollers_is_as_stiff_as_a_beam_of_its_span() -> None:
    """The slope k L / 2 at the supports moves the contacts outwards by R + r times this slope.

    To first order in k nothing else changes: a flat arch that is free to spread bears a load by
    bending alone (Timoshenko and Gere 1961, section 7.2), and its rise enters squared. Terms even
    in k cancel.
    """
    up, down = (force(rod(k, "numerics.mesh.angular_elements=8")) for k in (1.0, -1.0))
    middle = (up + down) / 2.0
    expected = -3.0 * (RADIUS + OUTER / 2.0) * 1e-3
    # at 1 mm of travel, which has itself moved the contacts a little
    assert (up - down) / (2.0 * middle) == pytest.approx(expected, rel=0.05)


def test_bows_that_cannot_be_touched_are_told() -> None:
    with pytest.raises(rf.SpecificationError, match=r"curvature_per_m = 5\.0 must be .* 4\.16667"):
        dataclasses.replace(rod(0.0).stalk, curvature_per_m=5.0)
    plates = rf.Fixture(0.0, float("inf"), float("inf"))
    with pytest.raises(rf.SpecificationError, match=r"curvature_per_m = 1\.0 .* 0 between plates"):
        dataclasses.replace(rod(1.0), fixture=plates)

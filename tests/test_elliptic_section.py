"""Stalks of elliptic section: geometry, and bending compared with a beam."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
import ufl
from dolfinx import fem
from mpi4py import MPI

import ramiefenics as rf
from ramiefenics.model.tube import SURFACES, build_tube

YOUNG, POISSON, SPAN = 300.0, 0.3, 100.0


def solid(width: float, height: float | None) -> rf.BendingTest:
    shear = YOUNG / 2 / (1 + POISSON)
    material = rf.Material(rf.Elastic(YOUNG, YOUNG, POISSON, POISSON, shear), density_g_per_cm3=1.0)
    layers = (rf.Layer("core", width, material),)
    stalk = rf.Stalk(120.0, 0.0, layers, section_height_mm=height)
    # no friction, as in beam theory; at the supports it adds height / span times its coefficient
    fixture = rf.Fixture(span_mm=SPAN, friction=rf.Friction(0.0, 0.0))
    test = rf.BendingTest(stalk, fixture, law="isotropic")
    return rf.override(
        test,
        [
            "numerics.mesh=ladder_q2_1",
            "numerics.acoustic_check=false",
            "protocol.travel_mm=1",
            "protocol.save_every_mm=1",
        ],
    )


def test_mesh_has_the_volume_and_second_moment_of_an_elliptic_tube() -> None:
    test = rf.override(
        rf.ramie(14.23, 7.28, 0.67),
        ["stalk.section_height_mm=10.0", "numerics.mesh=screening", "numerics.mesh.order=2"],
    )
    tube = build_tube(test, MPI.COMM_SELF)
    y = ufl.SpatialCoordinate(tube.mesh)[1]
    found = [
        4 * fem.assemble_scalar(fem.form(value * ufl.dx(domain=tube.mesh)))
        for value in (fem.Constant(tube.mesh, 1.0), y**2)
    ]
    ratio = 7.28 / 14.23
    area = np.pi / 4 * 14.23 * 10.0 * (1 - ratio**2)
    second = np.pi / 64 * 14.23 * 10.0**3 * (1 - ratio**4)
    # quadratic arcs of 22.5 degrees have an error of 1e-4 of the section
    assert found == pytest.approx([180 * area, 180 * second], rel=1e-3)
    outer = tube.mesh.geometry.x[np.abs(tube.mesh.geometry.x[:, 0]) < 1e-9, 1]
    assert outer.max() == pytest.approx(5.0)
    assert len(tube.facets.find(SURFACES["inner"])) > 0


@pytest.mark.parametrize(("width", "height"), [(8.0, 6.0), (6.0, 8.0)])
def test_slender_ellipse_bends_as_timoshenkos_beam(width: float, height: float) -> None:
    force = float(rf.simulate(solid(width, height)).curve["force_N"].iloc[-1])
    second, area = np.pi / 64 * width * height**3, np.pi / 4 * width * height
    shear = YOUNG / 2 / (1 + POISSON) * area * 6 * (1 + POISSON) / (7 + 6 * POISSON)
    expected = 1 / (SPAN**3 / (48 * YOUNG * second) + SPAN / (4 * shear))
    # contact indents by about 1 % of the travel; lying and upright differ by a factor of 1.78
    assert force == pytest.approx(expected, rel=0.025)
    assert force < expected


def test_an_ellipse_as_high_as_wide_is_a_circle() -> None:
    forces = [rf.simulate(solid(8.0, h)).curve["force_N"].iloc[-1] for h in (None, 8.0)]
    assert forces[1] == pytest.approx(forces[0], rel=1e-6)


def test_section_height_survives_a_file_and_is_checked(tmp_path) -> None:
    test = solid(8.0, 6.0)
    rf.write_test(test, tmp_path / "ellipse.toml")
    assert rf.read_test(tmp_path / "ellipse.toml") == test
    assert test.stalk.height_mm == 6.0
    assert dataclasses.replace(test.stalk, section_height_mm=None).height_mm == 8.0
    with pytest.raises(rf.SpecificationError, match=r"section_height_mm = -1 must be.*above 0 mm"):
        rf.override(test, ["stalk.section_height_mm=-1"])

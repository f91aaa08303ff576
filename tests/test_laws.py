"""Elastic laws: linearisation, objectivity, behaviour under large compression."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import brentq

from ramiefenics import Elastic, LargeStrain, Material
from ramiefenics.model.laws import LAWS
from ramiefenics.published.stalks import PHLOEM, XYLEM
from ramiefenics.verification.point import Point

VOIGT = [(0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1)]


ELASTIC = {name for name, law in LAWS.items() if law.memory is None}
"""Laws without memory; those with memory are tested in `test_material_memory`."""


@pytest.fixture(scope="module", params=sorted(ELASTIC - {"isotropic"}))
def law(request: pytest.FixtureRequest) -> str:
    return str(request.param)


@pytest.fixture(scope="module")
def point(law: str) -> Point:
    return Point(law, PHLOEM)


@pytest.mark.filterwarnings("ignore:G_XY_MPa")
@pytest.mark.parametrize("in_plane_shear", [None, 3.09])
@pytest.mark.parametrize("base", [XYLEM, PHLOEM])
def test_linearisation_is_the_stiffness(
    law: str, base: Material, in_plane_shear: float | None
) -> None:
    elastic = dataclasses.replace(base.elastic, G_XY_MPa=in_plane_shear)
    point = Point(law, dataclasses.replace(base, elastic=elastic))
    tangent = point.tangent(np.eye(3))
    voigt = np.array([[tangent[i + j] for j in VOIGT] for i in VOIGT])
    stiffness = elastic.stiffness()
    # both are differentiated exactly, up to rounding relative to the largest entry
    assert np.abs(voigt - stiffness).max() < 1e-10 * stiffness.max()
    assert np.abs(point.stress(np.eye(3))).max() < 1e-10 * stiffness.max()
    assert point.energy(np.eye(3)) == pytest.approx(0.0, abs=1e-12)


def _deformed(seed: int) -> NDArray[np.float64]:
    return np.eye(3) + 0.15 * np.random.default_rng(seed).standard_normal((3, 3))


@pytest.mark.parametrize("seed", range(4))
def test_energy_does_not_feel_rotation(point: Point, seed: int) -> None:
    F = _deformed(seed)
    rotation, _ = np.linalg.qr(_deformed(seed + 100))
    rotation *= np.sign(np.linalg.det(rotation))
    assert point.energy(rotation @ F) == pytest.approx(point.energy(F), rel=1e-12)


@pytest.mark.parametrize("name", sorted(name for name, law in LAWS.items() if law.homogeneous))
def test_a_law_that_says_so_scales_with_the_moduli(name: str) -> None:
    """Specimens differ by a factor on all moduli; the other constants stay as given."""
    rubber = dataclasses.replace(PHLOEM, elastic=Elastic.isotropic(5.0, 0.3))
    material = rubber if name == "isotropic" else PHLOEM
    plain, stiff = Point(name, material), Point(name, material.scaled(3.0))
    for seed in range(3):
        F = _deformed(seed)
        assert stiff.energy(F) == pytest.approx(3.0 * plain.energy(F), rel=1e-12)


@pytest.mark.parametrize("seed", range(4))
def test_energy_does_not_feel_a_turn_about_the_fibre(point: Point, seed: int) -> None:
    F, angle = _deformed(seed), 0.7
    c, s = np.cos(angle), np.sin(angle)
    about_z = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    assert point.energy(F @ about_z) == pytest.approx(point.energy(F), rel=1e-10)


@pytest.mark.parametrize("seed", range(3))
def test_stress_and_tangent_are_derivatives(point: Point, seed: int) -> None:
    F, direction, step = _deformed(seed), _deformed(seed + 50), 1e-5
    energy = (point.energy(F + step * direction) - point.energy(F - step * direction)) / 2 / step
    assert energy == pytest.approx(np.sum(point.stress(F) * direction), rel=1e-6)
    stress = (point.stress(F + step * direction) - point.stress(F - step * direction)) / 2 / step
    exact = np.einsum("ijkl,kl", point.tangent(F), direction)
    assert stress == pytest.approx(exact, rel=1e-5, abs=1e-5 * np.abs(exact).max())


def test_svk_gives_way_at_stretch_one_over_root_three() -> None:
    """In uniaxial strain P = C11 (lambda^3 - lambda) / 2 has its extremum there."""
    point = Point("svk", XYLEM)
    stretch = np.linspace(0.4, 0.95, 551)
    stress = [point.stress(np.diag([s, 1.0, 1.0]))[0, 0] for s in stretch]
    assert stretch[int(np.argmin(stress))] == pytest.approx(1 / np.sqrt(3), abs=1e-3)
    exact = XYLEM.elastic.stiffness()[0, 0] * (0.6**3 - 0.6) / 2
    assert point.stress(np.diag([0.6, 1.0, 1.0]))[0, 0] == pytest.approx(exact)


@pytest.mark.parametrize("law", ["neo_hookean", "saturating_fibre"])
def test_crushed_layer_stiffens(law: str) -> None:
    point = Point(law, PHLOEM)
    stretch = np.linspace(0.1, 1.0, 91)
    stress = np.array([point.stress(np.diag([1.0, s, 1.0]))[1, 1] for s in stretch])
    assert np.all(np.diff(stress) > 0)


def test_fibre_stress_saturates_in_compression_only() -> None:
    """w(e) = h e - s_c tanh((k - h) |e| / s_c) for e < 0, linear for e >= 0 (r = 0 without nu)."""
    elastic = Elastic(E_X_MPa=2.0, E_Z_MPa=2000.0, nu_XY=0.0, nu_XZ=0.0, G_XZ_MPa=30.0)
    large_strain = LargeStrain(fibre_strength=0.2, fibre_residual_tangent=0.5, densification=0.0)
    point = Point("saturating_fibre", Material(elastic, large_strain))

    def axial(stretch: float) -> float:
        """Subtract the matrix, mu (lambda - 1 / lambda) with mu = E_X / 2 and lambda_Lame = 0."""
        stress = point.stress(np.diag([1.0, 1.0, stretch]))[2, 2]
        return float(stress - elastic.E_X_MPa / 2 * (stretch - 1 / stretch))

    k = elastic.E_Z_MPa - elastic.E_X_MPa
    assert axial(1.05) == pytest.approx(k * 0.05, rel=1e-9)
    plateau = -0.2 * 30.0 - 0.5 * 30.0 * 0.05
    assert axial(0.95) == pytest.approx(plateau, rel=1e-6)


def test_axial_shear_does_not_weaken_when_crushed() -> None:
    """With lambda_Y = s the quadratic term's shear stiffness falls as s^2, this law's does not.

    This law loses only the geometric part due to the fibre's compressive stress: its strength and a
    little for the residual tangent.
    """
    crushed = np.diag([1.0, 0.5, 1.0])

    def shear(law: str) -> float:
        return float(Point(law, PHLOEM).tangent(crushed)[1, 2, 1, 2])

    rest = PHLOEM.elastic.G_XZ_MPa
    assert shear("neo_hookean") < 0.3 * rest + PHLOEM.elastic.E_X_MPa
    assert shear("saturating_fibre") > (0.99 - PHLOEM.large_strain.fibre_strength) * rest


def test_shear_stress_saturates_beyond_yield() -> None:
    """In shear of the fibres' planes P_YZ is (G - mu) (R g + (1 - R) g_Y) + mu g far beyond g_Y."""
    # densification would add to a strain of 1
    large_strain = dataclasses.replace(PHLOEM.large_strain, densification=0.0)
    elastic = PHLOEM.elastic
    point = Point("saturating_fibre", dataclasses.replace(PHLOEM, large_strain=large_strain))
    mu = elastic.G_XY  # by Eq. 4 the section is isotropic: (C11 - C12) / 2
    gamma = 20.0 * large_strain.shear_yield_strain
    F = np.eye(3)
    F[2, 1] = gamma  # f_2 tilts and the fibre is not stretched: apart from shear only mu acts
    residual = large_strain.shear_residual_tangent
    saturated = residual * gamma + (1 - residual) * large_strain.shear_yield_strain
    expected = (elastic.G_XZ_MPa - mu) * saturated + mu * gamma
    # the square root in the law is within 1 / (2 * 20^2) of its asymptote
    assert point.stress(F)[2, 1] == pytest.approx(expected, rel=2e-3)


def test_densification_adds_its_energy() -> None:
    """It is d/24 (2 mu + lambda) ((ln J)^4 + (I1 - 3 - 2 ln J)^2 / 4); the layer is halved."""
    loose = dataclasses.replace(
        PHLOEM, large_strain=dataclasses.replace(PHLOEM.large_strain, densification=0)
    )
    dense = Point("saturating_fibre", PHLOEM)
    rest = Point("saturating_fibre", loose)
    p = LAWS["saturating_fibre"].parameters(PHLOEM)
    crushed = np.diag([1.0, 0.5, 1.0])
    gain = dense.energy(crushed) - rest.energy(crushed)
    modulus = 2 * p["mu"] + p["lambda"]
    distortion = 0.25 - 1 + 2 * np.log(2.0)
    shape = np.log(2.0) ** 4 + distortion**2 / 4
    assert gain == pytest.approx(PHLOEM.large_strain.densification / 24 * modulus * shape)


def _surface_impedance(law: str, stretch: float) -> float:
    """Return the least eigenvalue of a half-space's surface impedance, over its shear modulus.

    Strain is plane along the fibres, the normal of the free surface is Y, and compression is along
    X. If the eigenvalue is not positive, the surface creases (Stroh's formalism: Barnett and Lothe
    1985).
    """
    point = Point(law, XYLEM)
    free = brentq(lambda y: point.stress(np.diag([stretch, y, 1.0]))[1, 1], 0.5, 4.0)
    tangent = point.tangent(np.diag([stretch, free, 1.0]))[:2, :2, :2, :2]
    Q, R, T = tangent[:, 0, :, 0], tangent[:, 0, :, 1], tangent[:, 1, :, 1]
    inverse = np.linalg.inv(T)
    N = np.block([[-inverse @ R.T, inverse], [R @ inverse @ R.T - Q, -R @ inverse]])
    values, vectors = np.linalg.eig(N)
    decaying = vectors[:, values.imag > 0]
    impedance = -1j * decaying[2:] @ np.linalg.inv(decaying[:2])
    return float(np.linalg.eigvalsh(impedance)[0] / XYLEM.elastic.G_XY)


def test_densification_keeps_a_compressed_surface_from_creasing() -> None:
    """An incompressible neo-Hookean surface creases at a stretch of 0.544 (Biot 1963)."""
    assert _surface_impedance("neo_hookean", 0.6) > 0  # compressible: somewhat later
    assert _surface_impedance("neo_hookean", 0.45) < 0
    assert _surface_impedance("saturating_fibre", 0.42) > 0

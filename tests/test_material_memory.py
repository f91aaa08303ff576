"""Laws with memory at a material point: hysteresis, relaxation, energy, objectivity, tangent."""

from __future__ import annotations

import dataclasses
import itertools

import numpy as np
import pytest
from numpy.typing import NDArray

from ramiefenics import Material
from ramiefenics.model.laws import LAWS
from ramiefenics.model.laws.saint_venant_kirchhoff import SAINT_VENANT_KIRCHHOFF
from ramiefenics.model.laws.viscoelasticity import prony
from ramiefenics.published.stalks import XYLEM
from ramiefenics.verification.point import Point

Array = NDArray[np.float64]

REMEMBERING = sorted(name for name, law in LAWS.items() if law.memory is not None)
SHARES, TIMES = (0.3, 0.2), (2.0, 30.0)
PRONY = {
    f"{name}_{i}{unit}": values[i - 1]
    for name, values, unit in (("relaxing_share", SHARES, ""), ("relaxation_time", TIMES, "_s"))
    for i in (1, 2)
}


def with_constants(**constants: float) -> Material:
    return dataclasses.replace(XYLEM, law_constants=constants)


def remembering(law: str) -> Material:
    """Return a material that dissipates; some laws do so only with constants of their own."""
    if not law.startswith("inelastic"):
        return XYLEM
    damaged = dataclasses.replace(XYLEM.large_strain, fibre_damage=0.5)
    shares = {"yielding_share": 0.5, "crushed_share": 0.5}
    return dataclasses.replace(XYLEM, large_strain=damaged, law_constants=shares)


@pytest.fixture(scope="module", params=REMEMBERING)
def compiled(request: pytest.FixtureRequest) -> Point:
    return Point(request.param, remembering(request.param))


@pytest.fixture
def point(compiled: Point) -> Point:
    """The point at rest, without memory of earlier steps."""
    compiled.forget()
    return compiled


def _path(seed: int, steps: int = 400) -> Array:
    """Return a path that crushes the section, pulls and presses fibres, shears, and returns."""
    rng = np.random.default_rng(seed)
    t = np.linspace(0.0, 1.0, steps + 1)
    crushed, along = np.sin(np.pi * t) ** 2, np.sin(3 * np.pi * t)
    path = np.eye(3) + 0.01 * np.einsum("t,ij->tij", along, rng.standard_normal((3, 3)))
    path[:, 0, 0] -= 0.15 * crushed
    path[:, 2, 2] += 0.06 * along
    return path


def test_at_rest_and_at_once_it_has_the_elastic_constants(point: Point) -> None:
    point.duration_s = 0.0
    tangent, stiffness = point.tangent(np.eye(3)), XYLEM.elastic.stiffness()
    voigt = [(0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1)]
    found = np.array([[tangent[i + j] for j in voigt] for i in voigt])
    assert np.abs(found - stiffness).max() < 1e-8 * stiffness.max()
    assert np.abs(point.stress(np.eye(3))).max() < 1e-8 * stiffness.max()


@pytest.mark.parametrize("seed", range(2))
def test_work_is_stored_or_dissipated_and_dissipation_is_never_negative(
    point: Point, seed: int
) -> None:
    point.duration_s = 0.1
    path = _path(seed)
    work, lost, before = 0.0, [], np.zeros((3, 3))
    for last, F in itertools.pairwise(path):
        stress = point.stress(F)
        work += float(np.sum((before + stress) / 2 * (F - last)))
        lost.append(point.remember(F))
        before = stress
    stored = point.energy(path[-1])
    assert min(lost) >= -1e-12 * sum(lost)
    assert sum(lost) > 0.1 * abs(work)  # otherwise the test would show nothing
    # trapezoidal rule, and a first-order rule for the dissipation of crushing, over 400 steps
    assert stored + sum(lost) == pytest.approx(work, rel=0.01)


def test_a_superposed_rotation_turns_the_stress_and_changes_nothing_else(point: Point) -> None:
    path = _path(5, steps=8)
    point.duration_s = 1.0
    plain = [(point.stress(F), point.remember(F)) for F in path]
    point.forget()
    rng = np.random.default_rng(6)
    for F, (stress, lost) in zip(path, plain, strict=True):
        Q, _ = np.linalg.qr(rng.standard_normal((3, 3)))
        Q *= np.sign(np.linalg.det(Q))
        turned = point.stress(Q @ F)
        assert np.allclose(turned, Q @ stress, rtol=0.0, atol=1e-9 * (1 + np.abs(stress).max()))
        assert point.remember(Q @ F) == pytest.approx(lost, rel=1e-8, abs=1e-12)


def test_newton_converges_quadratically_while_the_state_changes(point: Point) -> None:
    """Newton's method finds the deformation of a given stress with the law's own tangent."""
    F0 = np.diag([0.88, 1.02, 0.93])
    point.duration_s = 5.0
    wanted = point.stress(F0)
    at_rest = point.state(np.eye(3))
    assert any(np.any(value != at_rest[name]) for name, value in point.state(F0).items())
    F = F0 + 1e-3 * np.diag([1.0, -2.0, 0.7])
    errors = []
    for _ in range(4):
        errors.append(np.abs(F - F0).max())
        tangent = point.tangent(F).reshape(9, 9)
        F = F - np.linalg.lstsq(tangent, (point.stress(F) - wanted).ravel())[0].reshape(3, 3)
    # linear convergence would gain the same factor each time; the constant is of order 1 / strain
    assert errors[1] < 100 * errors[0] ** 2
    assert errors[2] < max(100 * errors[1] ** 2, 1e-12)


def fibre_strains(targets: list[float]) -> Array:
    ends = [0.0, *targets]
    return np.concatenate([np.linspace(a, b, 60)[1:] for a, b in itertools.pairwise(ends)])


@pytest.mark.parametrize("kinematic", [1.0, 0.0, 0.5])
def test_yielding_fibres_follow_the_closed_hysteresis(kinematic: float) -> None:
    """Tension and compression at fixed sides give a bilinear loop with known corners."""
    p = LAWS["fibre_plasticity"].parameters_of(XYLEM)
    k, hardening, strength = p["k"], p["hardening"], p["strength"]
    material = with_constants(tensile_yield_strain=strength / k, kinematic_share=kinematic)
    material = dataclasses.replace(
        material, large_strain=dataclasses.replace(material.large_strain, densification=0.0)
    )
    point = Point("fibre_plasticity", material)
    amplitude = 3.0 * strength / k
    corners = [amplitude, -amplitude, amplitude, -amplitude, 0.0]
    lost, found = 0.0, []
    for e in fibre_strains(corners):
        F = np.diag([1.0, 1.0, 1.0 + e])
        stress = point.stress(F)[2, 2]
        lost += point.remember(F)
        if any(np.isclose(e, corner, atol=1e-12) for corner in corners):
            matrix = p["mu"] * (1 + e - 1 / (1 + e)) + p["lambda"] * np.log(1 + e) / (1 + e)
            found.append(stress - matrix)
    back, radius, plastic, expected, dissipated = 0.0, strength, 0.0, [], 0.0
    for e in corners:
        over = abs(k * (e - plastic) - back) - radius
        change = max(over, 0.0) / (k + hardening)
        dissipated += strength * change
        plastic += np.sign(k * (e - plastic) - back) * change
        back, radius = (
            kinematic * hardening * plastic,
            radius + (1 - kinematic) * hardening * change,
        )
        expected.append(k * (e - plastic))
    assert found == pytest.approx(expected, rel=1e-10)
    assert lost == pytest.approx(dissipated, rel=1e-10)
    assert abs(plastic) > 0.1 * amplitude  # a permanent strain remains


def test_fibres_that_yield_in_compression_are_the_default_laws_under_monotonic_load() -> None:
    yielding, saturating = Point("fibre_plasticity", XYLEM), Point("saturating_fibre", XYLEM)
    for e in (-0.2, -0.1, 0.03):
        F = np.diag([1.0, 1.0, 1.0 + e])
        # tanh against its asymptotes: far from the corner the difference vanishes
        assert yielding.stress(F)[2, 2] == pytest.approx(saturating.stress(F)[2, 2], rel=2e-3)


def test_crushed_tissue_bears_what_is_left_to_densify_says() -> None:
    material = with_constants(crushing_strain=0.06, densified=0.4)
    point, c11 = Point("crushing", material), XYLEM.elastic.stiffness()[0, 0]
    for stretch in np.linspace(1.0, 0.6, 801)[1:]:
        F = np.diag([stretch, 1.0, 1.0])
        pressure = -stretch * point.stress(F)[0, 0] / c11
        lost = point.remember(F)
        area = np.log(np.linalg.det(point.state(F)["unloading"]))
        if area > 0.0:
            # the estimate from the stiffness at rest is corrected one step later
            assert pressure == pytest.approx(0.06 / (1 - area / 0.4), rel=0.01)
            assert lost > 0.0
    assert 0.15 < area < 0.4
    # unloading is elastic, down to the permanent stretch
    for stretch in np.linspace(0.6, np.exp(-area), 20):
        assert point.remember(np.diag([stretch, 1.0, 1.0])) == 0.0
    assert np.abs(point.stress(np.diag([np.exp(-area), 1.0, 1.0]))).max() < 1e-9 * c11


def test_crushed_from_both_sides_it_is_crushed_in_both_directions() -> None:
    point, c11 = Point("crushing", XYLEM), XYLEM.elastic.stiffness()[0, 0]
    for stretch in np.linspace(1.0, 0.85, 301)[1:]:
        F = np.diag([stretch, stretch + 0.002, 1.0])  # not quite the same
        pressures = -np.diag(F.T @ point.stress(F))[:2] / c11
        point.remember(F)
    unloading = point.state(F)["unloading"]
    area = np.log(np.linalg.det(unloading))
    assert area > 0.1
    assert pressures == pytest.approx(0.05 / (1 - area / 0.4), rel=0.01)
    assert unloading[0, 0] > unloading[1, 1] > 1.05


@pytest.mark.parametrize("steps", [1, 7])
def test_a_prony_series_relaxes_and_follows_a_constant_rate_exactly(
    monkeypatch: pytest.MonkeyPatch, steps: int
) -> None:
    """If the stress is linear in the strain, this holds at any strain and number of steps."""
    monkeypatch.setitem(LAWS, "prony", prony("prony", SAINT_VENANT_KIRCHHOFF, 2))
    material = with_constants(**PRONY)
    point, c33 = Point("prony", material), XYLEM.elastic.stiffness()[2, 2]
    shares, times = np.array(SHARES), np.array(TIMES)

    def stress(strain: float) -> float:
        """Return the second Piola-Kirchhoff stress along the fibres."""
        stretch = np.sqrt(1 + 2 * strain)
        F = np.diag([1.0, 1.0, stretch])
        value = point.stress(F)[2, 2] / stretch
        point.remember(F)
        return float(value)

    end, t = 0.1, 5.0
    point.duration_s = t / steps
    found = [stress(strain) for strain in np.linspace(0.0, end, steps + 1)[1:]][-1]
    decay = np.exp(-t / times)
    branches = shares * times * (1 - decay) / t * end
    assert found == pytest.approx(c33 * ((1 - shares.sum()) * end + branches.sum()), rel=1e-10)
    point.duration_s = 20.0 / steps
    for _ in range(steps):
        found = stress(end)
    relaxed = branches * np.exp(-20.0 / times)
    assert found == pytest.approx(c33 * ((1 - shares.sum()) * end + relaxed.sum()), rel=1e-10)


def test_shipped_viscoelastic_law_relaxes_by_its_shares_at_small_strain() -> None:
    only = {key: value for key, value in PRONY.items() if "_1" in key}
    point = Point("viscoelasticity", with_constants(**only))
    F = np.eye(3) + 1e-6 * np.random.default_rng(2).standard_normal((3, 3))
    at_once = point.stress(F)
    assert np.allclose(at_once, Point("saturating_fibre", XYLEM).stress(F), rtol=1e-9)
    point.remember(F)
    point.duration_s = 3.0
    left = 1 - SHARES[0] * (1 - np.exp(-3.0 / TIMES[0]))
    assert np.allclose(point.stress(F), left * at_once, rtol=0.0, atol=1e-4 * np.abs(at_once).max())

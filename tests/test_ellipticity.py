"""The indicator of strong ellipticity, against closed forms and brute force."""

from __future__ import annotations

import numpy as np
import pytest
import ufl
from conftest import Simulate
from dolfinx import fem
from dolfinx import mesh as dmesh
from mpi4py import MPI
from numpy.typing import NDArray

from ramiefenics import (
    BendingResult,
    BendingTest,
    Elastic,
    Material,
    SpecificationError,
    override,
    simulate,
)
from ramiefenics.model.ellipticity import MaterialPoints, smallest_acoustic_eigenvalue
from ramiefenics.model.jit import compile_expression
from ramiefenics.model.laws import LAWS
from ramiefenics.model.solid import Solid
from ramiefenics.published.stalks import PHLOEM


def _isotropic(lame: float, mu: float) -> NDArray[np.float64]:
    i = np.eye(3)
    return (
        lame * np.einsum("ij,kl->ijkl", i, i)
        + mu * np.einsum("ik,jl->ijkl", i, i)
        + mu * np.einsum("il,jk->ijkl", i, i)
    )


@pytest.mark.parametrize(("lame", "mu"), [(10.0, 2.0), (-1.5, 1.0), (-3.0, 1.0)])
def test_isotropic_solid_has_two_wave_speeds(lame: float, mu: float) -> None:
    """The acoustic tensor's eigenvalues are mu and lambda + 2 mu in every direction."""
    value = smallest_acoustic_eigenvalue(_isotropic(lame, mu)[None])
    assert value[0] == pytest.approx(min(mu, lame + 2 * mu))


def _cube(law: str, material: Material) -> Solid:
    mesh = dmesh.create_unit_cube(MPI.COMM_SELF, 1, 1, 1, cell_type=dmesh.CellType.hexahedron)
    cells = dmesh.meshtags(mesh, 3, np.array([0], dtype=np.int32), np.array([1], dtype=np.int32))
    return Solid(mesh, cells, [material], law)


def _deform(solid: Solid, F: NDArray[np.float64]) -> None:
    solid.displacement.interpolate(lambda x: (F - np.eye(3)) @ x)


def test_svk_loses_ellipticity_before_stretch_one_over_root_three() -> None:
    """Without Poisson effect the tangent along a compressed Z is E (3 s^2 - 1) / 2.

    It bounds the minimum; an oblique direction becomes unstable a little earlier.
    """
    solid = _cube("svk", Material(Elastic(3.0, 3.0, 0.0, 0.0, 1.5)))
    points = MaterialPoints(solid)
    for stretch in (0.9, 0.7, 0.575, 0.4):
        _deform(solid, np.diag([1.0, 1.0, stretch]))
        state = points.evaluate(search=True)
        assert state.acoustic_MPa.min() <= 3.0 * (3 * stretch**2 - 1) / 2 + 1e-9
        assert np.all((state.acoustic_MPa > 0) == (stretch > 0.65))
        assert state.volume_ratio == pytest.approx(stretch)
        assert state.principal_stretch == pytest.approx(stretch)
    _deform(solid, np.diag([1.0, 1.0, -0.2]))
    state = points.evaluate()
    assert state.volume_ratio == pytest.approx(-0.2)
    assert state.principal_stretch == pytest.approx(-0.2)


@pytest.mark.slow
def test_search_finds_what_brute_force_finds() -> None:
    """The tangents are those of the default law in the phloem, in random deformed states."""
    rng = np.random.default_rng(7)
    count = 100
    mesh = dmesh.create_interval(MPI.COMM_SELF, count, (0.0, 1.0))
    states = fem.Function(fem.functionspace(mesh, ("DG", 0, (9,))))
    gradients = np.eye(3) * (1, 0.7, 0.9) + 0.1 * rng.standard_normal((count, 3, 3))
    states.x.array[:] = gradients.reshape(-1)
    F = ufl.variable(ufl.as_matrix([[states[3 * i + j] for j in range(3)] for i in range(3)]))
    law = LAWS["saturating_fibre"]
    energy = law.energy(F, {k: ufl.as_ufl(v) for k, v in law.parameters(PHLOEM).items()})
    tangent = compile_expression(ufl.diff(ufl.diff(energy, F), F), np.array([[0.5]]))
    tangents = tangent.eval(mesh, np.arange(count, dtype=np.int32)).reshape(-1, 3, 3, 3, 3)

    polar, turn = np.meshgrid(np.linspace(0, np.pi / 2, 181), np.linspace(0, 2 * np.pi, 361))
    n = np.stack(
        [np.sin(polar) * np.cos(turn), np.sin(polar) * np.sin(turn), np.cos(polar)], axis=-1
    ).reshape(-1, 3)
    brute = [np.linalg.eigvalsh(np.einsum("ijkl,nj,nl->nik", t, n, n)).min() for t in tangents]
    assert min(brute) < 0.0 < max(brute)
    found = smallest_acoustic_eigenvalue(tangents)
    critical = np.argsort(brute)[: count // 20]
    # never above the grid's minimum; below it by the grid's resolution of one degree
    assert np.all(found[critical] <= np.array(brute)[critical] + 1e-9)
    assert found[critical] == pytest.approx(np.array(brute)[critical], rel=1e-3)


def test_default_law_is_elliptic_to_the_end_and_says_so(bent: BendingResult) -> None:
    assert bent.curve["min_acoustic_MPa"].min() > 0.0
    assert bent.curve["min_volume_ratio"].min() > 0.0
    assert bent.losses_mm == {}
    lowest = bent.snapshots[-1].body.cell_data["min_acoustic_MPa"].min()
    assert lowest == pytest.approx(bent.curve["min_acoustic_MPa"].iloc[-1])


def test_a_law_linear_in_axial_compression_kinks(coarse: BendingTest, simulated: Simulate) -> None:
    assert set(simulated(override(coarse, ["law=neo_hookean"])).losses_mm) == {"ellipticity"}


@pytest.mark.slow
def test_svk_kinks_and_collapses_besides(coarse: BendingTest) -> None:
    often = ["law=svk", "protocol.save_every_mm=0.25"]  # ellipticity is sought at saved steps
    svk = simulate(override(coarse, often), MPI.COMM_SELF).losses_mm
    assert svk["ellipticity"] <= svk["stretch"] <= svk["volume"] < 3.0


def test_search_can_be_left_out(coarse: BendingTest) -> None:
    changes = ["numerics.acoustic_check=false", "protocol.travel_mm=0.5"]
    result = simulate(override(coarse, changes), MPI.COMM_SELF)
    assert result.curve["min_acoustic_MPa"].isna().all()
    assert result.curve["min_volume_ratio"].iloc[-1] < 1.0
    assert result.summary()["min_acoustic_MPa"] is None
    with pytest.raises(SpecificationError, match="acoustic_check"):
        override(coarse, ["numerics.acoustic_check=1"])

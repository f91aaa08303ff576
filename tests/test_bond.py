"""Layers that slip on each other and separate: blocks, beams and stalks."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
import pytest
import ufl
from dolfinx import fem
from dolfinx import mesh as dmesh
from mpi4py import MPI
from numpy.typing import NDArray

import ramiefenics as rf
from ramiefenics.model.bond import BondFilm
from ramiefenics.model.equations import Equations, FormTerm
from ramiefenics.model.solid import Solid
from ramiefenics.model.tube import FILM_TAG, build_tube
from ramiefenics.runs.curve import normalised
from ramiefenics.solve.newton import Newton
from ramiefenics.verification.block import block, hold, on_planes, second_order

SLIP = rf.EFFECTS["bark_slip"]
THICKNESS = 1e-4
WIDE, LONG = 1.5, 2.5
HEIGHTS, SHEAR = (2.0, 1.0), (150.0, 50.0)
BOND = rf.Bond(0.04, 0.02, 5e-5)
"""Bond that begins to soften at 0.0008 mm, and has failed at 0.005 mm."""


class Sandwich:
    """Two blocks stacked along Y with a film between them; Poisson's ratio is zero."""

    def __init__(
        self, order: int, bond: rf.Bond, z: NDArray[np.float64], heights: tuple[float, float]
    ) -> None:
        y = np.cumsum([0.0, heights[0], THICKNESS, heights[1]])
        mesh = block(np.array([0.0, WIDE]), y, z)
        mesh = mesh if order == 1 else second_order(mesh)
        every = np.arange(mesh.topology.index_map(3).size_local, dtype=np.int32)
        middle = dmesh.compute_midpoints(mesh, 3, every)[:, 1]
        tags = np.array([1, FILM_TAG, 2])[np.searchsorted(y[1:3], middle)]
        cells = dmesh.meshtags(mesh, 3, every, tags.astype(np.int32))
        materials = [rf.Material(rf.Elastic.isotropic(2 * shear, 0.0)) for shear in SHEAR]
        self.solid = Solid(mesh, cells, materials, "isotropic")
        self.film = BondFilm(self.solid, cells, FILM_TAG, bond, 1e8)
        self.top_mm = float(y[-1])

    def solve(self, bcs: list[fem.DirichletBC], *more: FormTerm, tolerance_N: float = 1e-9) -> None:
        u = self.solid.displacement
        for bc in bcs:
            bc.set(u.x.array)
        terms = [self.solid.term(), self.film.term(), *more]
        outcome = Newton(Equations(u, terms, bcs), 30).solve(tolerance_N, math.inf)
        assert outcome.converged, outcome.reason


def move(solid: Solid, axis: int, at: float, to: float) -> fem.DirichletBC:
    """Prescribe one component of the displacement on a plane across Y."""
    bc = hold(solid, on_planes(solid.mesh, 1, at), axis)
    bc.g.x.array[:] = to
    return bc


def pushed(
    order: int, bond: rf.Bond, axis: int, path: NDArray[np.float64]
) -> Iterator[tuple[float, float, float]]:
    """Push the top along an axis, with all points moving only along it; yield force, energies."""
    parts = Sandwich(order, bond, np.array([0.0, LONG]), HEIGHTS)
    solid = parts.solid
    others = []
    for other in {0, 1, 2} - {axis}:
        space = solid.space.sub(other)
        scalar, _ = space.collapse()
        dofs = fem.locate_dofs_geometrical((space, scalar), lambda x: np.full(x.shape[1], True))
        others.append(fem.dirichletbc(fem.Function(scalar), dofs, space))
    force = fem.form(solid.stress(solid.displacement)[axis, 1] * solid.dx)
    for to in path:
        ends = [move(solid, axis, 0.0, 0.0), move(solid, axis, parts.top_mm, to)]
        parts.solve([*others, *ends])
        # the stress is uniform
        mean = fem.assemble_scalar(force) / sum(HEIGHTS)
        energies = [sum(x) for x in zip(solid.energies(), parts.film.energies(), strict=True)]
        yield mean, energies[0], energies[1]
        parts.film.remember()


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("axis", [0, 2])
def test_two_blocks_and_their_bond_are_springs_in_series(order: int, axis: int) -> None:
    """The shear is so small that quadratic terms do not matter."""
    ((force, stored, dissipated),) = pushed(order, BOND, axis, np.array([5e-4]))
    compliance = HEIGHTS[0] / SHEAR[0] + HEIGHTS[1] / SHEAR[1] + 0.04
    assert force == pytest.approx(WIDE * LONG * 5e-4 / compliance, rel=1e-6)
    assert stored == pytest.approx(force * 5e-4 / 2, rel=1e-6)
    assert dissipated == 0.0


def test_a_bond_softens_unloads_to_its_origin_and_dissipates_its_toughness() -> None:
    blocks, area = HEIGHTS[0] / SHEAR[0] + HEIGHTS[1] / SHEAR[1], WIDE * LONG

    def top(slip: float) -> float:
        """Return the displacement of the top at a slip of the bond under loading."""
        return slip + blocks * 0.02 * min(slip / 8e-4, (5e-3 - slip) / 4.2e-3)

    half = top(2.9e-3)
    path = np.array([top(8e-4), half, 0.5 * half, half, top(4e-3), 5e-3, 6e-3])
    force, stored, dissipated = np.array(list(pushed(1, BOND, 2, path))).T / area
    left = 5e-3 / 0.04 * 1e-6  # residual stress of a failed bond
    assert force == pytest.approx([0.02, 0.01, 0.005, 0.01, 0.02 * 10 / 42, 0, 0], abs=2 * left)
    shares = [0, 0.5, 0.5, 0.5, 32 / 42, 1, 1]
    assert dissipated == pytest.approx(5e-5 * np.array(shares), rel=1e-6, abs=1e-9)
    assert stored[-1] == pytest.approx(0.0, abs=5e-3 * left)
    # this equals the work of the force, which is linear between these points
    mean = (force + np.concatenate([[0.0], force[:-1]])) / 2
    assert (mean * np.diff(path, prepend=0.0)).sum() == pytest.approx(5e-5, rel=1e-4)


def test_layers_come_apart_under_tension_and_not_into_each_other() -> None:
    ((pulled, *_),) = pushed(1, BOND, 1, np.array([5e-4]))
    ((pressed, *_),) = pushed(1, BOND, 1, np.array([-5e-4]))
    young = [2 * shear for shear in SHEAR]
    blocks = HEIGHTS[0] / young[0] + HEIGHTS[1] / young[1]
    # the law is not linear in strains of some ten-thousandths
    assert pulled == pytest.approx(WIDE * LONG * 5e-4 / (blocks + 0.04), rel=1e-3)
    # pressure p and overlap x satisfy p = x / 0.04 + 1e8 x^2 and x = 5e-4 - blocks p
    overlap = np.roots([1e8 * blocks, 25 * blocks + 1, -5e-4]).max()
    pressure = (5e-4 - overlap) / blocks
    assert overlap < 0.04 * 5e-4
    assert pressed == pytest.approx(-WIDE * LONG * pressure, rel=1e-3)


def test_turned_layers_have_not_slipped() -> None:
    parts = Sandwich(1, rf.Bond(1e-3, 1.0, 1.0), np.array([0.0, LONG]), HEIGHTS)
    cos, sin = math.cos(1.0), math.sin(1.0)
    parts.solid.displacement.interpolate(
        lambda x: np.array(
            [0 * x[0], cos * x[1] - sin * x[2] - x[1], sin * x[1] + cos * x[2] - x[2]]
        )
    )
    assert parts.film.energies() == pytest.approx((0.0, 0.0), abs=1e-12)


SPAN, DEPTHS = 60.0, (2.0, 1.0)
LOAD = 1e-7
"""Peak of the distributed load, N/mm.

Deflections are so small that layers which slip as they bend do not wedge each other apart."""


def deflection(compliance: float) -> float:
    """Return the deflection of a simply supported two-layer beam under a half-sine load."""
    z = np.linspace(0.0, SPAN / 2, 13)
    parts = Sandwich(2, rf.Bond(compliance, 1e3, 1e9), z, DEPTHS)
    solid = parts.solid
    space = solid.space
    middle, end = (on_planes(solid.mesh, 2, at) for at in (0.0, SPAN / 2))
    side = on_planes(solid.mesh, 0, 0.0)
    bcs = [hold(solid, at, axis) for at, axis in ((middle, 2), (end, 1), (side, 0))]
    v, x = ufl.TestFunction(space), ufl.SpatialCoordinate(solid.mesh)
    upper = ufl.conditional(ufl.gt(x[1], DEPTHS[0]), 1.0, 0.0)  # presses it onto the lower layer
    load = -LOAD * upper * ufl.cos(math.pi * x[2] / SPAN) / (WIDE * DEPTHS[1]) * v[1] * solid.dx
    parts.solve(bcs, FormTerm(-load, solid.displacement), tolerance_N=2e-3 * LOAD)
    nodes = fem.locate_dofs_topological(space, 2, middle)
    return -float(solid.displacement.x.array.reshape(-1, 3)[nodes, 1].mean())


@pytest.mark.parametrize("compliance", [1e-4, 0.5, 100.0])
def test_a_beam_of_two_layers_slips_as_newmark_says(compliance: float) -> None:
    """Newmark, Siess and Viest 1951: partial interaction, depending on the load's wave length."""
    axial = [2 * shear * WIDE * depth for shear, depth in zip(SHEAR, DEPTHS, strict=True)]
    loose = sum(ea * depth**2 / 12 for ea, depth in zip(axial, DEPTHS, strict=True))
    together = axial[0] * axial[1] / sum(axial) * (sum(DEPTHS) / 2) ** 2
    wave = (math.pi / SPAN) ** 2
    slip = wave * compliance / WIDE * axial[0] * axial[1] / sum(axial)
    stiffness = loose + together / (1.0 + slip)
    # shear in the layers adds up to 2 % to the deflection of a beam 20 times as long as high
    assert deflection(compliance) == pytest.approx(LOAD / wave**2 / stiffness, rel=0.02)


def bent(test: rf.BendingTest, *changes: str) -> rf.BendingResult:
    short = ["protocol.travel_mm=0.8", "numerics.acoustic_check=false"]
    return rf.simulate(rf.override(test, [*short, *changes]), MPI.COMM_SELF)


def last(result: rf.BendingResult, column: str = "force_N") -> float:
    assert result.completed, result.ending.reason
    return float(result.curve[column].iloc[-1])


def test_a_stalk_is_softer_the_more_its_bark_slips(coarse: rf.BendingTest) -> None:
    forces = [last(bent(SLIP.apply(coarse, amplitude))) for amplitude in (0.0, 1e-3, 0.1, 0.3)]
    assert SLIP.apply(coarse, 0.0) is coarse
    assert (np.diff(forces) < 0.0).all()
    assert forces[1] == pytest.approx(forces[0], rel=0.01)
    assert forces[2] < 0.98 * forces[0]


@pytest.mark.parametrize("domain", ["half", pytest.param("full", marks=pytest.mark.slow)])
def test_every_domain_has_the_same_bond(coarse: rf.BendingTest, domain: str) -> None:
    slipped = SLIP.apply(coarse, 0.1)
    other = bent(slipped, f"numerics.domain={domain}")
    assert last(other) == pytest.approx(last(bent(slipped)), rel=1e-3)


def test_a_bond_that_fails_dissipates_and_the_energy_is_accounted_for(
    coarse: rf.BendingTest,
) -> None:
    weak = ["stalk.bond.strength_MPa=0.2", "stalk.bond.toughness_N_per_mm=0.01"]
    curve = bent(SLIP.apply(coarse, 0.1), *weak, "protocol.travel_mm=3").curve
    work = np.trapezoid(curve["force_N"], curve["displacement_mm"])
    kinds = ["stored_energy_Nmm", "friction_work_Nmm", "dissipated_Nmm"]
    assert curve["dissipated_Nmm"].iloc[-1] > 0.1
    # by the trapezoidal rule, over a dozen steps
    assert curve[kinds].iloc[-1].sum() == pytest.approx(work, rel=0.02)


@pytest.mark.parametrize(
    "change", ["stalk.node_thickness_mm=3", "stalk.void_diameter_mm=0", "numerics.mesh.order=2"]
)
def test_the_film_is_beside_the_layers(coarse: rf.BendingTest, change: str) -> None:
    meshes = [
        build_tube(rf.override(test, [change]), MPI.COMM_SELF)
        for test in (coarse, SLIP.apply(coarse, 0.1))
    ]
    without, with_film = (
        {
            tag: fem.assemble_scalar(
                fem.form(
                    fem.Constant(tube.mesh, 1.0)
                    * ufl.Measure("dx", tube.mesh, subdomain_data=tube.cells)(tag)
                )
            )
            for tag in np.unique(tube.cells.values).tolist()
        }
        for tube in meshes
    )
    film = with_film.pop(FILM_TAG)
    assert with_film == pytest.approx(without, rel=2e-4)
    assert 0.0 < film < 2e-4 * without[2]


@pytest.mark.mpi
def test_two_ranks_agree_on_a_slipping_bark(coarse: rf.BendingTest) -> None:
    short = ["protocol.travel_mm=0.5", "numerics.acoustic_check=false"]
    test = rf.override(SLIP.apply(coarse, 0.1), short)
    alone, together = (rf.simulate(test, comm) for comm in (MPI.COMM_SELF, MPI.COMM_WORLD))
    assert last(together) == pytest.approx(last(alone), rel=1e-5)


def test_stiffer_stalks_have_stiffer_bonds() -> None:
    """The run that serves all similar stalks has a bond scaled with its moduli."""
    test = SLIP.apply(rf.ramie(14.23, 7.28, 0.67), 0.1)
    simplest, factor = normalised(test)
    assert simplest.stalk.bond.compliance_mm_per_MPa == pytest.approx(0.1 * factor)
    assert simplest.stalk.bond.strength_MPa == pytest.approx(1.0 / factor)
    assert simplest.stalk.bond.toughness_N_per_mm == pytest.approx(0.3 / factor)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ("stalk.bond.compliance_mm_per_MPa=-1", r"stalk\.bond\.compliance_mm_per_MPa = -1"),
        ("stalk.bond.compliance_mm_per_MPa=0.7", r"toughness_N_per_mm = 0\.3 must be above 0\.35"),
        ("stalk.bond.strength_MPa=0", r"strength_MPa = 0 must be a number above 0 MPa"),
    ],
)
def test_impossible_bonds_are_told(change: str, message: str) -> None:
    with pytest.raises(rf.SpecificationError, match=message):
        rf.override(rf.ramie(14.23, 7.28, 0.67), [change])


def test_one_layer_has_nothing_to_slip_on_and_explicit_steps_are_refused() -> None:
    test = rf.ramie(14.23, 7.28, 0.67)
    with pytest.raises(rf.SpecificationError, match="must be 0 for explicit runs"):
        rf.simulate_explicitly(SLIP.apply(test, 0.1))
    alone = rf.Stalk(240.0, 7.0, test.stalk.layers[-1:])
    with pytest.raises(rf.SpecificationError, match="must be 0 for a stalk of one layer"):
        SLIP.apply(rf.BendingTest(alone), 0.1)

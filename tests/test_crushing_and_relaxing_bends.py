"""Bent stalks that crush permanently or relax, compared with elastic ones on the same mesh."""

from __future__ import annotations

import dataclasses

import numpy as np
import pandas as pd
import pytest
from mpi4py import MPI

from ramiefenics import BendingResult, BendingTest, override, simulate
from ramiefenics.solve.fields import to_grid

pytestmark = pytest.mark.slow

SHARE, TIME_S = 0.4, 5.0
"""Share of the stress that relaxes, and relaxation time, in both layers."""


def bend(test: BendingTest, *changes: str) -> BendingResult:
    """Bend to the end of the path, and check the energy balance."""
    result = simulate(override(test, changes), MPI.COMM_SELF)
    assert result.completed, result.ending.reason
    assert not result.jumps
    curve = result.curve
    spent = curve[["stored_energy_Nmm", "friction_work_Nmm", "dissipated_Nmm"]].sum(axis=1)
    work = curve["indenter_work_Nmm"]
    # the trapezoidal rule, in steps of up to 1 mm
    assert (work - spent).abs().max() < 0.02 * work.max()
    lost = curve["dissipated_Nmm"]
    assert lost.diff().min() >= -1e-9 * lost.iloc[-1]
    return result


def force_N(result: BendingResult, at_mm: float) -> float:
    """Return the force at a travel during loading."""
    loading = result.loading
    return float(np.interp(at_mm, loading["displacement_mm"], loading["force_N"]))


def constants(**values: float) -> list[str]:
    layers = ("xylem", "phloem")
    key = "stalk.layers.{}.material.law_constants.{}={}"
    return [key.format(layer, name, value) for layer in layers for name, value in values.items()]


@pytest.fixture(scope="module")
def stalk(coarse: BendingTest) -> BendingTest:
    return override(coarse, ["numerics.acoustic_check=false"])


@pytest.fixture(scope="module")
def elastic(stalk: BendingTest) -> BendingResult:
    return bend(stalk, "protocol.then=[{to_mm=0}]")


@pytest.fixture(scope="module")
def crushed(stalk: BendingTest) -> BendingResult:
    return bend(stalk, "law=crushing", "protocol.then=[{to_mm=0}]")


def test_a_crushed_stalk_keeps_an_indentation(
    crushed: BendingResult, elastic: BendingResult
) -> None:
    def indentation(result: BendingResult) -> float:
        height = result.curve["section_height_mm"]
        return float(height.iloc[0] - height.iloc[-1])

    assert crushed.curve["force_N"].iloc[-1] == pytest.approx(0.0, abs=1e-3)
    assert abs(indentation(elastic)) < 0.01
    assert indentation(crushed) > 0.2
    # it never bears more than an elastic one, and its unloading is below its loading
    travel = np.linspace(0.6, 3.0, 9)
    for at in travel:
        assert force_N(crushed, at) <= force_N(elastic, at)
    back = crushed.curve.iloc[int(crushed.curve["displacement_mm"].argmax()) :]
    assert (back["dissipated_Nmm"].diff().dropna() < 0.02 * back["dissipated_Nmm"].iloc[-1]).all()
    assert force_N(crushed, 1.0) > 1.5 * np.interp(
        1.0, back["displacement_mm"].iloc[::-1], back["force_N"].iloc[::-1]
    )


def test_fields_have_where_it_is_crushed_and_how_much_that_took(crushed: BendingResult) -> None:
    body = crushed.snapshots[-1].body
    fields = body.cell_data
    area = np.log(np.linalg.det(fields["unloading"].reshape(-1, 2, 2)))
    middles = body.points[body.cells].mean(axis=1)
    # crushed under the indenter and over the support only, and nothing expands
    assert area.min() > -1e-9
    near = (middles[:, 2] < 15.0) | (np.abs(middles[:, 2] - 50.0) < 15.0)
    assert area[near].max() > 0.1
    assert area[~near].max() < 0.1 * area.max()
    volumes = to_grid(body).compute_cell_sizes().cell_data["Volume"]
    whole = 4.0 * float(np.sum(volumes * fields["dissipated_Nmm_per_mm3"]))
    # the value at the middle stands for the mean over a cell
    assert whole == pytest.approx(crushed.curve["dissipated_Nmm"].iloc[-1], rel=0.05)


def test_a_law_that_never_crushes_is_the_default_one(
    stalk: BendingTest, elastic: BendingResult
) -> None:
    strong = bend(stalk, "law=crushing", *constants(crushing_strain=50.0))
    assert strong.curve["dissipated_Nmm"].abs().max() == 0.0
    loading = elastic.loading
    assert strong.curve["force_N"].to_numpy() == pytest.approx(
        loading["force_N"].to_numpy(), rel=1e-5, abs=1e-6
    )


@pytest.fixture(scope="module")
def viscous(stalk: BendingTest) -> BendingTest:
    own = constants(relaxing_share_1=SHARE, relaxation_time_1_s=TIME_S)
    return override(stalk, ["law=viscoelasticity", *own])


@pytest.fixture(scope="module")
def relaxed(stalk: BendingTest) -> BendingResult:
    """The elastic stalk with the moduli that remain after relaxation."""
    layers = tuple(
        dataclasses.replace(layer, material=layer.material.scaled(1.0 - SHARE))
        for layer in stalk.stalk.layers
    )
    return bend(dataclasses.replace(stalk, stalk=dataclasses.replace(stalk.stalk, layers=layers)))


@pytest.mark.parametrize("speed_mm_per_s", [1e4, 1e-4])
def test_fast_it_is_elastic_and_slow_it_has_the_moduli_that_are_left(
    viscous: BendingTest, elastic: BendingResult, relaxed: BendingResult, speed_mm_per_s: float
) -> None:
    result = bend(viscous, f"protocol.speed_mm_per_s={speed_mm_per_s}")
    expected = elastic if speed_mm_per_s > 1.0 else relaxed
    for at in (1.0, 2.0, 3.0):
        # interpolated between different steps; relaxation leaves the contact's stiffness unchanged
        assert force_N(result, at) == pytest.approx(force_N(expected, at), rel=0.01)
    assert force_N(relaxed, 3.0) < 0.7 * force_N(elastic, 3.0)


def test_in_a_hold_it_relaxes_from_the_elastic_force_to_what_is_left(
    viscous: BendingTest, elastic: BendingResult, relaxed: BendingResult
) -> None:
    fast = "protocol.speed_mm_per_s=100"
    result = bend(viscous, fast, "protocol.then=[{hold_s=40}, {to_mm=1}]")
    curve = result.curve
    at_top = curve["displacement_mm"] == 3.0
    hold: pd.DataFrame = curve[at_top]
    force = hold["force_N"].to_numpy()
    assert np.diff(force).max() < 0.0
    assert force[0] == pytest.approx(force_N(elastic, 3.0), rel=0.01)
    assert force[-1] == pytest.approx(force_N(relaxed, 3.0), rel=0.02)
    # the deformation hardly changes during the hold, so the force decays like stress at a point
    elapsed = hold["time_s"].to_numpy() - hold["time_s"].iloc[0]
    left = (force - force[-1]) / (force[0] - force[-1])
    assert left == pytest.approx(np.exp(-elapsed / TIME_S), abs=0.03)
    # it unloads faster than it recovers, and has lost contact where an elastic one still presses
    assert curve["force_N"].iloc[-1] < 0.1 * force_N(relaxed, 1.0)
    assert curve["dissipated_Nmm"].iloc[-1] > 0.2 * curve["indenter_work_Nmm"].max()

"""The picture of the section, with known geometry and stress."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from conftest import Simulate

from ramiefenics import BendingResult, BendingTest, override
from ramiefenics.model.snapshot import Snapshot
from ramiefenics.solve.section import Patch, at_nodes, lattices, section


@pytest.fixture(params=["ladder_q1_1", "ladder_q2_1"])
def pressed(request: pytest.FixtureRequest, screening: BendingTest, simulated: Simulate):
    changes = [f"numerics.mesh={request.param}", "protocol.travel_mm=1"]
    return simulated(override(screening, changes))


def area(patch: Patch) -> float:
    """Return the area of a patch by the shoelace formula."""
    around = [patch.at_mm[0], patch.at_mm[:, -1], patch.at_mm[-1, ::-1], patch.at_mm[::-1, 0]]
    x, y = np.concatenate([edge[:-1] for edge in around]).T
    return float(abs(np.dot(x, np.roll(y, -1)) - np.dot(y, np.roll(x, -1))) / 2.0)


def test_patches_fill_the_section(pressed: BendingResult) -> None:
    """Each layer fills a half ring; parabolas miss a circle by far less than straight lines."""
    snapshot, stalk = pressed.snapshots[-1], pressed.test.stalk
    patches = section(snapshot, stalk, 0.0)
    radii, order = np.array(stalk.radii_mm), snapshot.body.order
    angle = 2.0 * np.pi / (4 * pressed.test.numerics.mesh.angular_elements)
    # a chord of half angle a misses 1 - sin(2 a)/(2 a); a parabola, an amount of its square's order
    missed = {1: angle**2, 2: angle**4}[order]
    for layer in (1, 2):
        found = sum(area(patch) for patch in patches if patch.layer == layer)
        expected = np.pi / 2.0 * (radii[layer] ** 2 - radii[layer - 1] ** 2)
        assert found == pytest.approx(expected, rel=missed)
    below = min(patch.now_mm[..., 1].min() for patch in patches)
    assert -radii[-1] - 1.0 < below < -radii[-1]  # pushed down by at most the travel


def with_stress(snapshot: Snapshot, of) -> Snapshot:
    body = snapshot.body
    middles = body.points[body.cells].mean(axis=1)
    data = body.cell_data | {"axial_stress_MPa": of(middles)}
    return dataclasses.replace(snapshot, body=dataclasses.replace(body, cell_data=data))


def test_a_constant_stays_what_it_is_in_each_layer(pressed: BendingResult) -> None:
    layer = pressed.snapshots[-1].body.cell_data["layer"].astype(float)
    snapshot = with_stress(pressed.snapshots[-1], lambda x: 10.0 * layer)
    for patch in section(snapshot, pressed.test.stalk, 0.0):
        assert patch.stress_MPa == pytest.approx(10.0 * patch.layer)


def test_what_is_linear_in_an_element_is_linear_at_its_points(
    screening: BendingTest, simulated: Simulate
) -> None:
    """This is tested along the stalk, where second-order elements are straight."""
    changes = ["numerics.mesh=ladder_q2_1", "protocol.travel_mm=1"]
    snapshot = simulated(override(screening, changes)).snapshots[-1]
    grid = with_stress(snapshot, lambda x: 2.0 * x[:, 2] - 3.0).body
    z = grid.points[lattices(grid)][..., 2]
    assert at_nodes(grid, "axial_stress_MPa") == pytest.approx(2.0 * z - 3.0, abs=1e-9)

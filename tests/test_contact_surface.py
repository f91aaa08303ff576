"""Contact on the facets of the stalk's surface."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
import ufl
from dolfinx import fem
from mpi4py import MPI

from ramiefenics import BendingResult, BendingTest, override
from ramiefenics.model.bending import BendingProblem
from ramiefenics.model.jit import compile_form
from ramiefenics.model.surface import NO_CONTACT, SLIP, STICK, ContactSurface

TRAVEL_MM, ASIDE_MM = 0.5, 0.1


@pytest.fixture(scope="module", params=[1, 2])
def pressed(request: pytest.FixtureRequest, coarse: BendingTest) -> BendingProblem:
    """A stalk pressed halfway into all cylinders and pulled along them, for each element order."""
    order = int(request.param)
    changes = [f"numerics.mesh.order={order}", "numerics.mesh.angular_elements=8"]
    changes.append(f"numerics.mesh.serendipity={str(order == 2).lower()}")  # as in the recipes
    problem = BendingProblem(override(coarse, changes), MPI.COMM_SELF)
    problem.place(TRAVEL_MM, TRAVEL_MM)
    motion = (ASIDE_MM, -TRAVEL_MM / 2, 0.0)
    problem.displacement.interpolate(lambda x: np.outer(motion, x[0] ** 0))
    return problem


def surface_of(problem: BendingProblem) -> tuple[ContactSurface, np.ndarray]:
    """Return the surface, and the corners of its facets, mm, shape (m, 4, 3)."""
    nodes = fem.functionspace(problem.tube.mesh, ("Lagrange", problem.solid.order))
    surface = ContactSurface(problem.contact, nodes)
    return surface, nodes.tabulate_dof_coordinates()[surface.corners]


def test_facets_sum_to_the_forces_of_contact(pressed: BendingProblem) -> None:
    surface, corners = surface_of(pressed)
    fields = surface.evaluate()
    force = (fields["area_mm2"][:, None] * fields["contact_traction_MPa"]).sum
    above = corners[:, :, 1].mean(axis=1) > 0.0
    indenter, support = pressed.contact.sums()
    # the same numbers at the same points, summed in a different order
    assert force(axis=0, where=above[:, None])[1] == pytest.approx(indenter.force_y_N, rel=1e-12)
    assert force(axis=0, where=~above[:, None])[1] == pytest.approx(support.force_y_N, rel=1e-12)


@pytest.mark.parametrize("name", ["pressure", "friction", "traction"])
def test_facets_sum_to_the_integrals_of_the_weak_form(pressed: BendingProblem, name: str) -> None:
    fields = surface_of(pressed)[0].evaluate()
    field = {"pressure": "contact_pressure_MPa", "friction": "friction_traction_MPa"}.get(
        name, "contact_traction_MPa"
    )
    stated = getattr(pressed.contact, name)
    stated = ufl.as_vector([stated, 0, 0]) if name == "pressure" else stated
    axes = np.eye(3)[:1] if name == "pressure" else np.eye(3)
    along = (fem.Constant(pressed.tube.mesh, axis) for axis in axes)
    forms = (compile_form(ufl.dot(stated, axis) * pressed.contact.ds) for axis in along)
    integrals = [fem.assemble_scalar(form) for form in forms]
    sums = np.atleast_1d(fields["area_mm2"] @ fields[field])
    assert sums == pytest.approx(integrals, rel=1e-12, abs=1e-12 * np.abs(integrals).max())


def test_codes_and_numbers_belong_to_the_facets_they_were_found_on(
    pressed: BendingProblem, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The states are prescribed: contact near midspan, and slip in its upper part."""
    X = ufl.SpatialCoordinate(pressed.tube.mesh)
    touching = ufl.conditional(ufl.lt(X[2], 20.0), 1.0, 0.0)
    slipping = ufl.conditional(ufl.gt(X[1], 5.0), touching, 0.0)
    monkeypatch.setattr(pressed.contact, "states", lambda: (touching, slipping))
    monkeypatch.setattr(pressed.contact, "gap", X[2])
    surface, corners = surface_of(pressed)
    fields = surface.evaluate()
    (x, y, z), state = corners.transpose(2, 0, 1), fields["contact_state"]
    assert np.all((z.min(axis=1) < fields["gap_mm"]) & (fields["gap_mm"] < z.mean(axis=1)))
    near = z.max(axis=1) < 20.0
    # a facet bulges by at most 7.1 (1 - cos(6 degrees)) = 0.04 mm from the plane of its corners
    above, below = near & (y.min(axis=1) > 5.0), near & (y.max(axis=1) < 4.9)
    assert above.any()
    assert below.any()
    assert np.all(state[above] == SLIP)
    assert np.all(state[below] == STICK)
    assert np.all(state[z.min(axis=1) > 20.0] == NO_CONTACT)
    outwards = np.cross(corners[:, 1] - corners[:, 0], corners[:, 3] - corners[:, 0])
    assert np.all(outwards[:, 0] * x.mean(axis=1) + outwards[:, 1] * y.mean(axis=1) > 0.0)


def test_stalk_pulled_along_its_cylinders_slips_by_the_pull(pressed: BendingProblem) -> None:
    fields = surface_of(pressed)[0].evaluate()
    touching = fields["contact_state"] > NO_CONTACT
    assert set(fields["contact_state"]) == {NO_CONTACT, SLIP}
    assert fields["slip_mm"][touching, 0] == pytest.approx(ASIDE_MM, rel=1e-12)
    assert np.all(fields["friction_traction_MPa"][touching, 0] < 0.0)
    assert np.all(fields["slip_mm"][~touching] == 0.0)


def test_rank_without_facets_of_contact_has_none(
    pressed: BendingProblem, monkeypatch: pytest.MonkeyPatch
) -> None:
    """One of many ranks may have only the sides of the stalk."""
    nothing = np.empty(0, dtype=np.int32)
    bare = tuple(dataclasses.replace(c, facets=nothing) for c in pressed.contact.obstacles)
    monkeypatch.setattr(pressed.contact, "obstacles", bare)
    surface, corners = surface_of(pressed)
    assert corners.shape == (0, 4, 3)
    assert {len(values) for values in surface.evaluate().values()} == {0}


def test_pressure_and_state_agree_on_every_facet(bent: BendingResult) -> None:
    for snapshot in bent.snapshots[1:]:
        fields = snapshot.contact.cell_data
        touching = fields["contact_state"] != NO_CONTACT
        assert touching.any()
        assert set(fields["contact_state"]) <= {NO_CONTACT, STICK, SLIP}
        pressures = ("contact_pressure_MPa", "max_contact_pressure_MPa")
        for name in pressures:
            assert np.all(fields[name][touching] > 0.0)
        for name in (*pressures, "contact_traction_MPa", "slip_mm"):
            assert np.all(fields[name][~touching] == 0.0)
        assert np.all(fields["contact_pressure_MPa"] <= fields["max_contact_pressure_MPa"])


def test_contact_of_a_bent_stalk_bears_its_forces_on_its_cylinders(bent: BendingResult) -> None:
    for snapshot in bent.snapshots[1:]:
        fields, at = snapshot.contact.cell_data, snapshot.contact.points[snapshot.contact.cells]
        above = at[:, :, 1].mean(axis=1) > 0.0
        touching = fields["contact_state"] != NO_CONTACT
        z = at[:, :, 2].mean(axis=1)
        assert np.all(z[touching & above] < 25.0)
        assert np.all(z[touching & ~above] > 25.0)
        forces = fields["area_mm2"] * fields["contact_traction_MPa"][:, 1]
        row = bent.curve[bent.curve["displacement_mm"] == snapshot.travel_mm].iloc[0]
        for where, name in ((above, "force_N"), (~above, "support_force_N")):
            # a quarter of the stalk; the same sum in another order
            assert 4.0 * abs(forces[where].sum()) == pytest.approx(row[name], rel=1e-10)
        # Nitsche's method allows a gap of a fraction of the cells' thickness, which is 0.7 mm
        assert np.abs(fields["gap_mm"][touching]).max() < 0.03
        assert fields["gap_mm"][~touching].min() > 0.0

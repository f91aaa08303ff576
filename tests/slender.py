"""Slender stalks of one isotropic layer, hardly indented by contact, bent by a millimetre."""

from __future__ import annotations

from mpi4py import MPI

import ramiefenics as rf
from ramiefenics.effects.combining import with_effects

YOUNG, POISSON, SPAN = 300.0, 0.3, 200.0


def slender(
    void_mm: float, outer_mm: float, fixture: rf.Fixture, *changes: str, travel_mm: float = 1.0
) -> rf.BendingTest:
    """Return the test of a tube or rod, on a mesh just fine enough for bending."""
    material = rf.Material(rf.Elastic.isotropic(YOUNG, POISSON))
    stalk = rf.Stalk(240.0, void_mm, (rf.Layer("wall", outer_mm, material),))
    settings = (
        "numerics.mesh=ladder_q2_1",
        "numerics.mesh.angular_elements=4",
        "numerics.mesh.contact_size=0.05",
        "numerics.acoustic_check=false",
        "numerics.stepping.first_step_mm=1",
        f"protocol.travel_mm={travel_mm}",
        f"protocol.save_every_mm={travel_mm}",
    )
    return rf.override(rf.BendingTest(stalk, fixture, law="isotropic"), [*settings, *changes])


def with_(test: rf.BendingTest, **amplitudes: float) -> rf.BendingTest:
    """Return the test with shipped effects."""
    return with_effects(test, [(rf.EFFECTS[name], a) for name, a in amplitudes.items()])


def force(test: rf.BendingTest) -> float:
    """Return the force at the end of the travel."""
    result = rf.simulate(test, MPI.COMM_SELF)
    assert result.completed, result.ending.reason
    return float(result.curve["force_N"].iloc[-1])

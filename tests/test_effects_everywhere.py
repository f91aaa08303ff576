"""Every shipped effect on every modelled part of the stalk, element order and number of ranks."""

from __future__ import annotations

import numpy as np
import pytest
from mpi4py import MPI

import ramiefenics as rf
from ramiefenics.effects.combining import with_effects
from ramiefenics.specification.numerics import DOMAINS

SHORT = [
    "protocol.travel_mm=1.0",
    "numerics.acoustic_check=false",
    "numerics.stepping.relative_tolerance=1e-8",
    "stalk.position_mm=500",
    "stalk.moisture=0.1",
    "stalk.measured_at_mm=40",
]
SECOND_ORDER = [
    "numerics.mesh=ladder_q2_1",
    "numerics.mesh.wall_elements=1",
    "numerics.mesh.contact_size=0.04",
    "numerics.mesh.coarse_size=0.1",
]


@pytest.fixture
def short(coarse: rf.BendingTest) -> rf.BendingTest:
    return rf.override(coarse, SHORT)


def with_effect(name: str, test: rf.BendingTest) -> rf.BendingTest:
    effect = rf.EFFECTS[name]
    return with_effects(test, [(effect, effect.typical)])


def recorded(test: rf.BendingTest, comm: MPI.Comm = MPI.COMM_SELF) -> np.ndarray:
    """Return displacement and force at the end, as the machine records them."""
    result = rf.simulate(test, comm)
    assert result.completed, result.ending.reason
    return result.curve[["recorded_displacement_mm", "recorded_force_N"]].iloc[-1].to_numpy()


@pytest.mark.slow
@pytest.mark.parametrize("name", rf.EFFECTS)
def test_larger_domains_have_the_same_forces(name: str, short: rf.BendingTest) -> None:
    """Steps differ by rounding, and with them the state of friction."""
    test = with_effect(name, short)
    first = DOMAINS.index(test.numerics.domain)
    assert test.numerics.domain == test.least_domain[0]
    least = recorded(test)
    for domain in DOMAINS[first + 1 :]:
        larger = rf.override(test, [f"numerics.domain={domain}"])
        assert recorded(larger) == pytest.approx(least, rel=1e-5), domain


@pytest.mark.slow
@pytest.mark.parametrize("name", rf.EFFECTS)
def test_elements_of_either_order_say_the_same(name: str, short: rf.BendingTest) -> None:
    """Meshes so coarse give the sign of an effect's change, and its size to a factor of two.

    Changes that differ by less than a fiftieth of the value pass in any case.
    """
    changes = []
    for mesh in ([], SECOND_ORDER):
        base = rf.override(short, [*mesh, "numerics.mesh.angular_elements=12"])
        before, after = recorded(base), recorded(with_effect(name, base))
        changes.append((after - before) / before)
    first, second = np.array(changes)
    for one, other in zip(first, second, strict=True):
        assert abs(one - other) < 0.02 or 0.5 < one / other < 2.0


@pytest.mark.mpi
@pytest.mark.parametrize("name", rf.EFFECTS)
def test_ranks_agree(name: str, short: rf.BendingTest) -> None:
    test = rf.override(with_effect(name, short), ["protocol.travel_mm=0.5"])
    alone, together = recorded(test), recorded(test, MPI.COMM_WORLD)
    assert together == pytest.approx(alone, rel=1e-7)

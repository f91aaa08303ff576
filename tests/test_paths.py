"""Paths beyond a single loading: unloading, holding, reloading."""

from __future__ import annotations

import numpy as np
import pytest
from mpi4py import MPI
from scipy.interpolate import Akima1DInterpolator

import ramiefenics as rf
from ramiefenics.solve.path import segments

SMOOTH = ("fixture.friction.static=0", "fixture.friction.dynamic=0")


def test_path_is_read_as_targets(coarse: rf.BendingTest, tmp_path) -> None:
    then = "protocol.then=[{to_mm=1.0, speed_mm_per_s=0.5}, {hold_s=60}, {to_mm=2.0}]"
    test = rf.override(coarse, [then])
    legs = [(leg.from_mm, leg.to_mm, leg.duration_s) for leg in test.protocol.legs]
    assert legs == [(0.0, 3.0, 3.0), (3.0, 1.0, 4.0), (1.0, 1.0, 60.0), (1.0, 2.0, 1.0)]
    assert test.protocol.duration_s == 68.0
    rf.write_test(test, tmp_path / "path.toml")
    assert rf.read_test(tmp_path / "path.toml") == test


@pytest.mark.parametrize(
    ("then", "sentence"),
    [
        ("[{}]", "then.0 = .* must have either to_mm or hold_s"),
        ("[{to_mm=1, hold_s=1}]", "must have either to_mm or hold_s"),
        ("[{to_mm=-1}]", "then.0.to_mm = -1 must be a number at least 0 mm"),
        ("[{to_mm=3.0}]", "then.0.to_mm = 3.0 must differ from the travel before it"),
        ("[{hold_s=1, speed_mm_per_s=2}]", "speed_mm_per_s = 2.0 must be left out for a hold"),
    ],
)
def test_impossible_targets_get_one_sentence(
    coarse: rf.BendingTest, then: str, sentence: str
) -> None:
    with pytest.raises(rf.SpecificationError, match=sentence):
        rf.override(coarse, [f"protocol.then={then}"])


def test_fields_are_saved_at_multiples_in_both_directions(coarse: rf.BendingTest) -> None:
    test = rf.override(coarse, ["protocol.then=[{to_mm=0.5}]"])
    _, back = segments(test.protocol, test.numerics.stepping)
    at, travels = 0.0, []
    while at < back.length:
        at = back.next_stop(at)
        travels.append(back.travel_mm(at))
    assert travels == [2.0, 0.5]


def test_unloading_retraces_an_elastic_loading(coarse: rf.BendingTest) -> None:
    """Without friction the state depends on the travel alone, and unloading leaves nothing.

    Nitsche's stabilisation is that of the previous step, and is up to date at the end of a hold.
    """
    path = "{hold_s=1}, {to_mm=1.5}, {to_mm=1.0}, {hold_s=1}, {to_mm=0}, {to_mm=1.0}, {hold_s=1}"
    changes = [*SMOOTH, "protocol.travel_mm=1", f"protocol.then=[{path}]"]
    result = rf.simulate(rf.override(coarse, changes), MPI.COMM_SELF)
    assert result.completed
    assert not result.jumps
    curve = result.curve
    ends = [curve[np.isclose(curve["time_s"], time)].iloc[-1] for time in (2.0, 4.0, 7.0)]
    for column in ("force_N", "stored_energy_Nmm", "void_height_mm"):
        found = [row[column] for row in ends]
        # tolerance of Newton's method, 1e-5 of the force, and the lag of the stabilisation
        assert found == pytest.approx([found[0]] * 3, rel=1e-4)
    off = curve[curve["displacement_mm"] == 0.0].iloc[-1]
    assert abs(off["force_N"]) < 1e-6
    assert off["stored_energy_Nmm"] < 1e-6
    loading = result.loading["displacement_mm"]
    assert loading.is_monotonic_increasing
    assert loading.iloc[-1] == 1.5
    assert result.max_force_N == curve["force_N"].max()
    assert not result.has_force_maximum


def test_what_follows_loadings_only_says_so(coarse: rf.BendingTest) -> None:
    test = rf.override(coarse, ["protocol.then=[{to_mm=0}]"])
    for follow in (rf.simulate_explicitly, lambda test: rf.sensitivities(test, {})):
        with pytest.raises(rf.SpecificationError, match=r"must be left out: .* first loading only"):
            follow(test)


def test_steps_end_at_parts_of_the_longest(coarse: rf.BendingTest) -> None:
    """This holds for any lengths; a step that would leave less than a quarter is halved."""
    test = rf.override(coarse, ["protocol.travel_mm=3.2", "protocol.save_every_mm=10"])
    (leg,) = segments(test.protocol, test.numerics.stepping)
    at, ends = 0.0, []
    increments = iter([0.3, 0.4, 0.5, 0.9, 0.7, 1.0, 1.0])
    while at < leg.length:
        before, increment = at, next(increments)
        at, saved = leg.next_step(before, increment)
        ends.append(at)
        assert saved == (at == leg.length)
        assert at - before <= increment
    assert ends == pytest.approx([0.25, 0.5, 1.0, 1.5, 2.0, 2.6, 3.2])


@pytest.mark.slow
def test_similar_stalks_do_not_differ_by_their_steps(screening: rf.BendingTest) -> None:
    """Forces are smooth functions of a modulus, without irregularities due to steps."""
    key, forces, at = "stalk.layers.phloem.material.elastic.E_X_MPa", [], np.arange(0.5, 14.1, 0.5)
    usual = screening.stalk.layers[-1].material.elastic.E_X_MPa
    for share in np.linspace(0.98, 1.02, 9):
        test = rf.override(screening, [f"{key}={share * usual}", "protocol.save_every_mm=14"])
        curve = rf.simulate(test, MPI.COMM_SELF).curve
        forces.append(Akima1DInterpolator(curve["displacement_mm"], curve["force_N"])(at))
    # third differences amplify irregular errors: 9e-3 if steps could end anywhere
    rough = np.abs(np.diff(forces, 3, axis=0)).max() / np.max(forces)
    assert rough < 4e-3

"""Synthetic data sets contain what they should, for stalks with a closed-form force."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

import ramiefenics as rf
from ramiefenics.discovery.synthetic import Broken, Secret, make_dataset
from ramiefenics.discovery.synthetic.curves import FINEST
from ramiefenics.measured import Record
from ramiefenics.runs import Done
from ramiefenics.runs.curve import CurveTask

pytestmark = pytest.mark.filterwarnings("ignore::ramiefenics.SpecificationWarning")

AT_MM = np.linspace(0.0, 16.0, 161)
ROUNDED_N = 0.05
"""Largest rounding error, as the load cell resolves 0.1 N."""

GAP, LOAD_SCALE = rf.EFFECTS["seating_gap"], rf.EFFECTS["load_scale"]


class Beams:
    """Stand-in for `Runs` with stalks that neither shear nor crush."""

    asked = 0

    def map(self, tasks: Sequence[CurveTask]) -> list[Done[pd.DataFrame]]:
        return [Done(self._curve(task.test)) for task in tasks]

    def _curve(self, test: rf.BendingTest) -> pd.DataFrame:
        return pd.DataFrame({"displacement_mm": AT_MM, "force_N": stiffness(test) * AT_MM})


class TooStiffBeams(Beams):
    """Curves of straight lines that are too steep on all but the finest mesh."""

    def _curve(self, test: rf.BendingTest) -> pd.DataFrame:
        excess = 1.0 if test.numerics.mesh == FINEST else 1.2
        curve = super()._curve(test)
        return curve.assign(force_N=excess * curve["force_N"])


class CreasedBeams(TooStiffBeams):
    """On the finest mesh, the force falls at once by a tenth at 12 mm."""

    def _curve(self, test: rf.BendingTest) -> pd.DataFrame:
        curve = super()._curve(test)
        left = 0.9 if test.numerics.mesh == FINEST else 1.0
        return curve.assign(force_N=curve["force_N"] * np.where(AT_MM > 12.0, left, 1.0))


def stiffness(test: rf.BendingTest) -> float:
    """Return a stiffness, N/mm, that scales with the inverse cube of the span."""
    modulus = test.stalk.layers[-1].material.elastic.E_Z_MPa / 1000.0
    turned = np.cos(np.radians(test.stalk.rotation_deg)) ** 2
    return modulus * (5.0 + turned) * (100.0 / test.fixture.span_mm) ** 3


def made(folder: Path, *secrets: Secret, beams: Beams | None = None, **options: Any) -> rf.Dataset:
    runs = beams or Beams()
    make_dataset(folder, secrets, 5, runs, **{"specimens": 3, "noise": 0.0, **options})
    return rf.read_dataset(folder)


def force(record: Record) -> np.ndarray:
    return record.curve["force_N"].to_numpy()


def test_every_stalk_is_bent_in_every_test(tmp_path: Path) -> None:
    tests = [{}, {"fixture.span_mm": 80.0}, {"stalk.rotation_deg": 90.0}]
    data = made(tmp_path / "data", tests=tests)
    assert data.specimens == ("S01", "S02", "S03")
    assert [r.name for r in data.records[:3]] == ["S01 1", "S01 2", "S01 3"]
    for usual, short, turned in np.array(data.records, dtype=object).reshape(3, 3):
        assert [r.test.fixture.span_mm for r in (usual, short, turned)] == [100.0, 80.0, 100.0]
        assert [r.test.stalk.rotation_deg for r in (usual, short, turned)] == [0.0, 0.0, 90.0]
        # the same stalk has the same modulus in all tests
        assert force(short) == pytest.approx(force(usual) / 0.8**3, abs=3 * ROUNDED_N)
        assert force(turned) == pytest.approx(force(usual) * 5.0 / 6.0, abs=2 * ROUNDED_N)


def test_a_single_test_may_differ_from_the_baseline(tmp_path: Path) -> None:
    usual = made(tmp_path / "usual")
    short = made(tmp_path / "short", tests=[{"fixture.span_mm": 80.0}])
    assert not (tmp_path / "usual/tests.csv").exists()
    for one, other in zip(usual.records, short.records, strict=True):
        assert one.name == other.name == one.specimen
        assert other.test.fixture.span_mm == 80.0
        assert force(other) == pytest.approx(force(one) / 0.8**3, abs=3 * ROUNDED_N)


@pytest.mark.parametrize("secret", [Secret(None), Secret(rf.EFFECTS["off_centre_indenter"], 5.0)])
def test_forces_are_those_on_the_finest_mesh(tmp_path: Path, secret: Secret) -> None:
    """An indenter off midspan needs a larger domain, where the finest mesh takes too long."""
    right = made(tmp_path / "right", secret)
    corrected = made(tmp_path / "corrected", secret, beams=TooStiffBeams())
    for one, other in zip(right.records, corrected.records, strict=True):
        assert force(other) == pytest.approx(force(one), abs=ROUNDED_N)


def test_falls_on_the_finest_mesh_are_not_carried_over(tmp_path: Path) -> None:
    right = made(tmp_path / "right")
    corrected = made(tmp_path / "corrected", beams=CreasedBeams())
    for one, other in zip(right.records, corrected.records, strict=True):
        assert force(other) == pytest.approx(force(one), abs=ROUNDED_N)


def test_a_test_may_end_before_the_others(tmp_path: Path) -> None:
    short = {"fixture.span_mm": 80.0, "protocol.travel_mm": 9.0}
    data = made(tmp_path / "data", tests=[{}, short])
    ends = [record.curve["displacement_mm"].iloc[-1] for record in data.records]
    assert ends == [14.0, 9.0] * 3
    first, second = data.records[:2]
    assert force(second) == pytest.approx(force(first)[: len(second.curve)] / 0.8**3, abs=0.15)


def test_several_effects_are_hidden_together(tmp_path: Path) -> None:
    plain = made(tmp_path / "plain").records[0]
    hidden = made(tmp_path / "hidden", Secret(GAP, 0.5), Secret(LOAD_SCALE, 0.1)).records[0]
    k = np.polyfit(plain.curve["displacement_mm"], force(plain), 1)[0]
    travel = hidden.curve["displacement_mm"].to_numpy()
    expected = 1.1 * k * np.maximum(travel - 0.5, 0.0)
    assert force(hidden) == pytest.approx(expected, abs=2 * ROUNDED_N)


def test_amplitudes_differ_between_specimens_not_between_their_tests(tmp_path: Path) -> None:
    options: dict[str, Any] = {"specimens": 12, "tests": [{}, {"fixture.span_mm": 80.0}]}
    plain = made(tmp_path / "plain", **options)
    hidden = made(tmp_path / "hidden", Secret(LOAD_SCALE, 0.05, spread=0.02), **options)
    scales = np.array(
        [force(h)[-1] / force(p)[-1] for h, p in zip(hidden.records, plain.records, strict=True)]
    ).reshape(12, 2)
    assert scales[:, 0] == pytest.approx(scales[:, 1], abs=2e-3)  # resolution of 0.1 N in 84 N
    # three standard errors of mean and standard deviation
    assert scales.mean() == pytest.approx(1.05, abs=3 * 0.02 / np.sqrt(12))
    assert scales[:, 0].std(ddof=1) == pytest.approx(0.02, abs=3 * 0.02 / np.sqrt(2 * 11))


def test_a_broken_specimen_is_the_only_one(tmp_path: Path) -> None:
    broken = [Broken(specimen=1, lost=0.3, from_mm=6.0, scale=0.9)]
    whole, other = made(tmp_path / "whole"), made(tmp_path / "broken", broken=broken)
    for index, (one, two) in enumerate(zip(whole.records, other.records, strict=True)):
        if index != 1:
            pd.testing.assert_frame_equal(one.curve, two.curve)
            continue
        share = force(two)[1:] / force(one)[1:]
        slipped = one.curve["displacement_mm"].to_numpy()[1:] >= 6.0
        late = one.curve["displacement_mm"].to_numpy()[1:] > 2.0  # where 0.1 N is 1 %
        assert share[slipped] == pytest.approx(0.9 * 0.7, abs=0.01)
        assert share[late & ~slipped] == pytest.approx(0.9, abs=0.02)


def test_nobody_notes_a_mistake(tmp_path: Path) -> None:
    right = made(tmp_path / "right")
    wrong = made(tmp_path / "wrong", mistaken={"fixture.span_mm": 92.0})
    for name in ("dataset.toml", "specimens.csv"):
        assert (tmp_path / "wrong" / name).read_text() == (tmp_path / "right" / name).read_text()
    assert wrong.records[0].test.fixture.span_mm == 100.0
    expected = force(right.records[0]) / 0.92**3
    assert force(wrong.records[0]) == pytest.approx(expected, abs=3 * ROUNDED_N)


def test_noise_has_its_share_of_the_peak(tmp_path: Path) -> None:
    plain = made(tmp_path / "plain", specimens=8)
    noisy = made(tmp_path / "noisy", specimens=8, noise=0.03)
    errors = [
        (force(two) - force(one)) / force(one).max()
        for one, two in zip(plain.records, noisy.records, strict=True)
    ]
    # eight records of 14 double correlation lengths of half a millimetre: 112 draws
    assert np.std(errors) == pytest.approx(0.03, rel=3.0 / np.sqrt(2 * 112))

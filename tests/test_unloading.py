"""Unloading: measured and simulated curves, and causes that it distinguishes."""

from __future__ import annotations

import os
import tomllib
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import tomli_w
from formula import Formula
from mpi4py import MPI
from test_discovery import COARSE, FINE

import ramiefenics as rf
from ramiefenics.discovery.curves.meshes import finer
from ramiefenics.discovery.curves.observed import observe
from ramiefenics.discovery.synthetic import Secret, make_dataset
from ramiefenics.effects import SUSPECTS
from ramiefenics.measured.unloading import with_unloading
from ramiefenics.runs import Runs, workers
from ramiefenics.runs.curve import CurveTask
from ramiefenics.specification.files import to_dict

pytestmark = pytest.mark.filterwarnings("ignore::ramiefenics.SpecificationWarning")

SEED = int(os.environ.get("RAMIEFENICS_SEED") or 4127)
LASTING, PASSING = rf.EFFECTS["irreversible_damage"], rf.EFFECTS["fibre_damage"]
COMPLIANCE = rf.EFFECTS["machine_compliance"]
UNLOADED = "protocol.then=[{to_mm=0}]"


def pieces(test: rf.BendingTest) -> list[pd.DataFrame]:
    """Return the curves of loading and of unloading, as tasks give them."""
    tasks = [CurveTask(one) for one in (test, rf.override(test, [UNLOADED]))]
    return [task.read(task.compute()) for task in tasks]


def test_without_friction_a_stalk_unloads_as_it_was_loaded(screening: rf.BendingTest) -> None:
    free = ["fixture.friction.static=0", "fixture.friction.dynamic=0", "protocol.travel_mm=3"]
    there, back = pieces(rf.override(screening, free))
    assert back["displacement_mm"].is_monotonic_increasing
    assert back["displacement_mm"].iloc[-1] == pytest.approx(3.0)
    again = np.interp(there["displacement_mm"], back["displacement_mm"], back["force_N"])
    # interpolated linearly between steps
    assert again == pytest.approx(there["force_N"].to_numpy(), abs=0.01 * there["force_N"].max())


def test_loading_less_unloading_is_what_friction_takes(screening: rf.BendingTest) -> None:
    fine = rf.override(screening, ["numerics.stepping.max_step_mm=0.2", "protocol.travel_mm=4"])
    there, back = pieces(fine)
    done, got = (
        np.trapezoid(curve["force_N"], curve["displacement_mm"]) for curve in (there, back)
    )
    whole = rf.simulate(rf.override(fine, [UNLOADED]), MPI.COMM_SELF).curve
    assert done - got == pytest.approx(whole["friction_work_Nmm"].iloc[-1], rel=0.05)


def test_a_run_that_breaks_off_has_no_unloading(coarse: rf.BendingTest) -> None:
    short = rf.override(coarse, ["numerics.stepping.max_iterations=1", UNLOADED])
    with pytest.raises(rf.SpecificationError, match=r"protocol\.then = .* must be followed"):
        CurveTask(short).compute()


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("unloaded")
    make_dataset(folder, Secret(LASTING, 0.4), 31, Formula(), unloaded=True)
    return folder


def test_unloading_is_a_record_of_its_own(folder: Path, tmp_path: Path) -> None:
    for path in folder.rglob("*"):
        if path.is_file():
            (tmp_path / path.relative_to(folder)).parent.mkdir(parents=True, exist_ok=True)
            (tmp_path / path.relative_to(folder)).write_bytes(path.read_bytes())
    first = tmp_path / "curves/S01.csv"
    table = pd.read_csv(first)
    up, down = table.iloc[:281], table.iloc[281:]
    # held and unloaded, with a jittering displacement, and loaded again from 6 mm on
    held = up.iloc[[-1] * 5].assign(displacement_mm=[14.0, 13.999, 14.0, 13.998, 14.0])
    down = down[down["displacement_mm"] >= 6.0]
    table = pd.concat([up, held, down, down.iloc[[-2, -1]], down.iloc[::-1]])
    table["time_s"] = np.arange(len(table)) / 10.0
    table.to_csv(first, index=False)
    data = rf.read_dataset(tmp_path)
    both = with_unloading(data)
    assert [r.name for r in both.records[:3]] == ["S01", "S01, unloading", "S02"]
    assert both.specimens == data.specimens
    assert len(both.records) == 16
    loading, back, *_ = both.records
    assert not loading.test.protocol.then
    assert back.test.protocol.then
    at = back.curve["displacement_mm"].to_numpy()
    assert np.all(np.diff(at) > 0.0)
    assert (at[0], at[-1]) == pytest.approx((6.0, 13.999))
    assert back.range_mm == pytest.approx((6.0, 0.95 * 14.0))
    whole = both.records[3]
    least = 0.1 * both.records[2].curve["force_N"].max()
    low = whole.curve[whole.curve["displacement_mm"] > whole.range_mm[0]]
    assert low["force_N"].min() >= least
    assert len({r.test.protocol.travel_mm for r in both.records[1::2]}) == 1
    assert with_unloading(data).notes() == []
    turns = observe(both).turn_N
    assert turns is not None
    assert turns[1] == pytest.approx(up["force_N"].iloc[-1])
    assert np.isnan(turns[0])
    assert len(set(both.conditions)) == 2


def test_only_unloading_tells_what_lasts(folder: Path, tmp_path: Path) -> None:
    suspects = {e.name: e for e in (LASTING, PASSING, COMPLIANCE)}
    found = rf.discover(folder, suspects, runs=Formula())
    assert found.verdict == "cause"
    assert found.causes == (LASTING.name,)
    low, high = found.interval(LASTING.name)
    assert low < 0.4 < high
    assert found.condition_gain is not None
    assert found.condition_gain.shown
    make_dataset(tmp_path, Secret(LASTING, 0.4), 31, Formula())
    found = rf.discover(tmp_path, suspects, runs=Formula())
    assert found.verdict == "ambiguous"
    assert set(found.causes) == {LASTING.name, PASSING.name}
    assert found.next_experiment == UNLOADED


def test_a_machine_that_gives_way_turns_where_it_was_recorded(tmp_path: Path) -> None:
    """The indenter turns at a smaller travel, so there is less lasting damage."""
    secrets = [Secret(COMPLIANCE, 0.02), Secret(LASTING, 0.5)]
    make_dataset(tmp_path, secrets, 32, Formula(), unloaded=True)
    suspects = {e.name: e for e in (LASTING, PASSING, COMPLIANCE)}
    found = rf.discover(tmp_path, suspects, runs=Formula())
    assert set(found.causes) == {COMPLIANCE.name, LASTING.name}
    for secret in secrets:
        assert secret.effect is not None
        low, high = found.interval(secret.effect.name)
        assert low < secret.amplitude < high


def test_all_effects_are_suspected_where_there_is_unloading(folder: Path, tmp_path: Path) -> None:
    from ramiefenics.discovery import suspects_of

    assert suspects_of(rf.read_dataset(folder)) == rf.EFFECTS
    make_dataset(tmp_path, Secret(None), 31, Formula())
    assert suspects_of(rf.read_dataset(tmp_path)) == SUSPECTS


def test_holding_alone_is_no_other_test() -> None:
    held = [["protocol.then=[{hold_s=10}]"]]
    with pytest.raises(rf.SpecificationError, match=r"must include unloading"):
        rf.plan("table3", held, effects={COMPLIANCE.name: COMPLIANCE}, runs=Formula())


@pytest.mark.slow
def test_fibres_that_yield_are_found_by_unloading(tmp_path: Path) -> None:
    """Finite elements throughout, with few specimens."""
    names = ("fibre_yield", "fibre_strength", "irreversible_damage")
    effect = rf.EFFECTS["fibre_yield"]
    with workers() as pool:
        runs = Runs(tmp_path / "runs", pool)
        secret = Secret(effect, effect.typical)
        make_dataset(
            tmp_path / "data",
            secret,
            SEED,
            runs,
            4,
            FINE,
            finer(FINE),
            travel_mm=8.0,
            unloaded=True,
        )
        path = tmp_path / "data/dataset.toml"
        layout = tomllib.loads(path.read_text())
        layout["mesh"] = {**to_dict(COARSE), "name": "coarse"}
        path.write_text(tomli_w.dumps(layout))
        found = rf.discover(tmp_path / "data", {n: rf.EFFECTS[n] for n in names}, runs=runs)
    assert found.verdict == "cause"
    assert found.causes == (effect.name,)

"""Comparison of measured and simulated curves; results read back from folders."""

from __future__ import annotations

import json
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest
from folders import check_folder, check_print
from formula import Formula

import ramiefenics as rf
from ramiefenics.discovery.synthetic import Secret, make_dataset
from ramiefenics.runs import Runs, simulation
from ramiefenics.solve.reading import read_bend

pytestmark = pytest.mark.filterwarnings("ignore::ramiefenics.SpecificationWarning")


@pytest.fixture
def dataset(tmp_path: Path) -> rf.Dataset:
    make_dataset(tmp_path / "data", Secret(None), 41, Formula(), specimens=3)
    return rf.read_dataset(tmp_path / "data")


def test_a_curve_is_told_from_the_simulation_by_what_it_has_less(
    dataset: rf.Dataset, as_result: Callable[..., rf.BendingResult], tmp_path: Path
) -> None:
    """The simulations are the first record itself, and the same with a tenth more force."""
    first = dataset.records[0]
    x, force = (first.curve[name].to_numpy() for name in ("displacement_mm", "force_N"))
    given = {"same": as_result(first.test, x, force), "more": as_result(first.test, x, 1.1 * force)}
    found = rf.compare(dataset, given)
    assert len(found.pairs) == 2 * len(dataset.records)
    table = found.table[found.table["measured"] == first.name].set_index("simulated")
    assert table.loc["same", "rms_N"] < 1e-12
    assert table.loc["more", "max_error_percent"] == pytest.approx(10.0)
    at = found.pairs[0].at_mm
    expected = 0.1 * np.sqrt(np.mean(np.interp(at, x, force) ** 2))
    assert table.loc["more", "rms_N"] == pytest.approx(expected)
    check_print(found)
    rf.write_folder(found, tmp_path / "found")
    check_folder(tmp_path / "found")
    assert (tmp_path / "found" / "comparison.png").exists()


def test_by_default_every_test_is_simulated_as_it_was_made(
    dataset: rf.Dataset,
    as_result: Callable[..., rf.BendingResult],
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
) -> None:
    asked: list[rf.BendingTest] = []

    def simulate(test: rf.BendingTest, *_: object) -> rf.BendingResult:
        asked.append(test)
        x = np.linspace(0.0, test.protocol.travel_mm, 15)
        return as_result(test, x, test.stalk.void_diameter_mm * x)

    monkeypatch.setattr(simulation, "simulate", simulate)
    with ThreadPoolExecutor(1) as pool:
        found = rf.compare(dataset, runs=Runs(tmp_path / "kept", pool))
    voids = [record.test.stalk.void_diameter_mm for record in dataset.records]
    assert sorted(test.stalk.void_diameter_mm for test in asked) == sorted(voids)
    assert found.table["simulated_max_N"].to_numpy() == pytest.approx(14.0 * np.array(voids))


def test_curves_without_a_common_displacement_are_refused(
    dataset: rf.Dataset, as_result: Callable[..., rf.BendingResult]
) -> None:
    x = np.linspace(30.0, 40.0, 5)
    given = {"far": as_result(dataset.records[0].test, x, x)}
    with pytest.raises(rf.SpecificationError, match="must reach displacements of"):
        _ = rf.compare(dataset, given).table


def test_a_folder_of_results_is_read_back(coarse: rf.BendingTest, tmp_path: Path) -> None:
    result = rf.simulate(rf.override(coarse, ["protocol.travel_mm=0.5"]))
    rf.write_folder(result, tmp_path / "run")
    again = rf.read_folder(tmp_path / "run")
    assert again.test == result.test
    assert again.ending == result.ending
    assert again.statistics == result.statistics
    assert again.max_force_N == pytest.approx(result.max_force_N, rel=1e-7)
    assert list(again.curve) == list(result.curve)
    assert again.curve.to_numpy(float) == pytest.approx(
        result.curve.to_numpy(float), rel=1e-6, abs=1e-7, nan_ok=True
    )


@pytest.mark.parametrize("spoilt", ["curve.csv", "summary.json", "specification.toml"])
def test_no_folder_of_results_is_told(
    spoilt: str, as_result: Callable[..., rf.BendingResult], coarse: rf.BendingTest, tmp_path: Path
) -> None:
    folder = tmp_path / "run"
    folder.mkdir()
    with pytest.raises(rf.SpecificationError, match="must be a folder of results"):
        rf.read_folder(folder)
    with pytest.raises(rf.SpecificationError, match=r"has no specification\.toml"):
        read_bend(folder)
    rf.write_test(coarse, folder / "specification.toml")
    (folder / "curve.csv").write_text("displacement_mm,force_N\n0,0\n")
    (folder / "summary.json").write_text(json.dumps({"ending": {"kind": "completed"}}))
    (folder / spoilt).write_bytes(b"\xff\x00{")
    with pytest.raises(rf.SpecificationError, match=r"must hold intact|is not valid TOML"):
        read_bend(folder)

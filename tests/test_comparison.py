"""Comparison of measured and simulated curves; results read back from folders."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import pandas as pd
import pytest
from folders import check_folder, check_print
from formula import Formula
from matplotlib.figure import Figure

import ramiefenics as rf
from ramiefenics.discovery.synthetic import Secret, make_dataset
from ramiefenics.results.result import Picture, Result, Table
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


def test_a_simulation_of_another_test_is_told(
    dataset: rf.Dataset, as_result: Callable[..., rf.BendingResult]
) -> None:
    first = dataset.records[0]
    x, force = (first.curve[name].to_numpy() for name in ("displacement_mm", "force_N"))
    one = dataclasses.replace(dataset, records=(first,))
    assert rf.compare(one, as_result(first.test, x, force)).notes() == []
    other = rf.override(first.test, ["fixture.span_mm=60", "fixture.support_radius_mm=4"])
    (note,) = rf.compare(one, {"short": as_result(other, x, force)}).notes()
    measured = first.test.fixture
    assert note == (
        f"short is not the test that was measured: span 60 mm, not {measured.span_mm:g} mm; "
        f"support radius 4 mm, not {measured.support_radius_mm:g} mm"
    )


def test_no_error_of_a_maximum_that_is_not_reached(
    dataset: rf.Dataset, as_result: Callable[..., rf.BendingResult]
) -> None:
    record = dataset.records[0]
    x = np.linspace(0.0, 1.0, 5)
    found = rf.compare(dataset, {"short": as_result(record.test, x, x)})
    assert found.table["max_error_percent"].isna().all()
    assert "error of the maximum unknown, as the measured maximum is not reached" in repr(found)


def test_given_simulations_are_results_or_folders(
    coarse: rf.BendingTest, dataset: rf.Dataset, tmp_path: Path
) -> None:
    result = rf.simulate(rf.override(coarse, ["protocol.travel_mm=1"]))
    rf.write_folder(result, tmp_path / "run")
    expected = rf.compare(dataset, {"run": result}).table["rms_N"].to_numpy()
    for given in (result, tmp_path / "run", str(tmp_path / "run"), {"a": tmp_path / "run"}):
        assert rf.compare(dataset, given).table["rms_N"].to_numpy() == pytest.approx(expected)
    for wrong in ({}, 3, {"a": None}):
        with pytest.raises(rf.SpecificationError, match="must be a result of simulate"):
            rf.compare(dataset, wrong)  # type: ignore[arg-type]


def test_names_of_digits_stay_text_when_read_and_written_again(
    dataset: rf.Dataset, as_result: Callable[..., rf.BendingResult], tmp_path: Path
) -> None:
    first = dataset.records[0]
    x, force = (first.curve[name].to_numpy() for name in ("displacement_mm", "force_N"))
    records = (dataclasses.replace(first, name="01"), dataclasses.replace(first, name="NA"))
    found = rf.compare(
        dataclasses.replace(dataset, records=records), {"007": as_result(first.test, x, force)}
    )
    rf.write_folder(found, tmp_path / "one")
    again = rf.read_folder(tmp_path / "one")
    assert list(again.tables()["comparison"].data["measured"]) == ["01", "NA"]
    curves = again.to_xarray()
    assert curves["measured_N"].dims == ("pair", "displacement_mm")
    assert float(curves["measured_N"].max()) == pytest.approx(found.pairs[0].measured_N.max())
    rf.write_folder(again, tmp_path / "two")
    check_same_files(tmp_path / "one", tmp_path / "two")


@dataclasses.dataclass(frozen=True, repr=False)
class Small(Result):
    """A result with a subfolder, a name of the summary, a table without columns, and a text."""

    PLACE: ClassVar[str] = "inner"
    SUMMARY: ClassVar[str] = "own.json"
    title: ClassVar[str] = "Small"

    def findings(self) -> list[str]:
        return ["It is small."]

    def numbers(self) -> dict[str, Any]:
        return {}

    def tables(self) -> dict[str, Table]:
        return {"empty": Table(pd.DataFrame(), "Nothing.")}

    def figures(self) -> dict[str, Picture]:
        return {"line": Picture(Figure, "Nothing.")}

    def write_more(self, folder: Path) -> None:
        (folder / "page.md").write_text("text\n")


def test_a_result_is_read_from_the_folder_that_was_written(tmp_path: Path) -> None:
    rf.write_folder(Small(), tmp_path / "one")
    again = rf.read_folder(tmp_path / "one")
    assert again.tables()["empty"].data.empty
    with pytest.raises(rf.SpecificationError, match="has no table of curves"):
        again.to_xarray()
    rf.write_folder(again, tmp_path / "two")
    check_same_files(tmp_path / "one", tmp_path / "two")
    assert rf.read_folder(tmp_path / "two" / "inner").summary() == Small().summary()
    with pytest.raises(rf.SpecificationError, match="must be a folder of results"):
        rf.read_folder(tmp_path)


def check_same_files(one: Path, two: Path) -> None:
    """Check that two folders have the same files, with the same content unless it is a picture."""
    names = [p.relative_to(one) for p in sorted(one.rglob("*")) if p.is_file()]
    assert names == [p.relative_to(two) for p in sorted(two.rglob("*")) if p.is_file()]
    for name in names:
        if name.suffix not in (".png", ".html"):  # the page contains the pictures
            assert (one / name).read_bytes() == (two / name).read_bytes(), name


def test_a_bend_that_is_read_back_keeps_its_pictures(
    coarse: rf.BendingTest, tmp_path: Path
) -> None:
    result = rf.simulate(rf.override(coarse, ["protocol.travel_mm=0.5"]))
    rf.write_folder(result, tmp_path / "run")
    again = rf.read_folder(tmp_path / "run")
    assert list(again.figures()) == ["curve", "section", "deformed"]
    assert again.plot("section").axes[0].images
    (tmp_path / "run" / "section.png").unlink()
    assert list(rf.read_folder(tmp_path / "run").figures()) == ["curve", "deformed"]

"""Shipped stalks, compared with the printed tables."""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import ramiefenics as rf
from ramiefenics import SpecificationError, SpecificationWarning, published_test, ramie_at_height
from ramiefenics.cli import main
from ramiefenics.measured import RawCurve
from ramiefenics.published.citation import STUDY


def test_calibration_stalk_is_table_3_with_table_7() -> None:
    with pytest.warns(SpecificationWarning, match=r"3\.09 MPa .* Eq\. 4 gives 0\.88"):
        test = published_test("table3")
    xylem, phloem = test.stalk.layers
    assert (test.stalk.void_diameter_mm, phloem.outer_diameter_mm) == (7.28, 14.23)
    assert (phloem.outer_diameter_mm - xylem.outer_diameter_mm) / 2 == pytest.approx(0.67)
    assert xylem.material.elastic.nu_XY == 0.32
    assert phloem.material.elastic.nu_XY == 0.29
    assert test.fixture.friction.dynamic == 0.12
    assert test.fixture.friction.static == 0.59
    assert (test.fixture.span_mm, test.protocol.travel_mm) == (100.0, 14.0)


@pytest.mark.filterwarnings("ignore::ramiefenics.SpecificationWarning")
@pytest.mark.parametrize(
    ("name", "outer", "inner", "phloem"),
    [
        ("table8-1", 15.1, 7.5, 0.72),
        ("table8-2", 14.3, 7.45, 0.64),
        ("table8-3", 14.7, 7.5, 0.65),
    ],
)
def test_validation_stalks_are_table_8(
    name: str, outer: float, inner: float, phloem: float
) -> None:
    radii = published_test(name).stalk.radii_mm
    assert radii == pytest.approx((inner / 2, outer / 2 - phloem, outer / 2))


def test_stalk_at_height_interpolates_table_1() -> None:
    assert ramie_at_height(0.0).stalk.outer_diameter_mm == 15.70
    assert ramie_at_height(150.0).stalk.void_diameter_mm == pytest.approx(6.20)
    middle = ramie_at_height(75.0).stalk
    assert middle.outer_diameter_mm == pytest.approx((15.70 + 10.90) / 2)
    # the phloem's share of the section is Table 1's ratio of fresh cortex to stalk
    inner, wood, outer = middle.radii_mm
    assert (outer**2 - wood**2) / (outer**2 - inner**2) == pytest.approx(0.2142)


@pytest.mark.filterwarnings("ignore::ramiefenics.SpecificationWarning")
def test_height_by_name() -> None:
    assert published_test("height-69cm") == ramie_at_height(69.0)
    assert published_test("height-12.5cm") == ramie_at_height(12.5)


def test_an_unknown_name_is_told_what_is_known() -> None:
    with pytest.raises(SpecificationError, match=r"table3, .*, height-NNcm, or a TOML file"):
        published_test("tabel3")


@pytest.mark.parametrize("height", [-1.0, 151.0])
def test_height_outside_table_1_is_refused(height: float) -> None:
    with pytest.raises(SpecificationError, match="between 0 and 150"):
        ramie_at_height(height)


def test_ramies_constants_are_told_where_a_data_set_gets_them(tmp_path: Path) -> None:
    travel = np.linspace(0.0, 14.0, 57)
    curve = pd.DataFrame({"displacement_mm": travel, "force_N": 6.0 * travel})
    records = {"stalk": RawCurve(tmp_path / "stalk.csv", curve)}
    rf.write_test(rf.ramie(14.23, 7.28, 0.67), tmp_path / "mine.toml")
    with warnings.catch_warnings():
        warnings.simplefilter("error")  # nothing to tell of constants that are stated
        own = rf.read_dataset(
            rf.write_dataset(records, tmp_path / "own", str(tmp_path / "mine.toml"))
        )
    with pytest.warns(SpecificationWarning, match="ramie's constants") as told:
        study = rf.read_dataset(rf.write_dataset(records, tmp_path / "study", "table3"))
    assert STUDY in str(told[-1].message)
    assert own.baseline == study.baseline


def test_ramies_friction_is_told_where_a_file_leaves_it_out(tmp_path: Path) -> None:
    test = rf.ramie(14.23, 7.28, 0.67)
    path = tmp_path / "mine.toml"
    rf.write_test(test, path)
    stated = path.read_text()
    path.write_text(stated.replace("static = 0.59\n", ""))
    with pytest.warns(SpecificationWarning, match=r"mine\.toml does not state .*, static = 0\.59$"):
        assert rf.read_test(path) == test


def test_raw_files_ask_for_a_baseline(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    out = str(tmp_path / "set")
    command = ["ramiefenics", "import", "a.csv", "--format", "headings", "--out", out]
    monkeypatch.setattr("sys.argv", command)
    with pytest.raises(SystemExit, match="2"):
        main()
    assert "--baseline" in capsys.readouterr().err


@pytest.mark.parametrize(
    "page",
    [
        "README.md",
        "CITATION.cff",
        "docs/published_tables.md",
        "ramiefenics/published/data/README.md",
    ],
)
def test_pages_cite_the_study(page: str) -> None:
    text = (Path(__file__).parents[1] / page).read_text()
    assert STUDY in " ".join(text.split())

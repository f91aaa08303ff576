"""Folders of measured data: what is read, and how every defect is told."""

from pathlib import Path

import numpy as np
import pytest

import ramiefenics as rf

pytestmark = pytest.mark.filterwarnings("ignore::ramiefenics.SpecificationWarning")

LAYOUT = """
baseline = "table3"
speed_mm_per_min = 10
fixture = { indenter_radius_mm = 4 }

[specimens]
"stalk.void_diameter_mm" = "void"
"stalk.position_mm" = "height"

[columns]
displacement = "crosshead"
force = "load"

[units]
specimens = "cm"
displacement = "um"
force = "kN"
"""
SPECIMENS = "specimen,void,height,curve\nA,0.72,10,a.csv\nB,0.74,20,b.csv\n"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "dataset.toml").write_text(LAYOUT)
    (tmp_path / "specimens.csv").write_text(SPECIMENS)
    for name, end in (("a", 12000), ("b", 14000)):
        travel = np.linspace(0, end, 50)
        rows = [f"{d:.1f},{7e-6 * d:.6f}" for d in travel]
        (tmp_path / f"{name}.csv").write_text("\n".join(["crosshead,load", *rows]) + "\n")
    return tmp_path


def replace(path: Path, old: str, new: str) -> None:
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new, 1))


def test_values_go_to_the_specification_in_its_units(folder: Path) -> None:
    data = rf.read_dataset(folder)
    assert data.baseline.fixture.indenter_radius_mm == 4.0
    assert [s.test.stalk.void_diameter_mm for s in data.specimens] == pytest.approx([7.2, 7.4])
    assert [s.test.stalk.position_mm for s in data.specimens] == pytest.approx([100.0, 200.0])
    curve = data.specimens[0].curve
    assert curve["displacement_mm"].iloc[-1] == pytest.approx(12.0)
    assert curve["force_N"].iloc[-1] == pytest.approx(84.0)
    assert data.range_mm == (0.0, pytest.approx(12.0))


def test_several_columns_are_averaged(folder: Path) -> None:
    replace(folder / "dataset.toml", '= "void"', '= ["void", "height"]')
    replace(folder / "specimens.csv", "A,0.72,10", "A,0.7,0.8")
    replace(folder / "specimens.csv", "B,0.74,20", "B,0.7,0.7")
    first = rf.read_dataset(folder).specimens[0]
    assert first.test.stalk.void_diameter_mm == pytest.approx(7.5)


def test_a_baseline_may_be_a_file(folder: Path) -> None:
    rf.write_test(rf.ramie(15.0, 7.0, 0.7), folder / "mine.toml")
    replace(folder / "dataset.toml", '"table3"', '"mine.toml"')
    assert rf.read_dataset(folder).baseline.stalk.outer_diameter_mm == 15.0


DEFECTS = [
    ("dataset.toml", "speed_", "sped_", r"dataset\.toml.*sped_mm_per_min.*speed_mm_per_min"),
    ("dataset.toml", '"table3"', '"table9"', r"table9.*must be one of"),
    ("dataset.toml", "indenter_radius_mm = 4", "indenter_radius_mm = -4", r"above 0"),
    ("dataset.toml", '"stalk.void', '"stalk.viod', r"specimens\.csv, row 2 \(A\).*viod"),
    ("dataset.toml", '"um"', '"furlong"', r"furlong.*must be one of um, mm"),
    ("dataset.toml", '"load"', '"lod"', r"a\.csv = 'lod'.*crosshead, load"),
    (
        "dataset.toml",
        "speed",
        "to_mm = 13\nspeed",
        r"to_mm = 13\.0 must be at most 12 mm.*curve of A ends",
    ),
    ("dataset.toml", "speed", "from_mm = 13\nspeed", r"above from_mm = 13"),
    ("dataset.toml", "speed", "fit_sd = 0\nspeed", r"fit_sd = 0 must be a number above 0"),
    ("dataset.toml", "speed", 'to_mm = "end"\nspeed', r"dataset\.toml\.to_mm = 'end'.*a number"),
    ("dataset.toml", '"load"', "7", r"dataset\.toml\.columns\.force = 7 must be text"),
    ("dataset.toml", '= "height"', "= 7", r"specimens\.stalk\.position_mm = 7 must be the name"),
    ("dataset.toml", "speed", 'fit = "all"\nspeed', r"dataset\.toml\.fit = 'all' must be a list"),
    ("dataset.toml", "speed", "= =", r"not valid TOML"),
    ("specimens.csv", "0.72", "wide", r"specimens\.csv, row 2, column void = 'wide'.*a number"),
    ("specimens.csv", "0.74", "", r"specimens\.csv, row 3, column void = ''"),
    ("specimens.csv", "0.74", "2.74", r"row 3 \(B\).*above void_diameter_mm"),
    ("specimens.csv", "\nB", "\nA", r"row 3, specimen = 'A' must not occur twice"),
    ("specimens.csv", "b.csv", "c.csv", r"c\.csv.*No such file"),
    ("specimens.csv", SPECIMENS[27:], "", r"at least one row"),
    ("b.csv", "571.4,", "571.4,x", r"b\.csv, row 4, column load = 'x.*a number"),
    ("b.csv", "\n571.4", "\n3571.4", r"b\.csv, row 5.*must not go back.*unloading"),
]


@pytest.mark.parametrize(("file", "old", "new", "message"), DEFECTS)
def test_every_defect_names_its_place(
    folder: Path, file: str, old: str, new: str, message: str
) -> None:
    replace(folder / file, old, new)
    with pytest.raises(rf.SpecificationError, match=message) as caught:
        rf.read_dataset(folder)
    assert "\n" not in str(caught.value)


def test_tension_positive_forces_are_told(folder: Path) -> None:
    text = (folder / "a.csv").read_text().replace(",0", ",-0")
    (folder / "a.csv").write_text(text)
    with pytest.raises(rf.SpecificationError, match=r"largest force.*turn the sign"):
        rf.read_dataset(folder)


def test_too_short_a_curve_is_told(folder: Path) -> None:
    lines = (folder / "a.csv").read_text().splitlines()[:10]
    (folder / "a.csv").write_text("\n".join(lines))
    with pytest.raises(rf.SpecificationError, match=r"a\.csv, number of rows = 9 must be at"):
        rf.read_dataset(folder)


def test_no_folder_is_told(tmp_path: Path) -> None:
    with pytest.raises(rf.SpecificationError, match="must be a folder with a dataset"):
        rf.read_dataset(tmp_path / "nowhere")

"""Several curves of one specimen, and what follows a loading: reading, and errors."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import ramiefenics as rf
from ramiefenics.calibration.study import read_study
from ramiefenics.measured.record import POINTS

pytestmark = pytest.mark.filterwarnings("ignore::ramiefenics.SpecificationWarning")

LAYOUT = """
baseline = "table3"

[specimens]
"stalk.void_diameter_mm" = "void"

[tests]
"fixture.span_mm" = "span"
"fixture.indenter_radius_mm" = "radius"
"stalk.rotation_deg" = "turned"
"protocol.speed_mm_per_s" = "speed"
"""
SPECIMENS = "specimen,void,genotype\nA,7.2,x\nB,7.4,y\n"
TESTS = """\
specimen,test,span,radius,turned,speed,curve
A,,100,5,0,0.5,a1.csv
B,,100,5,0,0.5,b1.csv
A,short,80,4,0,0.5,a2.csv
B,turned,100,5,90,2,b2.csv
A,,80,4,0,2,a3.csv
"""
STIFFNESS = {"a1": 7.0, "a2": 10.0, "a3": 11.0, "b1": 6.0, "b2": 6.5}
ENDS_MM = {"a1": 14.0, "a2": 9.0, "a3": 9.0, "b1": 12.0, "b2": 13.0}


def write_curve(path: Path, travel: np.ndarray, force: np.ndarray) -> None:
    pd.DataFrame({"displacement_mm": travel, "force_N": force}).to_csv(path, index=False)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "dataset.toml").write_text(LAYOUT)
    (tmp_path / "specimens.csv").write_text(SPECIMENS)
    (tmp_path / "tests.csv").write_text(TESTS)
    for name, stiffness in STIFFNESS.items():
        travel = np.linspace(0.0, ENDS_MM[name], 57)
        write_curve(tmp_path / f"{name}.csv", travel, stiffness * travel)
    return tmp_path


def replace(path: Path, old: str, new: str) -> None:
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new, 1))


def test_records_are_tests_of_specimens(folder: Path) -> None:
    data = rf.read_dataset(folder)
    assert data.specimens == ("A", "B")
    assert [r.name for r in data.records] == ["A 1", "A short", "A 3", "B 1", "B turned"]
    assert [r.specimen for r in data.records] == ["A", "A", "A", "B", "B"]
    tests = {r.name: r.test for r in data.records}
    assert [t.fixture.span_mm for t in tests.values()] == [100.0, 80.0, 80.0, 100.0, 100.0]
    assert [t.fixture.indenter_radius_mm for t in tests.values()] == [5.0, 4.0, 4.0, 5.0, 5.0]
    assert [t.protocol.speed_mm_per_s for t in tests.values()] == [0.5, 0.5, 2.0, 0.5, 2.0]
    assert {t.stalk.void_diameter_mm for t in tests.values()} == {7.2, 7.4}
    assert tests["A 1"].stalk == tests["A short"].stalk
    assert data.records[1].row["genotype"] == "x"
    assert data.records[1].row["span"] == "80"


def test_a_turned_stalk_is_on_the_full_domain(folder: Path) -> None:
    tests = {r.name: r.test for r in rf.read_dataset(folder).records}
    assert tests["B turned"].stalk.rotation_deg == 90.0
    assert {name for name, t in tests.items() if t.numerics.domain == "full"} == {"B turned"}
    assert tests["A 1"].numerics.domain == "quarter"


def test_each_curve_is_compared_to_its_own_end(folder: Path) -> None:
    replace(folder / "dataset.toml", "[specimens]", "from_mm = 1\n[specimens]")
    for record in rf.read_dataset(folder).records:
        end = ENDS_MM[record.row["curve"].removesuffix(".csv")]
        assert record.at_mm == pytest.approx(np.linspace(1.0, end, POINTS + 1)[1:])
    replace(folder / "dataset.toml", "from_mm = 1", "to_mm = 8")
    assert {record.at_mm[-1] for record in rf.read_dataset(folder).records} == {8.0}
    replace(folder / "dataset.toml", "to_mm = 8", "to_mm = 10")
    with pytest.raises(rf.SpecificationError, match=r"to_mm = 10\.0 .* 9 mm, .* of A short ends"):
        rf.read_dataset(folder)


def test_a_specimen_of_one_test_gives_it_its_name(folder: Path) -> None:
    replace(folder / "tests.csv", "B,,100,5,0,0.5,b1.csv\n", "")
    assert [r.name for r in rf.read_dataset(folder).records][-1] == "B"


DEFECTS = [
    ("tests.csv", "B,turned", "C,turned", r"tests\.csv, row 5, specimen = 'C' must be a spec"),
    (
        "specimens.csv",
        "B,7.4",
        "C,7.5,z\nB,7.4",
        r"specimens\.csv, row 3 = 'C' must have",
    ),
    ("tests.csv", "b2.csv", "b1.csv", r"tests\.csv, row 5, curve = 'b1\.csv' .* of row 3, B 1; r"),
    ("tests.csv", "b2.csv", "", r"tests\.csv, row 5, column curve = '' must not be empty"),
    ("tests.csv", ",turned,", ",bent,", r"tests\.csv.*turned.* is not among its columns"),
    ("dataset.toml", '"stalk.rotation_deg" = "turned"', "", r"heading = 'turned' must be a column"),
    ("dataset.toml", "rotation_deg", "turn_deg", r"tests\.csv, row 2 \(A 1\)\.stalk\.turn_deg = 0"),
    ("tests.csv", "A,short,80", "A,short,0.1", r"row 4 \(A short\)\.fixture\.span_mm = 0\.1 must"),
    ("tests.csv", "A,short,80", "A,short,wide", r"row 4, column span = 'wide' must be a number"),
    ("tests.csv", "A,,80", "A,short,80", r"row 6, test = 'short' must be unique: tests\.csv, r"),
    (
        "specimens.csv",
        "genotype",
        "curve",
        r"specimens\.csv, row 2, column curve = 'x' must be emp",
    ),
    ("dataset.toml", '= "speed"', "= 7", r"dataset\.toml\.tests\.protocol\.speed_mm_per_s = 7 mus"),
]


@pytest.mark.parametrize(("file", "old", "new", "message"), DEFECTS)
def test_every_defect_names_its_place(
    folder: Path, file: str, old: str, new: str, message: str
) -> None:
    replace(folder / file, old, new)
    with pytest.raises(rf.SpecificationError, match=message) as caught:
        rf.read_dataset(folder)
    assert "\n" not in str(caught.value)


def test_tests_that_the_layout_maps_must_be_listed(folder: Path) -> None:
    (folder / "tests.csv").unlink()
    with pytest.raises(
        rf.SpecificationError, match=r"dataset\.toml\.tests = .* needs a tests\.csv"
    ):
        rf.read_dataset(folder)


def test_reduction_tells_tests_of_a_specimen_apart(folder: Path) -> None:
    found = rf.reduce_dataset(folder, by="span")
    table = found.curves.set_index("record")
    assert table["specimen"].to_dict()["A short"] == "A"
    assert table["slope_N_per_mm"].to_numpy() == pytest.approx([7.0, 10.0, 11.0, 6.0, 6.5])
    assert table["span_mm"].to_list() == [100.0, 80.0, 80.0, 100.0, 100.0]
    assert table["group"].to_list() == ["100", "80", "80", "100", "100"]
    assert found.numbers()["specimens"] == 2
    assert "several curves of the same specimen" in " ".join(found.notes())
    (folder / "tests.csv").write_text(TESTS.replace("A,,80,4,0,2,a3.csv\n", ""))
    assert "same specimen" not in " ".join(rf.reduce_dataset(folder, by="test").notes())


def test_strength_is_that_of_the_section_as_it_lies(folder: Path) -> None:
    """For a turned ellipse it is M / W, with W = pi (w h^3 - that of the void) / (32 h)."""
    rf.write_test(
        rf.override(rf.ramie(15.0, 7.0, 0.7), ["stalk.section_height_mm=10"]),
        folder / "oval.toml",
    )
    replace(folder / "dataset.toml", '"table3"', '"oval.toml"')
    table = rf.reduce_dataset(folder).curves.set_index("record").loc[["B 1", "B turned"]]
    void = 7.4
    upright = np.pi * (15.0 * 10.0**3 - void * (void * 10.0 / 15.0) ** 3) / (32.0 * 10.0)
    turned = np.pi * (10.0 * 15.0**3 - void**3 * (void * 10.0 / 15.0)) / (32.0 * 15.0)
    assert table["section_modulus_mm3"].to_list() == pytest.approx([upright, turned])
    moments = np.array([6.0 * 12.0, 6.5 * 13.0]) * 100.0 / 4.0
    assert table["strength_MPa"].to_numpy() == pytest.approx(moments / [upright, turned])
    assert table["height_mm"].to_list() == [10.0, 15.0]


def test_several_curves_of_a_specimen_are_no_target(folder: Path, tmp_path: Path) -> None:
    study = tmp_path / "study.toml"
    study.write_text(
        'baseline = "table3"\n[design]\nkind = "latin_hypercube"\n'
        '[[factors]]\nname = "xylem"\nlow = 100\nhigh = 200\n'
        'keys = ["stalk.layers.xylem.material.elastic.E_Z_MPa"]\n'
        f'[[responses]]\nname = "slope_N_per_mm"\ndataset = "{folder}"\n'
    )
    with pytest.raises(rf.SpecificationError, match=r"curves in .* = 5 must be one per specimen"):
        read_study(study).targets()


def there_and_back(top_mm: float, held: int) -> tuple[np.ndarray, np.ndarray]:
    """Return loading at 7 N/mm, a hold in which a tenth relaxes, and unloading at 9 N/mm."""
    up = np.linspace(0.0, top_mm, 57)
    stay = np.full(held, top_mm) - 1e-4 * (np.arange(held) % 2)
    down = np.linspace(top_mm, 3.0, 40)[1:]
    relaxed = 7.0 * top_mm * np.linspace(1.0, 0.9, held) if held else np.zeros(0)
    last = relaxed[-1] if held else 7.0 * top_mm
    return np.concatenate([up, stay, down]), np.concatenate(
        [7.0 * up, relaxed, last + 9.0 * (down - top_mm)]
    )


FOLLOWING = '"[{ hold_s = 60.0 }, { to_mm = 3.0 }]"'


def tell_what_follows(folder: Path, text: str) -> None:
    """Add a column to tests.csv that states what follows the loading of A short."""
    lines = TESTS.splitlines()
    cells = ["then", *(text if "a2.csv" in line else "" for line in lines[1:])]
    table = [f"{line},{cell}" for line, cell in zip(lines, cells, strict=True)]
    (folder / "tests.csv").write_text("\n".join(table))
    replace(folder / "dataset.toml", "[tests]", '[tests]\n"protocol.then" = "then"')


@pytest.mark.parametrize("held", [0, 30])
def test_loading_is_compared_and_what_follows_is_kept(folder: Path, held: int) -> None:
    travel, force = there_and_back(9.0, held)
    write_curve(folder / "a2.csv", travel, force)
    with pytest.raises(rf.SpecificationError, match=r"a2\.csv.*must not go back.*unloading"):
        rf.read_dataset(folder)
    tell_what_follows(folder, FOLLOWING if held else '"[{ to_mm = 3.0 }]"')
    data = rf.read_dataset(folder)
    record = data.records[1]
    ends = [leg.to_mm for leg in record.test.protocol.legs]
    assert ends == ([9.0, 9.0, 3.0] if held else [9.0, 3.0])
    assert record.curve["displacement_mm"].to_numpy() == pytest.approx(travel[:57])
    assert record.after["force_N"].to_numpy() == pytest.approx(force[57:])
    assert record.at_mm[-1] == pytest.approx(9.0)
    assert all(other.after.empty for other in data.records if other is not record)
    (told,) = data.notes()
    assert "A short" in told
    assert "A 1" not in told
    assert told in rf.reduce_dataset(data).notes()


def test_what_follows_moves_with_the_seating(folder: Path) -> None:
    """With 7 N at the machine's zero, the toe is 1 mm before this zero."""
    travel, force = there_and_back(9.0, 0)
    write_curve(folder / "a2.csv", travel, force + 7.0)
    tell_what_follows(folder, '"[{ to_mm = 3.0 }]"')
    replace(folder / "dataset.toml", "[specimens]", '[seating]\nzero = "toe"\n[specimens]')
    record = rf.read_dataset(folder).records[1]
    assert record.curve["displacement_mm"].iloc[-1] == pytest.approx(10.0)
    assert record.after["displacement_mm"].iloc[-1] == pytest.approx(4.0)
    assert record.after["force_N"].to_numpy() == pytest.approx(force[57:] + 7.0)


def test_what_follows_may_be_the_same_for_all(folder: Path) -> None:
    for name, end in ENDS_MM.items():
        travel, force = there_and_back(end, 0)
        write_curve(folder / f"{name}.csv", travel, STIFFNESS[name] * force)
    replace(folder / "dataset.toml", "[specimens]", "then = [{ to_mm = 3 }]\n[specimens]")
    data = rf.read_dataset(folder)
    assert [r.curve["displacement_mm"].iloc[-1] for r in data.records] == [
        14.0,
        9.0,
        9.0,
        12.0,
        13.0,
    ]
    assert data.baseline.protocol.then == (rf.Target(to_mm=3.0),)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("back", r"row 4 \(A short\)\.protocol\.then = 'back' must be a list"),
        ('"[{ to = 3.0 }]"', r"row 4 \(A short\)\.protocol\.then\.0\.to = 3\.0 is an unknown key"),
        (FOLLOWING, r"a2\.csv, number of rows after the largest displacement = 0 must be above 0"),
    ],
)
def test_what_follows_must_be_told_as_it_is(folder: Path, text: str, message: str) -> None:
    tell_what_follows(folder, text)
    with pytest.raises(rf.SpecificationError, match=message) as caught:
        rf.read_dataset(folder)
    assert "\n" not in str(caught.value)

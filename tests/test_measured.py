"""Folders of measured data: what is read, and the message for every defect."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import ramiefenics as rf
from ramiefenics.discovery.curves.observed import observe

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
    assert [s.test.stalk.void_diameter_mm for s in data.records] == pytest.approx([7.2, 7.4])
    assert [s.test.stalk.position_mm for s in data.records] == pytest.approx([100.0, 200.0])
    curve = data.records[0].curve
    assert curve["displacement_mm"].iloc[-1] == pytest.approx(12.0)
    assert curve["force_N"].iloc[-1] == pytest.approx(84.0)
    # each is compared up to its own end
    assert [r.at_mm[-1] for r in data.records] == pytest.approx([12.0, 14.0])
    assert data.range_mm == (0.0, pytest.approx(14.0))


def test_curves_as_xarray_has_them(folder: Path) -> None:
    curves = rf.read_dataset(folder).to_xarray()
    assert curves.sizes["curve"] == 2
    high = curves["force_N"].where(curves["height"] > 15.0, drop=True)
    assert high["specimen"] == ["B"]
    assert high.interp(displacement_mm=7.0) == pytest.approx(49.0)  # 7 N/mm
    force = curves["force_N"].sel(displacement_mm=13.0, method="nearest")
    assert force.isnull().sel(curve="A")  # which ends at 12 mm
    assert not force.isnull().sel(curve="B")


def test_several_columns_are_averaged(folder: Path) -> None:
    replace(folder / "dataset.toml", '= "void"', '= ["void", "height"]')
    replace(folder / "specimens.csv", "A,0.72,10", "A,0.7,0.8")
    replace(folder / "specimens.csv", "B,0.74,20", "B,0.7,0.7")
    first = rf.read_dataset(folder).records[0]
    assert first.test.stalk.void_diameter_mm == pytest.approx(7.5)


def test_a_group_is_a_word_even_if_it_looks_like_a_number(folder: Path) -> None:
    replace(folder / "dataset.toml", '"stalk.position_mm" = "height"', '"group" = "height"')
    assert [record.test.group for record in rf.read_dataset(folder).records] == ["10", "20"]


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
    (
        "dataset.toml",
        '"stalk.position_mm" = "height"',
        '"group" = ["void", "height"]',
        r"dataset\.toml, group = \['void', 'height'\] must be a single column",
    ),
    (
        "dataset.toml",
        '"stalk.position_mm" = "height"',
        '"group" = "void"',
        r"row 2 \(A\).*group = '0\.72' must be one word",
    ),
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
    with pytest.raises(rf.SpecificationError, match=r"largest force.*reverse the sign"):
        rf.read_dataset(folder)


def test_too_short_a_curve_is_told(folder: Path) -> None:
    lines = (folder / "a.csv").read_text().splitlines()[:10]
    (folder / "a.csv").write_text("\n".join(lines))
    with pytest.raises(rf.SpecificationError, match=r"a\.csv, number of rows = 9 must be at"):
        rf.read_dataset(folder)


def test_no_folder_is_told(tmp_path: Path) -> None:
    with pytest.raises(rf.SpecificationError, match="must be a folder with a dataset"):
        rf.read_dataset(tmp_path / "nowhere")


def rewrite(path: Path, change: Callable[[list[list[str]]], list[list[str]]]) -> None:
    """Change the cells of a CSV file, line by line."""
    lines = [line.split(",") for line in path.read_text().splitlines()]
    path.write_text("\n".join(",".join(cells) for cells in change(lines)) + "\n")


CURVES = {
    "one cell too many": (
        lambda rows: [*rows[:5], [*rows[5], "7"], *rows[6:]],
        r"b\.csv, row 6, number of cells = 3 must be 2, one for each column \(crosshead, load\)",
    ),
    "one cell too many in every row": (
        lambda rows: [rows[0], *([str(i), *row] for i, row in enumerate(rows[1:]))],
        r"b\.csv, row 2, number of cells = 3 must be 2",
    ),
    "one cell too few": (
        lambda rows: [*rows[:5], rows[5][:1], *rows[6:]],
        r"b\.csv, row 6, number of cells = 1 must be 2",
    ),
    "decimal commas": (
        lambda rows: [[cell.replace(".", ",") for cell in row] for row in rows],
        r"b\.csv, row 2, number of cells = 4 must be 2.*no comma is a decimal comma",
    ),
    "semicolons": (
        lambda rows: [[";".join(row)] for row in rows],
        r"b\.csv, heading = 'crosshead;load' must name two columns or more, with commas",
    ),
    "a heading twice": (
        lambda rows: [["load", "load"], *rows[1:]],
        r"b\.csv, heading = 'load' must not occur twice",
    ),
    "a quotation mark": (
        lambda rows: [*rows[:5], ['"' + rows[5][0], rows[5][1]], *rows[6:]],
        r"b\.csv, row 6 = .*must have complete cells, with quotation marks closed",
    ),
    "a blank line, counted": (
        lambda rows: [*rows[:5], [""], ["x", "1"], *rows[7:]],
        r"b\.csv, row 7, column crosshead = 'x'",
    ),
    "not a number": (
        lambda rows: [*rows[:5], [rows[5][0], "nan"], *rows[6:]],
        r"b\.csv, row 6, column load = 'nan' must be a number",
    ),
    "no number of ours": (
        lambda rows: [*rows[:5], [rows[5][0], "1_0"], *rows[6:]],
        r"b\.csv, row 6, column load = '1_0' must be a number",
    ),
    "1e301": (
        lambda rows: [*rows[:5], [rows[5][0], "1e301"], *rows[6:]],
        r"b\.csv, row 6, column load = '1e301' must be .* within ±1e\+15",
    ),
    "stronger than any machine": (
        lambda rows: [*rows[:5], [rows[5][0], "150"], *rows[6:]],  # kN
        r"b\.csv, row 6, force_N = 150000\.0 must be within ±100000 N",
    ),
    "stronger than any fibre": (
        lambda rows: [[rows[0][0], "load"], *([d, f"{1e3 * float(f):.3f}"] for d, f in rows[1:])],
        r"specimens\.csv, row 3 \(B\), nominal stress in MPa.* must be between 0 and 2000; check",
    ),
    "farther than the supports are apart": (
        lambda rows: [rows[0], *([f"{10 * float(d)}", f] for d, f in rows[1:])],
        r"specimens\.csv, row 3 \(B\), range of displacement in mm = 140\.0 .* and 100; check",
    ),
    "a constant force": (
        lambda rows: [rows[0], *([d, "0.08"] for d, _ in rows[1:])],
        r"b\.csv, force_N = 80\.0 must change by .* is it the right column",
    ),
    "a single displacement": (
        lambda rows: [rows[0], *(["3.5", f] for _, f in rows[1:])],
        r"b\.csv, displacement_mm = 0\.0035 must change by .* is it the right column",
    ),
    "few displacements": (
        lambda rows: [rows[0], *([f"{i // 5}e3", f] for i, (_, f) in enumerate(rows[1:]))],
        r"b\.csv, number of displacements = 10 must be at least 20",
    ),
    "unloading by small steps": (
        lambda rows: [*rows, *([f"{14e3 - 100 * i}", "0.05"] for i in range(100))],
        r"b\.csv, row 54, displacement_mm = 13\.8 must not go back .* unloading",
    ),
    "a gap": (
        lambda rows: rows[:6] + rows[20:],
        r"b\.csv, row 7, displacement_mm = 5\.4286 must not exceed .* by more than 10 %",
    ),
    "in another order": (
        lambda rows: [rows[0], *rows[:0:-1]],
        r"b\.csv, row 3, displacement_mm .* must not go back",
    ),
    "mostly below zero": (
        lambda rows: [rows[0], *([d, f"{float(f) - 0.06:.6f}"] for d, f in rows[1:])],
        r"b\.csv, largest force = 38.* than the least force, -60 N: .* zero the load cell",
    ),
    "late": (
        lambda rows: [rows[0], *rows[15:]],
        r"b\.csv, first row, displacement_mm = 4\.0 must be at most 0\.5, as curves are "
        r"compared from 0 mm on; set from_mm = 4 in dataset\.toml, .* or remove B",
    ),
    "the curve of another": (
        lambda rows: [
            rows[0],
            *([f"{d:.1f}", f"{7e-6 * d:.6f}"] for d in np.linspace(0, 12000, 50)),
        ],
        r"specimens\.csv, row 3, curve = 'b\.csv' must not be the same curve as that of row 2, A",
    ),
}


@pytest.mark.parametrize("defect", CURVES)
def test_every_defect_of_a_curve_is_told(folder: Path, defect: str) -> None:
    change, message = CURVES[defect]
    rewrite(folder / "b.csv", change)
    with pytest.raises(rf.SpecificationError, match=message) as caught:
        rf.read_dataset(folder)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("B,0.74", "B,0.7,4", r"specimens\.csv, row 3, number of cells = 5 must be 4, one for"),
        ("B,0.74,20", "B,20", r"specimens\.csv, row 3, number of cells = 3 must be 4, one for"),
        ("height,", "void,", r"specimens\.csv, heading = 'void' must not occur twice"),
        ("\nB,", "\n,", r"specimens\.csv, row 3, column specimen = '' must not be empty"),
        ("b.csv", "", r"specimens\.csv, row 3, column curve = '' must not be empty"),
        (
            "b.csv",
            "a.csv",
            r"row 3, curve = 'a\.csv' must not be the same curve as that of row 2, A",
        ),
        ("\nB", "\n A", r"row 3, specimen = 'A' must not occur twice"),
        ("0.74", "1e301", r"row 3, column void = '1e301' must be a number"),
    ],
)
def test_every_defect_of_the_specimens_is_told(
    folder: Path, old: str, new: str, message: str
) -> None:
    replace(folder / "specimens.csv", old, new)
    with pytest.raises(rf.SpecificationError, match=message):
        rf.read_dataset(folder)


def test_diameters_in_another_unit_are_told(folder: Path) -> None:
    rf.write_test(rf.ramie(15.0, 7.0, 0.7), folder / "mine.toml")
    replace(folder / "dataset.toml", '"table3"', '"mine.toml"')
    replace(
        folder / "dataset.toml", "stalk.void_diameter_mm", "stalk.layers.phloem.outer_diameter_mm"
    )
    replace(folder / "specimens.csv", "0.72", "15.3")  # mm, where cm is announced
    with pytest.raises(rf.SpecificationError, match=r"row 2 \(A\), outer diameter in mm = 153"):
        rf.read_dataset(folder)


def test_one_column_is_not_two_quantities(folder: Path) -> None:
    replace(folder / "dataset.toml", '"load"', '"crosshead"')
    with pytest.raises(rf.SpecificationError, match=r"columns\.force = 'crosshead' must be a col"):
        rf.read_dataset(folder)


def test_a_force_that_is_the_displacement_is_told(folder: Path) -> None:
    replace(folder / "dataset.toml", 'displacement = "um"\nforce = "kN"', "")
    same = "".join(f"{d:.2f},{d:.2f}\n" for d in np.linspace(0, 12, 50))
    (folder / "a.csv").write_text("crosshead,load\n" + same)
    with pytest.raises(rf.SpecificationError, match=r"a\.csv, force_N must not be the same as dis"):
        rf.read_dataset(folder)


def test_time_that_goes_back_is_told(folder: Path) -> None:
    rewrite(
        folder / "a.csv",
        lambda rows: [[*rows[0], "time_s"], *([*r, str(i % 30)] for i, r in enumerate(rows[1:]))],
    )
    with pytest.raises(rf.SpecificationError, match=r"a\.csv, row 32, time_s = 0\.0 must not go"):
        rf.read_dataset(folder)


@pytest.mark.parametrize("content", [b"", b"\n\n", b"crosshead,load\n"])
def test_a_file_without_rows_is_told(folder: Path, content: bytes) -> None:
    (folder / "a.csv").write_bytes(content)
    with pytest.raises(rf.SpecificationError, match=r"a\.csv' must have a heading and at least"):
        rf.read_dataset(folder)


@pytest.mark.parametrize("content", [b"\x89PNG\r\n\x1a\n\x00", b"load,\x00", b"7" * 200_000])
def test_a_file_that_is_no_text_is_told(folder: Path, content: bytes) -> None:
    (folder / "a.csv").write_bytes(content)
    with pytest.raises(rf.SpecificationError, match=r"a\.csv' must be text"):
        rf.read_dataset(folder)


@pytest.mark.parametrize("encoding", ["utf-8-sig", "utf-16", "cp1252"])
def test_tables_are_read_in_encodings_of_windows(folder: Path, encoding: str) -> None:
    text = (folder / "specimens.csv").read_text().replace("B,", "Prüfling,")
    (folder / "specimens.csv").write_text(text.replace("\n", "\r\n"), encoding, newline="")
    assert list(rf.read_dataset(folder).specimens) == ["A", "Prüfling"]


def test_columns_without_a_name_are_nobody_s(folder: Path) -> None:
    """This is how pandas writes its index."""
    expected = rf.read_dataset(folder).records[0].curve
    pd.read_csv(folder / "a.csv").to_csv(folder / "a.csv")
    pd.testing.assert_frame_equal(rf.read_dataset(folder).records[0].curve, expected)


def test_a_late_curve_is_compared_from_where_the_message_says(folder: Path) -> None:
    rewrite(folder / "b.csv", lambda rows: [rows[0], *rows[15:]])
    replace(folder / "dataset.toml", "speed", "from_mm = 4\nspeed")
    data = rf.read_dataset(folder)
    assert data.range_mm == (4.0, pytest.approx(14.0))
    # 7 N/mm throughout, written to a millinewton
    assert observe(data).force_N[1] == pytest.approx(7.0 * data.records[1].at_mm, abs=1e-3)


def test_curves_that_a_preload_makes_late_are_compared_from_where_they_begin(folder: Path) -> None:
    """With 7 N at the machine's zero, the toe is 1 mm before this zero."""
    rewrite(
        folder / "b.csv",
        lambda rows: [rows[0], *([d, f"{float(f) + 7e-3:.6f}"] for d, f in rows[1:])],
    )
    layout = folder / "dataset.toml"
    layout.write_text(layout.read_text() + '\n[seating]\nzero = "toe"\n')
    data = rf.read_dataset(folder)
    told = (
        r"b\.csv, first row, displacement_mm = 1\.0.* set from_mm = 1(\.01)? in dataset\.toml, or"
    )
    with pytest.raises(rf.SpecificationError, match=told):
        observe(data)
    replace(layout, "speed", "from_mm = 1.01\nspeed")
    data = rf.read_dataset(folder)
    seen = observe(data)
    assert seen.force_N == pytest.approx(7.0 * seen.at_mm, abs=1e-3)


TESTS = """specimen,test,span,turned,curve
B,far,10,0,b.csv
A,,8,90,c.csv
A,near,8,0,a.csv
"""


@pytest.fixture
def several(folder: Path) -> Path:
    """A data set with two tests of A and one of B."""
    (folder / "tests.csv").write_text(TESTS)
    mapped = '[tests]\n"fixture.span_mm" = "span"\n"stalk.rotation_deg" = "turned"\n'
    (folder / "dataset.toml").write_text(LAYOUT + mapped)
    (folder / "specimens.csv").write_text("specimen,void,height\nA,0.72,10\nB,0.74,20\n")
    curve = pd.read_csv(folder / "a.csv").assign(load=lambda c: 2.0 * c["load"])
    curve.to_csv(folder / "c.csv", index=False)
    return folder


def test_a_specimen_may_be_tested_several_times(several: Path) -> None:
    data = rf.read_dataset(several)
    assert data.specimens == ("A", "B")
    assert [r.name for r in data.records] == ["A 1", "A near", "B"]
    assert [r.specimen for r in data.records] == ["A", "A", "B"]
    turned, straight, other = (record.test for record in data.records)
    assert turned.stalk.rotation_deg == 90.0
    assert turned.numerics.domain == "full"  # a turned stalk has no symmetry along X
    assert straight.numerics.domain == other.numerics.domain == "quarter"
    assert [t.fixture.span_mm for t in (turned, straight, other)] == [80.0, 80.0, 100.0]
    assert [t.stalk.void_diameter_mm for t in (turned, straight)] == pytest.approx([7.2, 7.2])
    seen = observe(data)
    assert list(seen.blocks.specimen) == [0, 0, 1]
    assert list(seen.blocks.place) == [0, 1, 0]
    assert data.records[1].row["void"] == "0.72"
    assert data.condition_labels == ("Span 8, Turned 90", "Span 8, Turned 0", "Span 10, Turned 0")
    assert rf.reduce_dataset(data).curves["record"].to_list() == ["A 1", "A near", "B"]


@pytest.mark.parametrize(
    ("file", "old", "new", "told"),
    [
        ("tests.csv", "B,far", "C,far", r"row 2, specimen = 'C' must be a specimen of"),
        ("tests.csv", "B,far,10,0,b.csv\n", "", r"row 3 = 'B' must have a test in tests\.csv"),
        (
            "tests.csv",
            "c.csv",
            "a.csv",
            r"row 4, curve = 'a.csv' must not be the same curve",
        ),
        ("tests.csv", "0,b.csv", "0,", r"tests\.csv, row 2, column curve = '' must not be empty"),
        ("tests.csv", "span", "length", r"tests\.csv"),
        (
            "specimens.csv",
            "B,0.74",
            "A,0.74",
            r"must not occur twice.* tests of a specimen in tests",
        ),
        ("dataset.toml", '"fixture.span_mm"', '"fixture.width_mm"', r"fixture\.width_mm"),
    ],
)
def test_defects_of_several_tests_are_told(
    several: Path, file: str, old: str, new: str, told: str
) -> None:
    replace(several / file, old, new)
    with pytest.raises(rf.SpecificationError, match=told):
        rf.read_dataset(several)

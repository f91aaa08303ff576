"""Import of raw files of testing machines into data sets."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import ramiefenics as rf
from ramiefenics.cli import main
from ramiefenics.measured import RawCurve
from ramiefenics.measured.readers.columns import TextColumns

pytestmark = pytest.mark.filterwarnings("ignore::ramiefenics.SpecificationWarning")

TRAVEL = np.linspace(0.0, 14.0, 141)
FORCE = 84.0 * np.sin(np.pi * TRAVEL / 20.0)

HEADER = """\
General : Start date,"2024-06-03"
General : Unique identifier,"{6E289CB0}"
Specimen notes : Length, D1, D2,""
Specimen properties : Specimen label,"stalk 1, lower"
Specimen properties : Diameter,"14.23",mm
Maximum Load : Maximum Load,"84.00000",N

"""


def bluehill(
    path: Path,
    header: str = HEADER,
    names: str = "Time,Extension,Load",
    units: str = "(s),(mm),(N)",
    cell: Callable[[float], str] = lambda value: f'"{value:.5f}"',
    scale: tuple[float, float] = (1.0, 1.0),
    more: tuple[float, ...] = (),
) -> Path:
    rows = [
        ",".join(map(cell, (6 * d, d * scale[0], f * scale[1], *more)))
        for d, f in zip(TRAVEL, FORCE, strict=True)
    ]
    path.write_text(header + "\n".join([names, units, *rows]) + "\n")
    return path


def only(curves: dict[str, RawCurve]) -> RawCurve:
    (curve,) = curves.values()
    return curve


def check(curve: pd.DataFrame) -> None:
    assert curve["displacement_mm"].to_numpy() == pytest.approx(TRAVEL, abs=1e-5)
    assert curve["force_N"].to_numpy() == pytest.approx(FORCE, abs=2e-3)
    assert curve["time_s"].to_numpy() == pytest.approx(6 * TRAVEL, abs=1e-4)


def test_a_bluehill_file_with_its_header(tmp_path: Path) -> None:
    raw = only(rf.read_raw([bluehill(tmp_path / "a.csv")], "headings"))
    check(raw.curve)
    assert raw.notes == ()
    assert raw.header == {
        "Start date": "2024-06-03",
        "Unique identifier": "{6E289CB0}",
        "Specimen label": "stalk 1, lower",
        "Diameter (mm)": "14.23",
        "Maximum Load (N)": "84.00000",
    }


def test_other_units_and_columns_in_between(tmp_path: Path) -> None:
    path = bluehill(
        tmp_path / "a.csv",
        names="Time,Flexure extension,Load,Flexure stress",
        units="(min),(in),(kN),(MPa)",
        scale=(1 / 25.4, 1e-3),
        more=(7.5,),
        cell=lambda value: f"{value:.9f}",
    )
    curve = only(rf.read_raw([path], "headings")).curve
    assert curve["displacement_mm"].to_numpy() == pytest.approx(TRAVEL, abs=1e-5)
    assert curve["force_N"].to_numpy() == pytest.approx(FORCE, abs=1e-3)
    assert curve["time_s"].iloc[-1] == pytest.approx(60 * 84.0)


@pytest.mark.parametrize("delimiter", [";", "\t", ","])
def test_decimal_commas(tmp_path: Path, delimiter: str) -> None:
    path = bluehill(tmp_path / "a.csv", header=HEADER.replace("14.23", "14,23"))
    text = path.read_text()
    if delimiter != ",":
        head, _, table = text.partition("Time,")
        text = head.replace('",mm', f'"{delimiter}mm') + "Time," + table
        text = text.replace('","', f'"{delimiter}"').replace("),(", f"){delimiter}(")
        text = text.replace("Time,Extension,Load", delimiter.join(("Time", "Extension", "Load")))
    path.write_text(text.replace(".", ",") if delimiter == "," else _commas(text))
    raw = only(rf.read_raw([path], "headings"))
    check(raw.curve)
    assert raw.header["Diameter (mm)"] == "14.23"


def _commas(text: str) -> str:
    lines = text.splitlines()
    return "\n".join(line.replace(".", ",") if line.startswith('"') else line for line in lines)


@pytest.mark.parametrize("encoding", ["utf-8-sig", "utf-16", "cp1252"])
def test_encodings_of_windows(tmp_path: Path, encoding: str) -> None:
    path = bluehill(tmp_path / "a.csv")
    path.write_text(path.read_text().replace("stalk 1", "Prüfling"), encoding=encoding)
    assert only(rf.read_raw([path], "headings")).header["Specimen label"] == "Prüfling, lower"


def test_units_beside_the_names(tmp_path: Path) -> None:
    path = bluehill(tmp_path / "a.csv", header='"Results Table 1"\n', names="", units="")
    text = path.read_text().replace("\n\n", '\n"Time (sec)","Displacement (mm)","Force (N)"\n', 1)
    path.write_text(text)
    check(only(rf.read_raw([path], "headings")).curve)


def test_tension_positive_records_are_turned_and_unloading_is_left_out(tmp_path: Path) -> None:
    path = bluehill(tmp_path / "a.csv", scale=(-1.0, -1.0))
    back = [f'"{84 + i:.5f}","{-14 + i:.5f}","-1.00000"\n' for i in range(1, 5)]
    path.write_text(path.read_text() + "".join(back))
    raw = only(rf.read_raw([path], "headings"))
    check(raw.curve)
    assert len(raw.notes) == 3
    assert "last 4 rows, those of the unloading" in raw.notes[2]


DEFECTS = [
    ("Extension", "Strain", r"^a\.csv must have a line that names a displacement"),
    ("(mm),", "(furlong),", r"^a\.csv, row 9, unit of Extension = 'furlong' must be one of um, mm"),
    ("(s),(mm),(N)\n", "", r"^a\.csv, row 9, unit of Extension = '0.00000'.*below the col"),
    ('"0.10000"', '"0,1"', r"^a\.csv, row 11, column displacement_mm = '0,1' must be a number"),
    (
        '"0.60000","0.10000"',
        '"0.6"',
        r"^a\.csv, row 11, number of cells = 2 must be 3, one for each",
    ),
    ('"0.60000","0.10000"', '"0.6","0.1","1.0"', r"^a\.csv, row 11, number of cells = 4 must be 3"),
    (
        '"0.10000"',
        '"0.10000',
        r"^a\.csv, row 11 = .* must have complete cells, with quotation marks closed",
    ),
    ("Time,Extension", "Load,Extension", r"^a\.csv, row 8, column = 'load' must not occur twice"),
    ('"3.00000","0.50000"', '"0.1","0.5"', r"^a\.csv, row 15, time_s = 0\.1 must not go back"),
    ('"0.10000"', '"1e301"', r"^a\.csv, row 11, column displacement_mm = '1e301' must be a num"),
    ('"0.10000"', '"99.0"', r"^a\.csv, row 11, displacement_mm = 99\.0 must not exceed"),
    ('"0.10000"', '"---"', r"^a\.csv, row 11, column displacement_mm = '---'.*remove the row"),
]


@pytest.mark.parametrize(("old", "new", "message"), DEFECTS)
def test_defects_of_a_bluehill_file(tmp_path: Path, old: str, new: str, message: str) -> None:
    path = bluehill(tmp_path / "a.csv")
    assert old in path.read_text()
    path.write_text(path.read_text().replace(old, new, 1))
    with pytest.raises(rf.SpecificationError, match=message) as caught:
        rf.read_raw([path], "headings")
    assert "\n" not in str(caught.value)


def test_a_file_without_rows(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    path.write_text(HEADER + "Time,Extension,Load\n(s),(mm),(N)\n")
    with pytest.raises(rf.SpecificationError, match=r"a\.csv has no rows of data below row 9"):
        rf.read_raw([path], "headings")


def test_a_second_specimen_in_the_file_is_told(tmp_path: Path) -> None:
    path = bluehill(tmp_path / "a.csv")
    path.write_text(path.read_text() + "\nTime,Extension,Load\n")
    with pytest.raises(rf.SpecificationError, match=r"row 152.*'Extension'.*one specimen per file"):
        rf.read_raw([path], "headings")


COMMENT = "# span 100 mm, 200 Hz\n// crosshead, load cell\nweg kraft\n\n"


SEPARATORS = (" ", "\t", ", ", ",", ";", "   ")


@pytest.mark.parametrize(
    ("between", "comma"),
    [(between, False) for between in SEPARATORS]
    + [(between, True) for between in SEPARATORS if "," not in between],
)
def test_columns_of_displacement_and_force(tmp_path: Path, between: str, comma: bool) -> None:
    rows = "\n".join(f"{d:.4f}{between}{f:.4f}" for d, f in zip(TRAVEL, FORCE, strict=True))
    path = tmp_path / "a.txt"
    path.write_text(COMMENT + (rows.replace(".", ",") if comma else rows))
    curve = only(rf.read_raw([path], "columns", rate_Hz=200.0)).curve
    assert curve["displacement_mm"].to_numpy() == pytest.approx(TRAVEL, abs=1e-4)
    assert curve["force_N"].to_numpy() == pytest.approx(FORCE, abs=1e-4)
    assert curve["time_s"].iloc[-1] == pytest.approx(140 / 200)


def test_time_and_force_at_constant_speed(tmp_path: Path) -> None:
    """At 10 mm/min and 200 Hz, 14 mm take 84 s and give 16,800 rows, 0.83 um apart."""
    time = np.arange(16801) / 200.0
    force = 84.0 * np.sin(np.pi * time / 6.0 / 20.0)
    path = tmp_path / "a.txt"
    np.savetxt(path, np.column_stack([time, force / 1000.0]), fmt="%.8f")
    columns = ("time_s", "force_kN")
    curve = only(rf.read_raw([path], "columns", columns=columns, speed_mm_per_min=10.0)).curve
    assert curve["displacement_mm"].iloc[-1] == pytest.approx(14.0)
    assert curve["force_N"].max() == pytest.approx(84.0, rel=1e-6)
    assert curve["displacement_mm"][curve["force_N"].idxmax()] == pytest.approx(10.0, abs=0.05)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((("displacement_mm",),), r"columns = 'displacement_mm' must have a force"),
        ((("time_s", "force_N"),), r"must have a displacement, or time"),
        ((("weight_g", "force_N"),), r"columns = 'weight_g' must be displacement, force, time"),
        ((("force_mm", "displacement_mm"),), r"unit of columns\.force_mm = 'mm' must be one of mN"),
        ((("force_N", "force_kN"),), r"must not name a quantity twice"),
        ((("time_s", "force_N"), -1.0), r"speed_mm_per_min = -1.0 must be a number above 0"),
    ],
)
def test_unusable_columns(arguments: tuple, message: str) -> None:
    with pytest.raises(rf.SpecificationError, match=message):
        TextColumns(*arguments)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("# nothing\n", r"^a\.txt has no row of numbers"),
        ("0 0\n1 2\n2\n" + "3 4\n" * 30, r"^a\.txt, row 3, number of cells = 1 must be 2, one for"),
        ("0 0\n1 2\n2 x\n" + "3 4\n" * 30, r"^a\.txt, row 3, column force_N = 'x' must be"),
        ("0 0\n1 nan\n", r"^a\.txt, row 2, column force_N = 'nan'"),
        ("0 0\n1 2\n", r"^a\.txt, number of rows = 2 must be at least 20"),
        ("0 0\n1 2 3\n" + "3 4\n" * 30, r"^a\.txt, row 2, number of cells = 3 must be 2, one for"),
        ("0,5,1,5\n" * 30, r"^a\.txt, row 1, number of cells = 4 must be 2.*comma is a decimal"),
        (
            "".join(f"{d} {d}\n" for d in range(30)),
            r"^a\.txt, force_N must not be the same as displacement_mm",
        ),
        (
            "".join(f"{d} {d + 1}\n" for d in (*range(30), *range(30, 0, -1), *range(40))),
            r"^a\.txt, row 32, displacement_mm = 29\.0 must not go back .* before unloading",
        ),
        ("1 2\n" * 30, r"^a\.txt, force_N = 2.0 must change by .* is it the right column"),
    ],
)
def test_defects_of_a_text_file(tmp_path: Path, text: str, message: str) -> None:
    (tmp_path / "a.txt").write_text(text)
    with pytest.raises(rf.SpecificationError, match=message):
        rf.read_raw([tmp_path / "a.txt"], "columns")


def test_files_that_are_not_there_or_are_no_text(tmp_path: Path) -> None:
    with pytest.raises(rf.SpecificationError, match=r"cannot be read \(No such file"):
        rf.read_raw([tmp_path / "none.csv"], "headings")
    (tmp_path / "picture.csv").write_bytes(b"\x89PNG\x81\x8d\x00")
    with pytest.raises(rf.SpecificationError, match=r"must be text"):
        rf.read_raw([tmp_path / "picture.csv"], "headings")


def test_same_names_take_their_folders(tmp_path: Path) -> None:
    for folder, strength in (("p1", 1.0), ("p2", 1.1)):
        (tmp_path / folder).mkdir()
        bluehill(tmp_path / folder / "Specimen_RawData_1.csv", scale=(1.0, strength))
    found = rf.read_raw(sorted(tmp_path.rglob("*.csv")), "headings")
    assert list(found) == ["p1_Specimen_RawData_1", "p2_Specimen_RawData_1"]


def test_a_copy_of_another_file_is_told(tmp_path: Path) -> None:
    files = [bluehill(tmp_path / f"{name}.csv") for name in "ab"]
    with pytest.raises(rf.SpecificationError, match=r"b\.csv' must not be a copy of .*a\.csv"):
        rf.read_raw(files, "headings")


def run(monkeypatch: pytest.MonkeyPatch, *arguments: object) -> object:
    monkeypatch.setattr("sys.argv", ["ramiefenics", *map(str, arguments)])
    with pytest.raises(SystemExit) as stop:
        main()
    return stop.value.code or 0


def test_command_makes_a_data_set_that_is_read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    strengths = {"a": 1.1, "b": 1.0}
    files = [bluehill(tmp_path / f"{n}.csv", scale=(1.0, k)) for n, k in strengths.items()]
    out = tmp_path / "set"
    arguments = [
        "import",
        *files,
        "--format",
        "headings",
        "--out",
        out,
        "--speed",
        10,
        "--baseline",
        "table3",
    ]
    assert run(monkeypatch, *arguments) == 0
    data = rf.read_dataset(out)
    assert list(data.specimens) == ["a", "b"]
    assert data.records[0].row["Maximum Load (N)"] == "84.00000"
    assert data.layout.speed_mm_per_min == 10.0
    check(data.records[1].curve)
    # the diameter is known without any option for it
    assert rf.read_dataset(out).records[0].test.stalk.outer_diameter_mm == 14.23
    assert run(monkeypatch, *arguments) == 2  # a data set that may have been edited is kept


def test_command_refuses_in_one_sentence_and_writes_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    path = bluehill(tmp_path / "a.csv")
    out = tmp_path / "set"
    for arguments, told in (
        (["--format", "excel"], "format = 'excel' must be headings, columns, or a Py"),
        (["--format", "headings", "--columns", "force_N"], "must be left out for the format headi"),
        (["--format", "columns", "--columns", "time_s,force_N"], "and the crosshead's speed"),
        (["--format", "headings", "--baseline", "table9"], "'table9' must be one of"),
    ):
        arguments = ["--baseline", "table3", *arguments]
        assert run(monkeypatch, "import", path, "--out", out, *arguments) == 2
        error = capsys.readouterr().err
        assert told in error
        assert error.count("\n") == 1
        assert not out.exists()


@pytest.mark.parametrize("there", ["dataset.toml", "specimens.csv", "curves"])
def test_what_is_in_the_folder_already_is_left_alone(there: str, tmp_path: Path) -> None:
    travel = np.linspace(0.0, 5.0, 60)
    raw = tmp_path / "stalk.txt"
    np.savetxt(raw, np.column_stack([travel, 10.0 * travel]))
    records = rf.read_raw([raw], "columns")
    folder = tmp_path / "data"
    own = folder / there
    if there == "curves":
        own.mkdir(parents=True)
        own = own / "labbook.txt"
    else:
        folder.mkdir()
    own.write_text("mine")
    with pytest.raises(rf.SpecificationError, match=f"must not have a {there} yet"):
        rf.write_dataset(records, folder, "table3")
    assert own.read_text() == "mine"


def test_a_load_cell_that_was_not_zeroed_is_not_taken_for_tension(tmp_path: Path) -> None:
    travel = np.linspace(0.0, 5.0, 60)
    raw = tmp_path / "stalk.txt"
    np.savetxt(raw, np.column_stack([travel, 10.0 * travel - 120.0]))
    (record,) = rf.read_raw([raw], "columns").values()
    assert record.curve["force_N"].to_numpy() == pytest.approx(10.0 * travel - 120.0)
    assert not record.notes


def test_a_position_that_runs_down_becomes_a_displacement(tmp_path: Path) -> None:
    position = np.linspace(62.0, 50.0, 60)
    raw = tmp_path / "stalk.txt"
    np.savetxt(raw, np.column_stack([position, 62.0 - position]))
    (record,) = rf.read_raw([raw], "columns").values()
    assert record.curve["displacement_mm"].to_numpy() == pytest.approx(62.0 - position)
    assert "sign of displacement_mm reversed" in record.notes[0]


FIRST = 40
"""Number of rows in the files below, enough to distinguish the columns."""


def lines_of(order: str, between: str, number: str, comma: bool = False) -> str:
    """Return rows of time, displacement and force in some order, as a machine writes them."""
    rows = []
    for d, f in zip(TRAVEL[:FIRST], FORCE[:FIRST], strict=True):
        value = {"t": 6 * d, "d": d, "f": f}
        rows.append(between.join(number % value[name] for name in order))
    text = "\n".join(rows) + "\n"
    return text.replace(".", ",") if comma else text


WILD = {
    "testxpert.csv": (
        "utf-8-sig",
        'Kunde;"";\nProbendurchmesser;14,23;mm\nStützweite;100,0;mm\n\n'
        "Prüfzeit;Standardweg;Standardkraft\ns;mm;N\n",
        lines_of("tdf", ";", "%.6f", comma=True),
    ),
    "trapezium.csv": (
        "utf-8",
        '"Diameter","14.23","mm"\n"Time","Force","Stroke"\n"sec","N","mm"\n',
        lines_of("tfd", ",", '"%.5f"'),
    ),
    "testsuite.txt": (
        "utf-16",
        "MTS TestSuite\nDiameter\t14.23\tmm\nCrosshead \tLoad \tTime \nmm\tN\tsec\n",
        lines_of("dft", "\t", "%.6f"),
    ),
    "essai.csv": (
        "cp1252",
        "Diamètre;14,23;mm\nTemps [s];Déplacement [mm];Charge [N]\n",
        lines_of("tdf", ";", "%.6f", comma=True),
    ),
    "ensayo.csv": (
        "utf-8",
        "Diámetro,14.23,mm\nTiempo (s),Desplazamiento (mm),Carga (N)\n",
        lines_of("tdf", ",", "%.6f"),
    ),
    "试验.csv": (
        "gb18030",
        "试样直径,14.23,mm\n时间(s),位移\uff08mm\uff09,试验力(N)\n",
        lines_of("tdf", ",", "%.6f"),
    ),
    "slash.csv": ("utf-8", "Zeit in s,Weg in mm,Kraft / N\n", lines_of("tdf", ",", "%.6f")),
}


@pytest.mark.parametrize("name", WILD)
def test_files_as_machines_write_them(name: str, tmp_path: Path) -> None:
    encoding, head, rows = WILD[name]
    path = tmp_path / name
    path.write_text(head + rows, encoding=encoding)
    curve = only(rf.read_raw([path])).curve  # the format is guessed
    assert curve["displacement_mm"].to_numpy() == pytest.approx(TRAVEL[:FIRST], abs=1e-5)
    assert curve["force_N"].to_numpy() == pytest.approx(FORCE[:FIRST], abs=1e-4)
    assert curve["time_s"].to_numpy() == pytest.approx(6 * TRAVEL[:FIRST], abs=1e-4)


def test_workbooks(tmp_path: Path) -> None:
    rows = [[6 * d, d, f / 1000] for d, f in zip(TRAVEL, FORCE, strict=True)]
    head = [["Diameter", 14.23, "mm"], [None] * 3, ["Time", "Deflection", "Load"]]
    sheet = pd.DataFrame([*head, ["(s)", "(mm)", "(kN)"], *rows])
    one, two = tmp_path / "one.xlsx", tmp_path / "two.xlsx"
    for path, names in ((one, ["Raw"]), (two, ["Raw", "again"])):
        with pd.ExcelWriter(path) as book:
            pd.DataFrame([["Summary"]]).to_excel(
                book, sheet_name="Results", index=False, header=False
            )
            for name in names:
                sheet.to_excel(book, sheet_name=name, index=False, header=False)
    raw = only(rf.read_raw([one]))
    check(raw.curve)
    assert raw.header["Diameter (mm)"] == "14.23"
    with pytest.raises(rf.SpecificationError, match=r"again' must not be a copy of .*Raw"):
        rf.read_raw([two])
    bad = tmp_path / "bad.xlsx"
    bad.write_bytes(b"PK nonsense")
    with pytest.raises(rf.SpecificationError, match="cannot be read"):
        rf.read_raw([bad], "headings")


def test_plain_columns_are_guessed_last(tmp_path: Path) -> None:
    path = tmp_path / "a.txt"
    path.write_text(lines_of("df", " ", "%.6f"))
    curve = only(rf.read_raw([path])).curve
    assert curve["force_N"].to_numpy() == pytest.approx(FORCE[:FIRST], abs=1e-5)
    path.write_text("neither this\nnor that\n")
    with pytest.raises(rf.SpecificationError, match="must have a line that names"):
        rf.read_raw([path])


def test_import_takes_what_the_files_say_and_tells_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    encoding, head, rows = WILD["testxpert.csv"]
    (tmp_path / "a.csv").write_text(head.replace("100,0", "120,0") + rows, encoding=encoding)
    command = ["import", tmp_path / "a.csv", "--baseline", "table3", "--out", tmp_path / "set"]
    assert run(monkeypatch, *command) == 0
    told = capsys.readouterr().err
    assert "read as headings" in told
    assert "outer diameters of phloem are taken from 'Probendurchmesser (mm)'" in told
    assert "the span of 120 mm is taken from 'Stützweite (mm)'" in told
    test = rf.read_dataset(tmp_path / "set").records[0].test
    assert test.stalk.outer_diameter_mm == 14.23
    assert isinstance(test.fixture, rf.Fixture)
    assert test.fixture.span_mm == 120.0
    plain = tmp_path / "b.csv"
    plain.write_text("Time (s),Extension (mm),Load (N)\n" + lines_of("tdf", ",", "%.6f"))
    assert run(monkeypatch, "import", plain, "--baseline", "table3", "--out", tmp_path / "b") == 0
    told = capsys.readouterr().err
    assert "no diameter in the files: all specimens have that of the baseline" in told

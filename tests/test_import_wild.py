"""Import of raw files as they are found in laboratories, with what their headers state."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import ramiefenics as rf
from ramiefenics.cli import main
from ramiefenics.measured.stated import take_stated

TRAVEL = np.linspace(0.0, 8.0, 41)
FORCE = 84.0 * np.sin(np.pi * TRAVEL / 20.0)

HEADING = "Time (s),Extension (mm),Load (N)\n"


def rows(order: str = "tdf", between: str = ",", comma: bool = False, **factors: float) -> str:
    """Return rows of time, displacement, force or strength of a second specimen, times factors."""
    values = {"t": 6 * TRAVEL, "d": TRAVEL, "f": FORCE, "g": 1.1 * FORCE}
    table = np.column_stack([values[name] * factors.get(name, 1.0) for name in order])
    text = "".join(between.join(f"{cell:.6f}" for cell in row) + "\n" for row in table)
    return text.replace(".", ",") if comma else text


def thousands(text: str) -> str:
    """Return numbers from 1 on as millions, with points between the digits."""
    cells = [f"{1e6 * float(cell):,.3f}" for cell in text.split()]
    swapped = [cell.translate(str.maketrans(",.", ".,")) for cell in cells]
    return "".join(f"{d};{f}\n" for d, f in zip(swapped[::2], swapped[1::2], strict=True))


GERMAN = rows("tdf", ";", comma=True)

WILD = {
    "absolut": "Zeit [s];Traversenweg absolut [mm];Kraft [N]\n" + GERMAN,
    "symbols": "t [s];s [mm];F [N]\n" + GERMAN,
    "druck": '"Zeit";"Druckausdehnung";"Drucklast"\n(s);(mm);(N)\n' + GERMAN,
    "thousands": "Weg;Kraft\num;mN\n" + thousands(rows("df", " ", d=1e-3, f=1e-3)),
    "course": "Temps (s);Course traverse (mm);Effort (daN)\n" + rows("tdf", ";", f=0.1),
    "flexion": "Extension en flexion (mm);Charge en flexion (N)\n" + rows("df", ";", comma=True),
    "flexión": "Extensión por flexión (mm);Carga de flexión (N)\n" + rows("df", ";"),
    "deformación": "Tiempo (seg);Deformación (mm);Fuerza (N)\n" + GERMAN,
    "弯曲": "弯曲位移(mm),弯曲力(N),时间(s)\n" + rows("dft"),
    "力值": "时间(秒),位移(毫米),力值(牛顿)\n" + rows(),
    "channels": "Ch 1 Force\tCh 1 Displacement\tTime\nN\tmm\tSec\n" + rows("fdt", "\t"),
    "pounds": "Displacement (in),Load (lb)\n" + rows("df", d=1 / 25.4, f=1 / 4.4482216),
    "grams": "Force (g),Distance (mm),Time (sec)\n" + rows("fdt", f=1000 / 9.80665),
    "units last": "Time s,Extension mm,Load N\n" + rows(),
    "own names": "time_s,displacement_mm,force_N\n" + rows(),
    "blanks": "Zeit      Weg      Kraft\ns         mm       N\n" + rows("tdf", "    "),
    "trailing": HEADING + rows().replace("\n", ",\n"),
    "blank line": "Time,Extension,Load\n\n(s),(mm),(N)\n" + rows(),
    "stress": "Time,Displacement,Force,Force stress\ns,mm,N,MPa\n" + rows("tdft"),
    "summary": "Maximum load (N),Extension at maximum load (mm)\n84,8\n" + HEADING + rows(),
    "commented": "# force displacement\n" + rows("fd", "\t"),
    "one blank": "Kraft Weg\nkN mm\n" + rows("fd", " ", f=1e-3),
}


@pytest.mark.parametrize("name", WILD)
def test_files_of_laboratories_are_read(name: str, tmp_path: Path) -> None:
    path = tmp_path / f"{name}.csv"
    path.write_text(WILD[name])
    (raw,) = rf.read_raw([path]).values()
    assert raw.curve["displacement_mm"].to_numpy() == pytest.approx(TRAVEL, abs=2e-5)
    assert raw.curve["force_N"].to_numpy() == pytest.approx(FORCE, abs=2e-3)
    if "time_s" in raw.curve:
        assert raw.curve["time_s"].to_numpy() == pytest.approx(6 * TRAVEL, abs=1e-5)
    assert raw.origin.keys() >= {"displacement", "force"}


def test_a_time_of_day_is_read_and_a_time_without_a_unit_is_left_out(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    cells = [f"00:00:{6 * d:06.3f},{d:.4f},{f:.4f}" for d, f in zip(TRAVEL, FORCE, strict=True)]
    path.write_text("\n".join(["Time,Extension (mm),Load (N)", *cells]))
    (raw,) = rf.read_raw([path]).values()
    assert raw.curve["time_s"].to_numpy() == pytest.approx(6 * TRAVEL, abs=1e-3)
    path.write_text("Time,Extension (mm),Load (N)\n" + rows())
    (raw,) = rf.read_raw([path]).values()
    assert "time_s" not in raw.curve
    assert "time is left out, as its unit is not stated" in raw.notes[0]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("Time (s),Load (N)\n" + rows("tf"), "row 1 names a force and a time only: .*--speed"),
        ("# time force\n" + rows("tf"), "must have a displacement, or time .* speed"),
        ("time,displacement,force\n" + rows(), "must be a unit such as"),
        ("Axial Force (N),Side Force (N),Stroke (mm)\n" + rows("fgd"), "must not all be in"),
        ("Load (N),Extension at load (mm)\n" + rows("fd"), "state with --columns what they are"),
    ],
)
def test_columns_that_are_not_clear_are_not_guessed(
    text: str, message: str, tmp_path: Path
) -> None:
    (tmp_path / "a.csv").write_text(text)
    with pytest.raises(rf.SpecificationError, match=message):
        rf.read_raw([tmp_path / "a.csv"])


@pytest.mark.parametrize(
    ("header", "speed"),
    [
        ("", 80.0),
        ("Versuchsgeschwindigkeit,80,mm/min\n", None),
        ("Vitesse (mm/s),1.3333333333\nVitesse de retour (mm/s),5\n", None),
        ("Speed: 20 mm/min\n", 80.0),
    ],
)
def test_displacement_is_calculated_from_time_and_speed(
    header: str, speed: float | None, tmp_path: Path
) -> None:
    (tmp_path / "a.csv").write_text(f"{header}Time (s),Load (N)\n" + rows("tf"))
    options = {} if speed is None else {"speed_mm_per_min": speed}
    (raw,) = rf.read_raw([tmp_path / "a.csv"], **options).values()
    assert raw.curve["displacement_mm"].to_numpy() == pytest.approx(8 * TRAVEL, rel=1e-6)
    assert raw.origin["displacement"] == "80 mm/min times the time"


def test_specimens_side_by_side_and_in_sheets_are_read_one_by_one(tmp_path: Path) -> None:
    path = tmp_path / "press.csv"
    head = '"1 _ 1","","","1 _ 2","",""\nTime,Force,Stroke,Time,Force,Stroke\nsec,N,mm,sec,N,mm\n'
    path.write_text(head + rows("tfdtgd"))
    found = rf.read_raw([path])
    assert list(found) == ["press_1_1", "press_1_2"]
    sheets = {"Halm 1": rows("df"), "Halm 2": rows("dg")}
    with pd.ExcelWriter(tmp_path / "book.xlsx") as book:
        given = pd.DataFrame([["Durchmesser", 13.5, "mm"]])
        given.to_excel(book, sheet_name="Parameter", index=False, header=False)
        for name, text in sheets.items():
            cells = [["Standardweg", "Standardkraft"], ["mm", "N"]]
            cells += [list(map(float, line.split(","))) for line in text.splitlines()]
            pd.DataFrame(cells).to_excel(book, sheet_name=name, index=False, header=False)
    found |= rf.read_raw([tmp_path / "book.xlsx"])
    assert list(found)[2:] == ["book_Halm_1", "book_Halm_2"]
    assert found["book_Halm_2"].header == {"Durchmesser (mm)": "13.5"}
    for name, raw in found.items():
        strength = 1.1 if name.endswith("2") else 1.0
        assert raw.curve["force_N"].to_numpy() == pytest.approx(strength * FORCE, abs=1e-5)


def test_an_old_workbook_is_refused_with_the_right_advice(tmp_path: Path) -> None:
    path = tmp_path / "old.xls"
    path.write_bytes(b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1" + bytes(600))
    with pytest.raises(rf.SpecificationError, match=r"must be saved as \.xlsx or CSV"):
        rf.read_raw([path])


def taken(folder: Path, *headers: str) -> tuple[dict[str, object], list[str]]:
    """Return what files with these headers state, by column or key, and what is told of it."""
    files = [folder / f"{number}.csv" for number in range(len(headers))]
    for number, (file, header) in enumerate(zip(files, headers, strict=True)):
        file.write_text(header + HEADING + rows(f=1.0 + number))
    found = take_stated(rf.read_raw(files), rf.ramie(14.23, 7.28, 0.67), "mine.toml")
    values = {name: list(column.values()) for name, column in found.columns.items()}
    return values | found.layout.get("fixture", {}), found.told


@pytest.mark.parametrize(
    "entry",
    [
        *("Diameter,13.5,mm", "Diameter,1.35,cm", '"Diameter","13.5"', "直径/mm,13.5"),
        *("直径\uff1a13.5mm", "Diamètre : 13,5 mm", "Ø,13.5,mm", "Halmdurchmesser D = 13,5 mm"),
        *("Anvil diameter,10,mm\nDiameter,13.5,mm", "Support diameter,20,mm\nDiameter,13.5,mm"),
        *("Druckfinnendurchmesser,10,mm\nProbendurchmesser,13.5,mm",),
        *("Diameter,9,mm\nOuter diameter,13.5,mm", "outer_diameter_mm,13.5"),
    ],
)
def test_the_diameter_of_the_specimen_is_found(entry: str, tmp_path: Path) -> None:
    values, told = taken(tmp_path, f"{entry}\n")
    assert values == {"outer_diameter_mm": [pytest.approx(13.5)]}
    assert "outer diameters of phloem are taken from" in told[0]


def test_files_in_different_languages_are_taken_together(tmp_path: Path) -> None:
    values, told = taken(tmp_path, "Diámetro,13.5,mm\n", "Diamètre,14.1,mm\n")
    assert values == {"outer_diameter_mm": [13.5, 14.1]}
    assert "'Diámetro (mm)', 'Diamètre (mm)'" in told[0]


@pytest.mark.parametrize(
    ("headers", "sentence"),
    [
        (
            ["Anvil diameter,10,mm\n"],
            "no diameter of the specimens, only 'Anvil diameter (mm)', in",
        ),
        (["Diameter a,13,mm\nDiameter b,14,mm\n"], "0.csv states 'Diameter a (mm)' = 13 mm and"),
        (["Diameter,13,mm\n", ""], "only 1 of 2 specimens have 'Diameter (mm)' in their files"),
        (["Diameter,13,furlong\n"], "only 'Diameter (furlong)', in the files"),
    ],
)
def test_diameters_that_are_not_used_are_named(
    headers: list[str], sentence: str, tmp_path: Path
) -> None:
    values, told = taken(tmp_path, *headers)
    assert values == {}
    assert sentence in told[0]
    assert told[0].endswith("all specimens have that of the baseline, 14.23 mm")


def test_an_inner_diameter_is_that_of_the_void(tmp_path: Path) -> None:
    values, _ = taken(tmp_path, "Inner diameter,7.1,mm\nOuter diameter,13.5,mm\n")
    assert values == {"outer_diameter_mm": [13.5], "void_diameter_mm": [7.1]}


def test_a_span_is_no_length_between_clamps(tmp_path: Path) -> None:
    clamped = "Einspannlänge bei Startposition,150,mm\n"
    values, _ = taken(tmp_path, f"{clamped}Auflagerabstand,90,mm\n")
    assert values == {"span_mm": 90.0}
    values, told = taken(tmp_path, clamped)
    assert values == {}
    assert told[1] == "the span is that of the baseline, 100 mm"
    _, told = taken(tmp_path, "Span,90,mm\nSupport span,100,mm\n")
    assert "none of which is used: the span is that of the baseline" in told[1]


def run(monkeypatch: pytest.MonkeyPatch, *arguments: object) -> object:
    monkeypatch.setattr("sys.argv", ["ramiefenics", "import", *map(str, arguments)])
    with pytest.raises(SystemExit) as stop:
        main()
    return stop.value.code or 0


def test_every_specimen_gets_its_own_span(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    taken(tmp_path, "Span,90,mm\nDiameter,1.4,cm\n", "Span,11,cm\nDiameter,13.5,mm\n")
    files, out = [tmp_path / "0.csv", tmp_path / "1.csv"], tmp_path / "set"
    assert run(monkeypatch, *files, "--baseline", "table3", "--out", out) == 0
    tests = [record.test for record in rf.read_dataset(out).records]
    assert [test.fixture.span_mm for test in tests] == [90.0, pytest.approx(110.0)]
    assert [test.stalk.outer_diameter_mm for test in tests] == [pytest.approx(14.0), 13.5]


@pytest.mark.filterwarnings("always::ramiefenics.SpecificationWarning")
def test_a_baseline_is_copied_as_it_is_and_its_friction_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    taken(tmp_path, "")
    baseline, out = tmp_path / "frictionless.toml", tmp_path / "set"
    rf.write_test(rf.ramie(14.23, 7.28, 0.67), baseline)
    stated = baseline.read_text()
    baseline.write_text("# mine\n" + stated.replace("static = 0.59\n", ""))
    command = [tmp_path / "0.csv", "--baseline", baseline, "--out", out]
    assert run(monkeypatch, *command) == 0
    assert "frictionless.toml does not state fixture.friction" in capsys.readouterr().err
    assert (out / "baseline.toml").read_text() == baseline.read_text()
    with pytest.warns(rf.SpecificationWarning, match="does not state fixture.friction"):
        rf.read_dataset(out)


def test_a_baseline_is_copied_with_the_file_of_its_law(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    taken(tmp_path, "")
    baseline, out = tmp_path / "mine.toml", tmp_path / "set"
    rf.write_test(rf.ramie(14.23, 7.28, 0.67), baseline)
    (tmp_path / "laws").mkdir()
    (tmp_path / "laws/own.py").write_text("# a law")
    lines = [line for line in baseline.read_text().splitlines() if not line.startswith("law =")]
    baseline.write_text("\n".join(['law = "laws/own.py"', *lines]))
    assert run(monkeypatch, tmp_path / "0.csv", "--baseline", baseline, "--out", out) == 0
    assert (out / "own.py").read_text() == "# a law"
    assert rf.read_dataset(out).baseline.law == str(out / "own.py")


def test_the_source_of_every_value_is_told_on_standard_error_unless_quiet(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    taken(tmp_path, "")
    command = [tmp_path / "0.csv", "--baseline", "table3", "--out"]
    assert run(monkeypatch, *command, tmp_path / "a") == 0
    told = capsys.readouterr()
    assert "displacement = column 'Extension' (mm), force = column 'Load' (N)" in told.err
    assert "moduli, densities, inner layers, radii and friction, is that of the bas" in told.err
    assert "ramie's constants" in told.err
    assert told.out.count("\n") == 1
    assert run(monkeypatch, *command, tmp_path / "b", "-q") == 0
    assert capsys.readouterr() == ("", "")


def test_a_data_set_that_no_command_could_read_is_not_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    taken(tmp_path, "Diameter,12,mm\n")
    out = tmp_path / "set"
    assert run(monkeypatch, tmp_path / "0.csv", "--baseline", "table3", "--out", out) == 2
    assert "= 12.0 must be above layers.xylem.outer_diameter_mm" in capsys.readouterr().err
    assert not out.exists()


def test_a_missing_baseline_is_explained(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(monkeypatch, tmp_path / "0.csv", "--out", tmp_path / "set") == 2
    assert "ramiefenics new mine.toml writes one to edit" in capsys.readouterr().err

"""Bad files and values: each is refused at once, in one sentence."""

from __future__ import annotations

import os
import zipfile
from collections.abc import Callable
from pathlib import Path

import pandas as pd
import pytest

import ramiefenics as rf
from ramiefenics.results.folder import write_folder
from ramiefenics.results.result import Result, Table
from ramiefenics.specification import errors, reading
from ramiefenics.specification.user_file import load_objects

pytestmark = pytest.mark.filterwarnings("ignore::ramiefenics.SpecificationWarning")

BASELINE = 'baseline = "table3"\n'
SPECIMENS = '[specimens]\n"stalk.layers.phloem.outer_diameter_mm" = "outer"\n'


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A data set of one stalk."""
    (tmp_path / "curves").mkdir()
    curve = pd.DataFrame({"displacement_mm": range(30), "force_N": range(0, 60, 2)})
    curve.to_csv(tmp_path / "curves" / "a.csv", index=False)
    (tmp_path / "specimens.csv").write_text("specimen,curve,outer\na,curves/a.csv,14\n")
    (tmp_path / "dataset.toml").write_text(BASELINE + SPECIMENS)
    rf.read_dataset(tmp_path)
    return tmp_path


def refused(function: Callable[..., object], *args: object) -> str:
    """Return the sentence with which something is refused."""
    with pytest.raises(rf.SpecificationError) as caught:
        function(*args)
    sentence = str(caught.value)
    assert len(sentence) < 1000
    assert "\n" not in sentence
    return sentence


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("title = 5", "title = 5 must be text"),
        ("format = 5", "format = 5 must be text"),
        ("fit = [1]", "fit = [1] must be a list of names"),
        ('fit = ["phloem.axial", "phloem.axial"]', "must not be named twice"),
        ("fixture = 3", "fixture = 3 must be a table"),
        ("tests = 5", "tests = 5 must be a table"),
        (f"fit_sd = {'9' * 310}", "must be a number above 0"),
        (f"fit_sd = {'9' * 4400}", "is not valid TOML"),
        (f"a = {'[' * 1000}{']' * 1000}", "nested too deeply"),
        (f"{'.'.join(['a'] * 500)} = 1", "unknown key"),
    ],
)
def test_types_in_a_layout(folder: Path, line: str, said: str) -> None:
    (folder / "dataset.toml").write_text(f"{BASELINE}{line}\n{SPECIMENS}")
    assert said in refused(rf.read_dataset, folder)


def test_a_table_that_is_a_list(folder: Path) -> None:
    (folder / "dataset.toml").write_text(f"{BASELINE}specimens = []\n")
    assert "specimens = [] must be a table" in refused(rf.read_dataset, folder)


def test_a_mark_of_byte_order_is_read(folder: Path) -> None:
    """Notepad on Windows writes one."""
    path = folder / "dataset.toml"
    path.write_bytes(b"\xef\xbb\xbf" + path.read_bytes().replace(b"\n", b"\r\n"))
    assert len(rf.read_dataset(folder).records) == 1


@pytest.mark.parametrize("place", ["curve", "layout", "specification"])
@pytest.mark.parametrize("what", ["pipe", "device", "folder", "nothing", "too large"])
def test_what_is_no_file(
    folder: Path, place: str, what: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = folder / {"curve": "curves/a.csv", "layout": "dataset.toml"}.get(place, "spec.toml")
    path.unlink(missing_ok=True)
    if what == "pipe":
        os.mkfifo(path)
    elif what == "device":
        path.symlink_to("/dev/zero")
    elif what == "folder":
        path.mkdir()
    elif what == "too large":
        with path.open("wb") as stream:
            stream.truncate(reading.LARGEST_BYTES + 1)
    read = rf.read_test if place == "specification" else rf.read_dataset
    sentence = refused(read, path if place == "specification" else folder)
    assert str(path.name) in sentence
    assert ("must have at most" if what == "too large" else "cannot be read") in sentence


def test_an_archive_that_inflates(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("ramiefenics.measured.readers.headings.LARGEST_BYTES", 100_000)
    path = tmp_path / "bomb.xlsx"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("xl/worksheets/sheet1.xml", "0" * 1_000_000)
    assert "unpacked, it would have 1 MB" in refused(rf.read_raw, [path])


@pytest.mark.parametrize("content", [b"PK\x03\x04 broken", b"", b"<xml/>"])
def test_a_broken_archive(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "broken.xlsx"
    path.write_bytes(content)
    assert "cannot be read" in refused(rf.read_raw, [path])


@pytest.mark.parametrize(
    ("assignment", "said"),
    [
        ("protocol.travel_mm=3\nlaw='svk'", "must be one value"),
        (f"protocol.travel_mm={'9' * 5000}", "protocol.travel_mm"),
        (f"protocol.then={'[' * 3000}{']' * 3000}", "protocol.then"),
        ("protocol.save_every_mm=1e-12", "at most 1000 states are saved"),
        ("numerics.stepping.max_step_mm=1e-9", "must be at least 0.0014 mm"),
        ("numerics.stepping.min_step_mm=1e-20", "must be at least 1.4e-06 mm"),
        ("numerics.domain=5", "must be one of"),
        ("fixture.indenter_radius_mm=1e-3", "radius of the indenter = 0.001 must be at least"),
        ("stalk.length_mm=1e30", "at most 200000 mm"),
        (f"numerics.mesh.wall_elements={'9' * 310}", "from 1 to 1,000,000,000"),
        ("stalk.layers.phloem.material.elastic.E_X_MPa=1e308", "at most 1e+30 in magnitude"),
        ("stalk.layers.phloem.material.elastic.E_X_MPa=1e-308", "must be a number above 0"),
        ("numerics.mesh.angular_elements=400", "side_growth = "),
    ],
)
def test_values_on_the_command_line(assignment: str, said: str) -> None:
    assert said in refused(rf.override, rf.ramie(14.0, 7.0, 0.6), [assignment])


@pytest.mark.parametrize(
    ("key", "value"),
    [("stalk.void_diameter_mm", 1e-6), ("stalk.layers.phloem.outer_diameter_mm", 12.660000001)],
)
def test_what_is_too_thin_to_be_meshed(key: str, value: float) -> None:
    stalk = rf.ramie(14.0, 7.0, 0.67)
    assert "must " in refused(rf.override, stalk, {key: value})


def test_a_mesh_without_end(coarse: rf.BendingTest) -> None:
    test = rf.override(coarse, ["numerics.mesh.contact_size=1e-6", "numerics.mesh.growth=0"])
    assert "must make at most 3,000,000 cells" in refused(rf.simulate, test)


def test_what_gmsh_cannot_mesh(coarse: rf.BendingTest, monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(dimension: int) -> None:
        raise Exception("Surface 3 is transfinite but has 1 hole")

    monkeypatch.setattr("gmsh.model.mesh.generate", fail)
    assert "cannot be meshed (Surface 3" in refused(rf.simulate, coarse)


def test_a_long_value_is_told_in_part() -> None:
    told = str(errors.SpecificationError("key", "a" * 10_000, "must be short"))
    assert len(told) < 300
    assert told.startswith("key = 'aaa")
    assert told.endswith("aaa' must be short.")


@pytest.mark.parametrize("code", ["import sys; sys.exit(3)", "raise SystemExit", "1 / 0", "(("])
def test_a_file_of_effects_that_leaves(tmp_path: Path, code: str) -> None:
    path = tmp_path / "own.py"
    path.write_text(code)
    assert "own.py" in refused(load_objects, path, rf.Effect, "effects")


class Named(Result):
    """A result with names that others have chosen."""

    title = "Named"

    def findings(self) -> list[str]:
        return ["found"]

    def numbers(self) -> dict[str, object]:
        return {}

    def tables(self) -> dict[str, Table]:
        cells = ["=cmd()", "+1", "-a", "@x", "-3.5", "a=b", ""]
        return {"names": Table(pd.DataFrame({"name": cells, "=head": 1.5, "value": -2.0}))}


def test_no_spreadsheet_runs_a_cell(tmp_path: Path) -> None:
    write_folder(Named(), tmp_path / "out")
    lines = (tmp_path / "out" / "names.csv").read_text().splitlines()
    assert lines[0] == "name,'=head,value"
    assert [line.split(",")[0] for line in lines[1:]] == [
        "'=cmd()", "+1", "'-a", "'@x", "-3.5", "a=b", ""
    ]  # fmt: skip
    assert all(line.endswith(",1.5,-2") for line in lines[1:])

"""A user's own law: CONTRIBUTING.md followed literally, and what is refused."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from ramiefenics import (
    BendingTest,
    SpecificationError,
    override,
    read_test,
    write_test,
)
from ramiefenics.cli import main
from ramiefenics.model.laws import check_law, law_content, law_named
from ramiefenics.runs import Simulation
from ramiefenics.specification.files import archive_test
from ramiefenics.verification.point import Point

PAGE = Path(__file__).parents[1] / "CONTRIBUTING.md"
LAYER = "stalk.layers.{}.material.law_constants.flow_strain=0.02"


@pytest.fixture
def file(tmp_path: Path) -> Path:
    """The file that the page on laws asks for."""
    page = PAGE.read_text().split("## Add a material law")[1].split("\n## ")[0]
    (block,) = re.findall(r"```python\n(.*?)```", page, flags=re.S)
    path = tmp_path / "mine.py"
    path.write_text(block)
    return path


@pytest.fixture
def own(coarse: BendingTest, file: Path) -> BendingTest:
    given = [LAYER.format(name) for name in ("xylem", "phloem")]
    return override(coarse, [f"law={file}", "protocol.travel_mm=0.5", *given])


def test_its_constants_are_given_per_layer_and_survive_a_file(
    own: BendingTest, tmp_path: Path
) -> None:
    write_test(own, tmp_path / "test.toml")
    assert read_test(tmp_path / "test.toml") == own
    assert "[stalk.layers.material.law_constants]" in (tmp_path / "test.toml").read_text()
    check_law(own)


def test_its_stress_flows(own: BendingTest, file: Path) -> None:
    material = own.stalk.layers[0].material
    point, shear = Point(str(file), material), material.elastic.G_XZ_MPa
    F = np.eye(3)
    F[0, 2] = 0.5
    second_piola = np.linalg.inv(F) @ point.stress(F)
    # 2 G times the elastic strain that remains
    assert second_piola[0, 2] == pytest.approx(2 * shear * 0.02)
    assert point.remember(F) > 0.0


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        (["law=hooke"], "law = 'hooke' must be one of .*saturating_fibre.* or a Python file"),
        (["law=nowhere.py"], r"law = 'nowhere\.py' must be a Python file"),
        ([LAYER.format("xylem").replace("0.02", "-1")], r"xylem\.material\.law_constants\.flow_"),
        ([LAYER.format("xylem").replace("0.02", "soft")], "must be a finite number"),
        ([LAYER.format("xylem").replace("flow", "yield")], "is not a constant of the law mine"),
        (["law=svk"], r"law_constants\.flow_strain = 0\.02 is not a constant of the law svk"),
    ],
)
def test_what_it_cannot_take_is_told(own: BendingTest, changes: list[str], message: str) -> None:
    with pytest.raises(SpecificationError, match=message):
        check_law(override(own, changes))


def test_a_required_constant_is_asked_for(coarse: BendingTest, file: Path) -> None:
    with pytest.raises(SpecificationError, match=r"xylem\.material\.law_constants\.flow_strain is"):
        check_law(override(coarse, [f"law={file}"]))


@pytest.mark.parametrize("text", ["x = 1", "from ramiefenics.model.laws.isotropic import *"])
def test_a_file_without_a_law_is_told(tmp_path: Path, text: str) -> None:
    (tmp_path / "none.py").write_text(text)
    with pytest.raises(SpecificationError, match="must define"):
        law_named(str(tmp_path / "none.py"))


def test_kept_runs_depend_on_the_content_of_the_file(own: BendingTest, file: Path) -> None:
    before, first = Simulation(own).keys(), law_named(str(file))
    moved = file.rename(file.with_name("moved.py"))
    assert Simulation(override(own, [f"law={moved}"])).keys() == before
    file.write_text(moved.read_text() + "\n# changed\n")
    assert Simulation(own).keys() != before
    assert law_named(str(file)) is not first
    assert law_content("svk") == "svk"


def test_a_relative_path_is_seen_from_the_folder_of_the_specification(
    own: BendingTest, file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "deep").mkdir()
    write_test(override(own, [f"law={file.name}"]), tmp_path / "deep" / "test.toml")
    assert 'law = "../mine.py"' in (tmp_path / "deep" / "test.toml").read_text()
    monkeypatch.chdir("/")
    assert Path(read_test(tmp_path / "deep" / "test.toml").law).samefile(file)


def test_it_goes_with_the_specification_of_a_result(
    own: BendingTest, file: Path, tmp_path: Path
) -> None:
    text = file.read_text()
    folder = tmp_path / "out"
    folder.mkdir()
    archive_test(own, folder / "specification.toml")
    file.unlink()
    moved = folder.rename(tmp_path / "elsewhere")
    assert (moved / "mine.py").read_text() == text
    kept = read_test(moved / "specification.toml")
    assert kept == override(own, [f"law={moved / 'mine.py'}"])
    check_law(kept)


@pytest.mark.slow
def test_it_bends_a_stalk_from_the_command_line(
    own: BendingTest, file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    soon = [LAYER.format(name).replace("0.02", "0.005") for name in ("xylem", "phloem")]
    own = override(own, ["protocol.travel_mm=1.5", *soon])
    write_test(override(own, ["law=svk"]), tmp_path / "test.toml")
    out = tmp_path / "out"
    again = tmp_path / "again"
    for words in (
        [tmp_path / "test.toml", "--law", file, "--out", out],
        [out / "specification.toml", "--out", again],
    ):
        monkeypatch.setattr("sys.argv", ["ramiefenics", "bend", *map(str, words)])
        with pytest.raises(SystemExit) as stop:
            main()
        assert not stop.value.code
        file.unlink(missing_ok=True)
    curve = pd.read_csv(out / "curve.csv")
    assert curve["dissipated_Nmm"].iloc[-1] > 0.0
    assert (again / "curve.csv").read_bytes() == (out / "curve.csv").read_bytes()
    assert (again / "mine.py").read_bytes() == (out / "mine.py").read_bytes()

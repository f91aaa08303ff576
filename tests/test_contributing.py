"""The instructions of CONTRIBUTING.md for a data format and for an effect work as written."""

from __future__ import annotations

import math
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from mpi4py import MPI

import ramiefenics as rf
from ramiefenics.cli.effects import add_effects
from ramiefenics.effects import load_effects
from ramiefenics.verification.point import Point

ROOT = Path(__file__).parents[1]
TRAVEL = np.linspace(0.0, 14.0, 57)
FORCE = 84.0 * np.sin(np.pi * TRAVEL / 20.0)


@pytest.fixture
def page() -> str:
    text = (ROOT / "CONTRIBUTING.md").read_text()
    return text.partition("## Add a data format")[2].partition("\n## ")[0]


@pytest.fixture
def code(page: str) -> str:
    (block,) = re.findall(r"```python\n(.*?)```", page, re.DOTALL)
    return block


@pytest.fixture
def raw(tmp_path: Path) -> Path:
    """File of a testing machine with a curve that reaches 84 N at 10 mm."""
    rows = [f"{d / 0.01:.3f}|{f / 9.80665:.6f}" for d, f in zip(TRAVEL, FORCE, strict=True)]
    path = tmp_path / "stalk.txt"
    path.write_text("\n".join(["stroke|load", *rows]) + "\n")
    return path


def check(curve: object) -> None:
    assert curve["displacement_mm"].to_numpy() == pytest.approx(TRAVEL, abs=1e-4)
    assert curve["force_N"].to_numpy() == pytest.approx(FORCE, abs=1e-4)


def run(folder: Path, words: list[str]) -> None:
    """Run the command line with the package in a folder that also has the user's files."""
    environment = {**os.environ, "PYTHONPATH": str(folder)}
    command = [sys.executable, "-m", "ramiefenics", *words]
    subprocess.run(command, check=True, env=environment, cwd=folder, capture_output=True)


def test_a_format_of_the_users_own_file(code: str, page: str, raw: Path, tmp_path: Path) -> None:
    (tmp_path / "press.py").write_text(code)
    rf.write_test(rf.ramie(14.23, 7.28, 0.67), tmp_path / "mine.toml")
    (tmp_path / "ramiefenics").symlink_to(ROOT / "ramiefenics")
    (line,) = re.findall(r"^    ramiefenics (import .*)$", page, re.MULTILINE)
    run(tmp_path, line.replace("RAW...", raw.name).split())
    dataset = rf.read_dataset(tmp_path / "my_stalks")
    check(dataset.records[0].curve)
    assert dataset.layout.format == "press.py"
    assert (tmp_path / "my_stalks/press.py").read_text() == code


def test_a_format_of_the_package_is_one_file_and_one_line(
    code: str, raw: Path, tmp_path: Path
) -> None:
    ignored = shutil.ignore_patterns("__pycache__", "*.msh")
    shutil.copytree(ROOT / "ramiefenics", tmp_path / "ramiefenics", ignore=ignored)
    readers = tmp_path / "ramiefenics/measured/readers"
    (readers / "press.py").write_text(code)
    table = (readers / "__init__.py").read_text()
    listed = table.replace("(HEADINGS, COLUMNS)", "(HEADINGS, COLUMNS, PRESS)")
    assert listed != table
    line = "from ramiefenics.measured.readers.press import PRESS\n"
    first, rest = listed.split("from ramiefenics.specification import", 1)
    (readers / "__init__.py").write_text(
        f"{first}{line}from ramiefenics.specification import{rest}"
    )
    run(tmp_path, ["import", raw.name, "--format", "press", "--baseline", "table3", "--out", "set"])
    (specimen,) = rf.read_dataset(tmp_path / "set").records
    check(specimen.curve)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (("stroke", "way"), r"stalk\.txt' cannot be read by the reader press \(KeyError: 'way'\)"),
        (("force_N", "load_N"), "reader press must return a RawCurve with displacement_mm and"),
        (('"press"', '"our press"'), "reader.name = 'our press' must be one word"),
        (("PRESS = ", "OTHER = PRESS = "), "must define one Reader, not press, press"),
        (("PRESS = Reader", "PRESS = str"), "does not run"),
        (('("press"', '("force", "", read_press), Reader("press"'), "must define at least one"),
        (("9.80665", "0.0"), r"force_N = 0\.0 must change by"),
    ],
)
def test_a_faulty_reader_is_told(
    change: tuple[str, str], message: str, code: str, raw: Path, tmp_path: Path
) -> None:
    (tmp_path / "own.py").write_text(code.replace(*change))
    with pytest.raises(rf.SpecificationError, match=message):
        rf.read_raw([raw], tmp_path / "own.py")


def test_options_that_a_format_has_not_are_refused(raw: Path) -> None:
    with pytest.raises(rf.SpecificationError, match=r"rate_Hz = 5\.0 must be left out"):
        rf.read_raw([raw], "headings", rate_Hz=5.0)


@pytest.fixture
def effects(tmp_path: Path) -> str:
    """The section of the page on effects, whose example files are written."""
    text = (ROOT / "CONTRIBUTING.md").read_text()
    page = text.partition("## Add an effect")[2].partition("\n## ")[0]
    blocks = re.findall(r"```python\n(.*?)```", page, re.DOTALL)
    for name, block in zip(("worn.py", "tearing.py"), blocks, strict=True):
        assert block.count("\n") < 40
        (tmp_path / name).write_text(block)
    return page


def test_an_effect_of_the_users_own_file(effects: str, tmp_path: Path) -> None:
    (tmp_path / "ramiefenics").symlink_to(ROOT / "ramiefenics")
    (line,) = re.findall(r"^    ramiefenics (effects .*)$", effects, re.MULTILINE)
    run(tmp_path, line.split())
    (effect,) = load_effects(tmp_path / "worn.py").values()
    words, _ = re.findall(r"^    ramiefenics bend (.*)$", effects, re.MULTILINE)
    test = rf.override(rf.ramie(14.23, 7.28, 0.67), ["numerics.mesh=screening"])
    bent = add_effects(test, [words.split()[-1]], [str(tmp_path / "worn.py")])
    assert bent == effect.apply(test, 2.0)
    assert (bent.fixture.other_support_radius_mm, bent.numerics.domain) == (7.0, "half")
    assert effect.apply(test, 0.0) == test


def test_an_effect_of_the_users_own_file_that_remembers(
    effects: str, coarse: rf.BendingTest, tmp_path: Path
) -> None:
    _, words = re.findall(r"^    ramiefenics bend (.*)$", effects, re.MULTILINE)
    torn = add_effects(coarse, [words.split()[-1]], [str(tmp_path / "tearing.py")])
    assert load_effects(tmp_path / "tearing.py")["tearing"].apply(coarse, 0.0) == coarse
    material = torn.stalk.layers[0].material
    own, sound = Point(torn.law, material), Point(coarse.law, coarse.stalk.layers[0].material)
    far, near = np.diag([1.0, 1.0, 1.04]), np.diag([1.0, 1.0, 1.01])
    for most in (near, far):  # largest stored energy so far
        assert own.remember(most) > 0.0
        left = 1 - 0.5 * (1 - math.exp(-sound.energy(most) / 0.5))
        assert own.stress(near) == pytest.approx(left * sound.stress(near), rel=1e-9)


@pytest.mark.slow
def test_that_effect_bends_a_stalk_and_back(
    effects: str, coarse: rf.BendingTest, tmp_path: Path
) -> None:
    path = ["protocol.travel_mm=2", "protocol.then=[{to_mm=0.5}]", "numerics.acoustic_check=false"]
    effect = load_effects(tmp_path / "tearing.py")["tearing"]
    result = rf.simulate(effect.apply(rf.override(coarse, path), 0.8), MPI.COMM_SELF)
    assert result.completed, result.ending.reason
    assert result.curve["dissipated_Nmm"].iloc[-1] > 0.0

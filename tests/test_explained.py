"""Every key of a specification is explained, on the command line and in the reference."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

import ramiefenics as rf
from ramiefenics.specification.explained import explained, keys
from ramiefenics.specification.files import value_at

pytestmark = pytest.mark.filterwarnings("ignore::ramiefenics.SpecificationWarning")


def test_every_key_has_a_meaning() -> None:
    """A field that is missing from its class's docstring has none, and raises an error."""
    told = list(keys())
    assert len({key.path for key in told}) > 90
    assert all(key.meaning.endswith((".", ":")) or key.meaning for key in told)
    by_path = {key.path: key for key in told}
    assert by_path["fixture.span_mm"].default == "100.0"
    assert by_path["stalk.length_mm"].default == ""
    assert "s_c / G_XZ" in by_path["stalk.layers.NAME.material.large_strain.fibre_strength"].meaning


def test_defaults_are_those_of_the_classes(screening: rf.BendingTest) -> None:
    told = {key.path: key for key in keys() if key.default and "NAME" not in key.path}
    for path in ("machine.load_scale", "protocol.speed_mm_per_s", "numerics.contact.theta"):
        assert float(told[path].default) == value_at(screening, path)


@pytest.mark.parametrize("name", ["table3", "height-69cm"])
def test_an_explained_specification_is_the_same(name: str, tmp_path: Path) -> None:
    test = rf.published_test(name)
    (tmp_path / "test.toml").write_text(explained(test))
    assert rf.read_test(tmp_path / "test.toml") == test


@pytest.mark.parametrize("name", ["four_point", "cantilever", "unload_and_reload", "crushed_ring"])
def test_examples_survive_being_explained(name: str, tmp_path: Path) -> None:
    test = rf.read_test(Path(__file__).parents[1] / f"docs/examples/{name}.toml")
    (tmp_path / "test.toml").write_text(explained(test))
    assert rf.read_test(tmp_path / "test.toml") == test


def run(*arguments: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "ramiefenics", *arguments]
    return subprocess.run(command, capture_output=True, text=True, check=False)


def test_new_writes_a_file_and_never_over_one(tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    assert run("new", str(path), "--set", "fixture.span_mm=80").returncode == 0
    assert rf.read_test(path).fixture.span_mm == 80.0
    assert "# Thickness along Z of a node" in path.read_text()
    before = path.read_text()
    again = run("new", str(path))
    assert again.returncode == 2
    assert len(again.stderr.strip().splitlines()) == 1
    assert "must not exist yet" in again.stderr
    assert path.read_text() == before


def test_the_version_is_told() -> None:
    done = run("--version")
    assert done.stdout == f"ramiefenics {rf.__version__}\n"
    assert done.returncode == 0

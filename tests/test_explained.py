"""Every key of a specification is explained, on the command line and in the reference."""

from __future__ import annotations

import inspect
import re
import subprocess
import sys
from functools import cached_property
from pathlib import Path

import pytest

import ramiefenics as rf
from ramiefenics.model.observables import Observables
from ramiefenics.specification.explained import SYMBOLS, attributes, explained, keys
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


def test_every_number_has_a_unit_and_required_keys_are_told() -> None:
    by_path = {key.path: key for key in keys()}
    units = {path: by_path[f"stalk.{path}"].unit for path in ("length_mm", "taper", "place_mm")}
    assert units == {"length_mm": "mm", "taper": "1", "place_mm": "mm"}
    assert by_path["stalk.curvature_per_m"].unit == "1/m"
    assert by_path["numerics.stepping.max_iterations"].unit == by_path["law"].unit == ""
    assert by_path["stalk.length_mm"].required
    assert not by_path["stalk.section_height_mm"].required


def test_symbols_are_those_of_the_page_on_the_model() -> None:
    last = {key.path.rpartition(".")[2] for key in keys()}
    assert set(SYMBOLS) <= last
    page = (Path(__file__).parents[1] / "docs/model.md").read_text()
    for row in re.findall(r"^\| `(?:E_X|s_c|h|gamma_Y|R|d)`.*$", page, re.MULTILINE):
        symbols, told = ([*re.findall(r"`([^`]+)`", cell)] for cell in row.split("|")[1:3])
        for symbol, key in zip(symbols, told, strict=True):
            assert SYMBOLS[key.rpartition(".")[2]].partition(" / ")[0] == symbol


def test_no_two_attributes_share_an_entry() -> None:
    """Sphinx reads "a, b" as a name and a type, and `new` would repeat the comment."""
    things = [getattr(rf, name) for name in rf.__all__]
    for cls in (*filter(inspect.isclass, things), Observables):
        assert not [name for name in attributes(cls) if "," in name], cls


def test_signatures_in_the_reference_are_short() -> None:
    """The default of an argument is a plain value, rather than a function or a table."""
    for thing in filter(inspect.isfunction, (getattr(rf, name) for name in rf.__all__)):
        for argument in inspect.signature(thing).parameters.values():
            assert len(repr(argument.default)) < 60, (thing, argument.name)
            assert not inspect.isfunction(argument.default), (thing, argument.name)


def test_no_first_line_of_a_property_has_a_colon() -> None:
    """Sphinx reads what is before a colon as the property's type."""
    for cls in filter(inspect.isclass, (getattr(rf, name) for name in rf.__all__)):
        own = inspect.getmembers(cls, lambda one: isinstance(one, (property, cached_property)))
        for name, found in own:
            if cls.__module__.startswith("ramiefenics") and not name.startswith("_"):
                assert ":" not in (inspect.getdoc(found) or "").partition("\n")[0], (cls, name)


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
    before = path.read_text()
    assert "# Thickness along Z of a node" in before
    assert "# Young's modulus along the fibres. Unit: MPa.\nE_Z_MPa" in before
    assert "nu_XZ / E_X = nu_ZX / E_Z" in before
    assert "# Axes: Z along the stalk" in before.partition("\n\n")[0]
    for wrong in ("``", "None", "docs/", "\n#\n"):
        assert wrong not in before
    shared = re.findall(r"^((?:# .*\n)+)[a-z]\w* = ", before.partition("[[stalk")[0], re.MULTILINE)
    assert len(set(shared)) == len(shared)
    again = run("new", str(path))
    assert again.returncode == 2
    assert len(again.stderr.strip().splitlines()) == 1
    assert "must not exist yet" in again.stderr
    assert path.read_text() == before


def test_the_version_is_told() -> None:
    done = run("--version")
    assert done.stdout == f"ramiefenics {rf.__version__}\n"
    assert done.returncode == 0

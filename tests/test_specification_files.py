"""Reading, writing and refusing specifications."""

from __future__ import annotations

import pickle
import re
import tomllib
from pathlib import Path

import pytest

from ramiefenics import (
    EFFECTS,
    BendingTest,
    SpecificationError,
    override,
    ramie,
    read_test,
    write_test,
)
from ramiefenics.cli import main
from ramiefenics.specification import mesh_recipe
from ramiefenics.specification.files import dump_test, from_dict, test_from_dict
from ramiefenics.specification.numerics import Numerics, Stepping

GOOD = """
[stalk]
length_mm = 180.0
void_diameter_mm = 7.28

[[stalk.layers]]
name = "xylem"
outer_diameter_mm = 12.89
[stalk.layers.material]
density_g_per_cm3 = 0.95
[stalk.layers.material.elastic]
E_X_MPa = 7.67
E_Z_MPa = 320.0
nu_XY = 0.32
nu_XZ = 0.04
G_XZ_MPa = 69.0

[fixture]
span_mm = 100.0
indenter_radius_mm = 5.0

[fixture.friction]
static = 0.59
dynamic = 0.12

[protocol]
travel_mm = 14.0

[numerics]
domain = "quarter"
mesh = "screening"
"""

# what is replaced in GOOD, by what, and what the sentence must say: field, value, what is allowed
BAD = [
    ("span_mm = 100.0", "spam_mm = 100.0", "fixture.spam_mm = 100.0 .*nearest .*'span_mm'"),
    ("span_mm = 100.0", "span_mm = 200.0", "fixture.span_mm = 200.0 must be below .* 180 mm"),
    ("span_mm = 100.0", "span_mm = -1.0", "fixture.span_mm = -1.0 must be .* at least 0 mm"),
    ("span_mm = 100.0", "span_mm = 18", "fixture.span_mm = 18.0 must be above 20 mm"),
    ("span_mm = 100.0", 'span_mm = "wide"', "fixture.span_mm = 'wide' must be a number"),
    ("span_mm = 100.0", "span_mm = nan", "fixture.span_mm = nan must be a number"),
    ("span_mm = 100.0", "span_mm = true", "fixture.span_mm = True must be a number"),
    ("radius_mm = 5.0", "radius_mm = 0.0", "indenter_radius_mm = 0.0 must be .* above 0 mm"),
    ("dynamic = 0.12", "dynamic = 0.7", "friction.dynamic = 0.7 must be at most .* 0.59"),
    ("static = 0.59", "static = -0.1", "friction.static = -0.1 must be .* at least 0"),
    ("travel_mm = 14.0", "travel_mm = inf", "protocol.travel_mm = inf must be .* above 0"),
    ('"quarter"', '"third"', "domain = 'third' must be one of 'quarter', 'half', 'full'"),
    ('"screening"', '"screning"', "mesh = 'screning' .*nearest is 'screening'"),
    ("length_mm = 180.0", "", "stalk.length_mm is required but missing"),
    ("length_mm = 180.0", "length_mm = 0", "stalk.length_mm = 0 must be .* above 0 mm"),
    ("= 12.89", "= 7.0", "xylem.outer_diameter_mm = 7.0 must be above .* 7.28 mm"),
    ('name = "xylem"', 'name = "the wood"', "name = 'the wood' must be one word"),
    ("nu_XZ = 0.04", "nu_XZ = 0.2", "nu_XZ = 0.2 .*positive definite.*eigenvalue.*below 0.09027"),
    ("nu_XY = 0.32", "nu_XY = 1.0", "elastic.nu_XY = 1.0 must be .* below 1"),
    ("E_Z_MPa = 320.0", "E_Z_MPa = 0", "elastic.E_Z_MPa = 0 must be .* above 0 MPa"),
    ("G_XZ_MPa = 69.0", "G_YZ_MPa = 69.0", "G_YZ_MPa = 69.0 .*nearest .* 'G_XZ_MPa'"),
    ("E_X_MPa = 7.67\n", "", "elastic.E_X_MPa is required but missing"),
    ("density_g_per_cm3 = 0.95", "density_g_per_cm3 = 0", "density_g_per_cm3 = 0 must be"),
    ("[[stalk.layers]]", "[stalk.layers]", r"stalk.layers = .* must be a list of tables"),
    ("[protocol]", "[protocoll]", "protocoll = .*nearest .*'protocol'"),
    ("[protocol]", "[protocol", "is not valid TOML"),
    ('domain = "quarter"', "domain = 4", "numerics.domain = 4 must be one of"),
    ('mesh = "screening"', "mesh = 3", "numerics.mesh = 3 must be a table"),
    ("[[stalk.layers]]", "[stalk]\nlayers = [1]\n[x]", "is not valid TOML"),
    ('domain = "quarter"', "contact.theta = 1.0", "contact.theta = 1.0 must be one of -1, 0, 1"),
    ("G_XZ_MPa = 69.0", "G_XZ_MPa = 2025-01-01", "G_XZ_MPa = datetime.* must be a number"),
]


def test_good_file_reads(tmp_path: Path) -> None:
    path = tmp_path / "good.toml"
    path.write_text(GOOD)
    test = read_test(path)
    assert test.stalk.layers[0].material.elastic.E_Z_MPa == 320.0
    assert test.numerics.mesh.name == "screening"


@pytest.mark.parametrize(("find", "put", "sentence"), BAD)
def test_bad_file_gets_one_sentence(
    find: str,
    put: str,
    sentence: str,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    assert find in GOOD
    path = tmp_path / "bad.toml"
    path.write_text(GOOD.replace(find, put, 1))
    out = tmp_path / "out"
    monkeypatch.setattr("sys.argv", ["ramiefenics", "bend", str(path), "--out", str(out)])
    with pytest.raises(SystemExit) as stop:
        main()
    told = capsys.readouterr().err
    assert stop.value.code == 2
    assert re.search(sentence, told)
    assert told.count("\n") == 1
    assert not out.exists()


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["bend", "nowhere.toml"], "nowhere.toml' cannot be read"),
        (["bend", "table9"], "test = 'table9' must be one of table3"),
        (["bend", "--mesh", "finest"], "numerics.mesh = 'finest' is not a mesh recipe"),
        (["bend", "--set", "fixture.span_mm"], "must be of the form key=value"),
        (["bend", "--set", "stalk.layers.bark.outer_diameter_mm=3"], "nearest|known: xylem"),
        (["bend", "--set", "=3"], "must be of the form key=value"),
        (["bend", "--set", "stalk.layers.phloem=3"], "must name a value of a layer"),
        (
            [
                "bend",
                "--set",
                "stalk.layers.phloem.material.large_strain.fibre_residual_tangent=99",
            ],
            "stalk.layers.phloem.material.large_strain.fibre_residual_tangent = 99.0 must be below",
        ),
        (["bend", "--set", "law=hooke"], "law = 'hooke' must be one of"),
        (
            ["bend", "--out", "/dev/null/x"],
            "out = '/dev/null/x' must be a writable folder",
        ),
        (["mesh", "stalk.stl"], "out = 'stalk.stl' must end in .msh"),
    ],
)
def test_bad_command_gets_one_sentence(
    arguments: list[str],
    sentence: str,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("sys.argv", ["ramiefenics", *arguments])
    with pytest.raises(SystemExit) as stop:
        main()
    told = [line for line in capsys.readouterr().err.splitlines() if not line.startswith("note: ")]
    assert stop.value.code == 2
    assert len(told) == 1
    assert re.search(sentence, told[0])


@pytest.mark.filterwarnings("ignore:G_XY_MPa")
def test_written_file_reads_back_equal(tmp_path: Path) -> None:
    test = override(
        ramie(14.23, 7.28, 0.67),
        ["stalk.layers.phloem.material.elastic.G_XY_MPa=3.09", "law=svk", "numerics.domain=full"],
    )
    write_test(test, tmp_path / "test.toml")
    assert read_test(tmp_path / "test.toml") == test


def test_override_reaches_layers_by_name_and_leaves_the_rest() -> None:
    before = ramie(14.23, 7.28, 0.67)
    after = override(before, ["stalk.layers.xylem.material.elastic.E_Z_MPa = 300"])
    assert after.stalk.layers[0].material.elastic.E_Z_MPa == 300.0
    assert after.stalk.layers[1] == before.stalk.layers[1]
    assert before.stalk.layers[0].material.elastic.E_Z_MPa == 320.0


def test_override_of_a_laws_own_constant_leaves_the_test_it_started_from() -> None:
    before = EFFECTS["fibre_yield"].apply(ramie(14.23, 7.28, 0.67), 0.3)
    key = "stalk.layers.phloem.material.law_constants.yield_strain"
    after = override(before, [f"{key}=0.5"])
    found = [test.stalk.layers[-1].material.law_constants for test in (before, after)]
    assert [constants["yield_strain"] for constants in found] == [0.01, 0.5]


def test_specification_cannot_be_changed() -> None:
    test: BendingTest = ramie(14.23, 7.28, 0.67)
    with pytest.raises(AttributeError):
        test.law = "svk"  # type: ignore[misc]


def test_specification_printed_is_the_one_that_runs(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sys.argv", ["ramiefenics", "specification", "--set", "fixture.span_mm=90"])
    with pytest.raises(SystemExit) as stop:
        main()
    assert not stop.value.code
    path = tmp_path / "printed.toml"
    path.write_text(capsys.readouterr().out)
    assert read_test(path) == override(ramie(14.23, 7.28, 0.67), ["fixture.span_mm=90"])


def test_error_names_field_value_and_remedy() -> None:
    error = SpecificationError("span_mm", 3, "must be above 20 mm").inside("fixture")
    assert str(pickle.loads(pickle.dumps(error))) == str(error)  # as workers send it
    assert str(error) == "fixture.span_mm = 3 must be above 20 mm."


def test_a_step_or_mesh_setting_moves_what_it_contradicts(screening: BendingTest) -> None:
    short = override(screening, ["numerics.stepping.max_step_mm=0.02"]).numerics.stepping
    assert (short.min_step_mm, short.first_step_mm, short.max_step_mm) == (0.02, 0.02, 0.02)
    early = override(screening, ["numerics.stepping.first_step_mm=0.01"]).numerics.stepping
    assert (early.min_step_mm, early.first_step_mm, early.max_step_mm) == (0.01, 0.01, 1.0)
    fine = override(screening, ["numerics.mesh.coarse_size=0.01"]).numerics.mesh
    assert fine.contact_size == fine.coarse_size == 0.01
    assert override(screening, ["numerics.mesh.order=1"]).numerics.mesh.serendipity is False


def test_what_is_stated_is_kept_and_defaults_move(screening: BendingTest) -> None:
    def steps(found: Stepping) -> tuple[float, float, float]:
        return found.min_step_mm, found.first_step_mm, found.max_step_mm

    assert steps(Stepping(first_step_mm=5.0)) == (0.05, 5.0, 5.0)
    long = override(screening, ["numerics.stepping.first_step_mm=5"])
    assert steps(long.numerics.stepping) == (0.05, 5.0, 5.0)
    least = override(screening, ["numerics.stepping.min_step_mm=3"]).numerics.stepping
    assert steps(least) == (3.0, 3.0, 3.0)
    again = override(long, ["numerics.stepping.first_step_mm=0.5"]).numerics.stepping
    assert again.first_step_mm == 0.5
    mesh = override(screening, ["numerics.mesh=ladder_q2_5", "contact_size=0.08"]).numerics.mesh
    assert (mesh.contact_size, mesh.coarse_size) == (0.08, 0.08)
    assert test_from_dict(tomllib.loads(dump_test(long))) == long


@pytest.mark.parametrize(
    ("stated", "message"),
    [
        (
            ("stepping.first_step_mm=5", "stepping.max_step_mm=2"),
            "numerics.stepping.first_step_mm = 5 must be at most max_step_mm, 2 mm.",
        ),
        (
            ("mesh.coarse_size=0.05", "mesh.contact_size=0.08"),
            "numerics.mesh.contact_size = 0.08 must be at most coarse_size, 0.05.",
        ),
        (
            ("mesh.contact_size=0.2",),
            "numerics.mesh.contact_size = 0.2 must be a number at most 0.09.",
        ),
    ],
)
def test_stated_values_that_contradict_each_other_are_refused(
    screening: BendingTest, stated: tuple[str, ...], message: str
) -> None:
    with pytest.raises(SpecificationError) as refused:
        override(screening, [f"numerics.{one}" for one in stated])
    assert str(refused.value) == message


def test_an_unknown_mesh_recipe_is_named_with_its_field(screening: BendingTest) -> None:
    for asked, field in (
        (lambda: mesh_recipe("nosuch"), "mesh"),
        (lambda: override(screening, ["numerics.mesh=nosuch"]), "numerics.mesh"),
        (lambda: from_dict(Numerics, {"mesh": "nosuch"}), "mesh"),
    ):
        with pytest.raises(SpecificationError, match=f"^{field} = 'nosuch' is not a mesh recipe"):
            asked()


@pytest.mark.parametrize("name", ["min_step_mm", "max_step_mm", "first_step_mm"])
def test_steps_are_positive(screening: BendingTest, name: str) -> None:
    with pytest.raises(SpecificationError, match=f"{name} = 0 must be a number above 0"):
        override(screening, [f"numerics.stepping.{name}=0"])

"""The command `effects`, and effects given to `bend`."""

from __future__ import annotations

import re
import runpy
import sys
from pathlib import Path

import pytest

import ramiefenics as rf
from ramiefenics.cli import main
from ramiefenics.cli.effects import add_effects, suspects
from ramiefenics.effects.combining import exclusions, with_effects

OWN = """
from ramiefenics import Effect, override

def blunt(test, mm):
    return override(test, [f"fixture.indenter_radius_mm={test.fixture.indenter_radius_mm + mm}"])

BLUNT = Effect("blunt", "The indenter is worn.", "the workshop", "mm", (0.0, 5.0), 1.0, blunt)
"""


@pytest.fixture
def own(tmp_path: Path) -> Path:
    (tmp_path / "own.py").write_text(OWN)
    return tmp_path / "own.py"


def run(monkeypatch: pytest.MonkeyPatch, *words: str) -> int:
    monkeypatch.setattr(sys, "argv", ["ramiefenics", *words])
    with pytest.raises(SystemExit) as ended:
        main()
    return int(ended.value.code or 0)


def test_all_effects_are_listed(monkeypatch, capsys, own: Path) -> None:
    assert run(monkeypatch, "effects", "--effects", str(own)) == 0
    told = capsys.readouterr().out
    for effect in rf.EFFECTS.values():
        unit = "" if effect.unit == "1" else f" {effect.unit}"
        assert f"{effect.name}, typically {effect.typical:g}{unit}: " in told
    assert "blunt, typically 1 mm: The indenter is worn." in told


def test_one_effect_is_told_in_full(monkeypatch, capsys) -> None:
    assert run(monkeypatch, "effects", "stiffness_gradient") == 0
    told = " ".join(capsys.readouterr().out.split())
    effect = rf.EFFECTS["stiffness_gradient"]
    for part in (effect.physics, effect.reference, effect.enters, "stalk.position_mm", "-1 to 1"):
        assert part in told
    assert run(monkeypatch, "effects", "seating_gap") == 0
    assert "different in every specimen" in capsys.readouterr().out


def test_every_shipped_effect_says_where_it_enters() -> None:
    assert all(effect.enters for effect in rf.EFFECTS.values())


def test_bend_applies_effects_in_their_order_and_writes_what_it_bent(
    coarse: rf.BendingTest, monkeypatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(rf.BendingResult, "figures", lambda _: {})  # seconds
    short = rf.override(coarse, ["protocol.travel_mm=0.5", "numerics.acoustic_check=false"])
    rf.write_test(short, tmp_path / "mine.toml")
    out = tmp_path / "out"
    options = ["--effect", "load_scale=0.2", "--effect", "span_error=-8", "--out", str(out)]
    assert run(monkeypatch, "bend", str(tmp_path / "mine.toml"), *options) == 0
    pair = [(rf.EFFECTS["load_scale"], 0.2), (rf.EFFECTS["span_error"], -8.0)]
    assert rf.read_test(out / "specification.toml") == with_effects(short, pair)


def test_the_domain_that_an_effect_needs_is_chosen_and_said(coarse: rf.BendingTest, capsys) -> None:
    test = add_effects(coarse, ["off_centre_indenter=5"], None)
    assert test.numerics.domain == "half"
    told = capsys.readouterr().err
    assert "note: the half model is used, as the effects break the symmetry of the quarter" in told
    assert add_effects(coarse, ["load_scale=0.1"], None).numerics.domain == "quarter"
    assert capsys.readouterr().err == ""


def test_an_effect_of_the_users_own_file(coarse: rf.BendingTest, own: Path) -> None:
    assert add_effects(coarse, ["blunt=2"], [str(own)]).fixture.indenter_radius_mm == 7.0


@pytest.mark.parametrize(
    ("given", "message"),
    [
        (["pith=0.4"], "--effect = 'pith' is not an effect, .*; known: machine_compliance"),
        (["pith_cor=0.4"], "the nearest is 'pith_core'"),
        (["pith_core"], "--effect = 'pith_core' must be of the form name=number"),
        (["pith_core=much"], "must be of the form name=number"),
        (["pith_core=nan"], "must be of the form name=number"),
        (["pith_core=0.1", "pith_core=0.2"], "'pith_core=0.2' must not be given twice"),
        (["pith_core=6"], r"effect pith_core = 6\.0 must be .* at most 5 MPa"),
    ],
)
def test_what_cannot_be_added_is_told(
    coarse: rf.BendingTest, given: list[str], message: str
) -> None:
    with pytest.raises(rf.SpecificationError, match=message):
        add_effects(coarse, given, None)


def test_suspects_are_the_six_unless_others_are_named(own: Path) -> None:
    assert list(suspects(None, None, rf.SUSPECTS)) == list(rf.SUSPECTS)
    assert list(suspects(["all"], [str(own)], rf.SUSPECTS)) == [*rf.EFFECTS, "blunt"]
    assert list(suspects(["friction"], [str(own)], rf.SUSPECTS)) == ["friction", "blunt"]
    sentence = "--suspect = 'blunt' is not an effect"
    with pytest.raises(rf.SpecificationError, match=re.escape(sentence)):
        suspects(["blunt"], None, rf.SUSPECTS)


def test_effects_that_exclude_each_other_are_found(screening: rf.BendingTest) -> None:
    assert not exclusions(screening, {n: rf.EFFECTS[n] for n in ("friction", "taper", "pith_core")})


def test_the_page_of_effects_is_what_they_say_of_themselves() -> None:
    root = Path(__file__).parents[1]
    page = runpy.run_path(str(root / "benchmarks/effects.py"))["page"]
    assert page() == (root / "docs/effects.md").read_text(encoding="utf-8")

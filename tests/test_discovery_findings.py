"""Claims and reservations in the findings of a discovery."""

from types import SimpleNamespace

import numpy as np
import pytest

import ramiefenics as rf
from ramiefenics.discovery.places import places
from ramiefenics.discovery.report.findings import findings
from ramiefenics.discovery.statistics.gain import Gain
from ramiefenics.discovery.statistics.hidden import Limit
from ramiefenics.discovery.statistics.verdict import INDIFFERENT, UNFITTED, decide

BETTER, NONE = (0.4, 0.8), (0.8, 1.1)
GROUPS = {"cause": (("taper",),), "ambiguous": (("taper", "pith_core"),)}


def found(verdict: str, moves=None, curves=BETTER, shapes=BETTER, **values):
    errors = np.ones((3, 5))
    groups = values.pop("groups", GROUPS.get(verdict, ()))
    fields = {
        "verdict": verdict,
        "groups": groups,
        "p_value": 0.0005,
        "fitted_none": 0.0001,
        "misfit_p_value": 0.25,
        "conflict_p_value": 0.0002,
        "amplitudes": {group[0]: 0.01 for group in groups},
        "effects": rf.SUSPECTS,
        "interval": lambda name: (0.008, 0.012),
        "sd_between_specimens": {},
        "gain": Gain(errors, 0.7 * errors, 2.0 * errors, curves),
        "shape_gain": Gain(errors, 0.7 * errors, 2.0 * errors, shapes),
        "posterior": SimpleNamespace(
            inclusion=lambda: {"taper": 0.6, "pith_core": 0.39},
            names=("taper", "pith_core"),
            probable=lambda: values.pop("sets", {}),
        ),
        "extended": object() if groups else None,
        "reasons": {},
        "limits": {},
        "broken": (),
        "next_experiment": "",
        "condition_gain": None,
        "anatomy": None,
        "factor_moves": moves or {"xylem.axial": 0.5, "phloem.axial": -1.0},
        "dataset": SimpleNamespace(layout=SimpleNamespace(fit_sd=0.1)),
    }
    return SimpleNamespace(**(fields | values))


@pytest.mark.parametrize("verdict", ["cause", "ambiguous"])
@pytest.mark.parametrize(
    ("curves", "shapes", "said"),
    [
        (BETTER, NONE, None),
        (NONE, NONE, "the prediction of left-out specimens is not shown to improve"),
        (NONE, BETTER, "not shown to improve; only that of their shapes is"),
    ],
)
def test_the_first_sentence_says_where_no_gain_is_measured(verdict, curves, shapes, said):
    first = findings(found(verdict, curves=curves, shapes=shapes))[0]
    assert ("is not shown" in first) == (said is not None)
    assert said is None or said in first


def test_what_could_not_be_tried_is_told():
    reasons = {
        "taper": "rests on b alone: without it the log-evidence gain is 0.3",
        "node": INDIFFERENT,
        "span_error": "the stalk does not reach the end",
    }
    told = [line for line in findings(found("cause", reasons=reasons)) if "not be tried" in line]
    assert told == ["Suspects that could not be tried, for the reasons in the table: span error."]


def test_what_only_derivatives_speak_for_lowers_trust():
    told = findings(found("cause", reasons={"pith_core": UNFITTED, "taper": "jumps"}))
    assert [line for line in told if "trusted less" in line and "pith core" in line]
    assert not [line for line in findings(found("cause")) if "trusted less" in line]


def test_what_one_specimen_speaks_for_is_told_where_nothing_else_is():
    reasons = {"taper": "rests on b alone: without it the log-evidence gain is 0.3"}
    first = findings(found("none", {"xylem.axial": 0.5}, reasons=reasons))[0]
    assert "of any suspect supported by more than one specimen; taper (p = 0.0005)" in first
    assert "of any suspect (p = 0.0005)" in findings(found("none", {"xylem.axial": 0.5}))[0]


def test_what_one_specimen_speaks_for_is_told_beside_causes():
    reason = "rests on b alone: without it the log-evidence gain is 0.3"
    told = findings(found("cause", reasons={"pith_core": reason}))
    assert f"Pith core would be named as well, but {reason}." in told


def test_every_cause_is_named_with_its_size():
    first = findings(found("cause", groups=(("taper",), ("pith_core",))))[0]
    assert first.startswith("The causes are taper: 0.01 mm/mm (95 % interval 0.008 to 0.012) and ")
    assert "pith core: 0.01 MPa" in first


def test_it_is_told_by_how_much_specimens_differ():
    values = {"groups": (("load_offset",),), "sd_between_specimens": {"load_offset": 1.14}}
    first = findings(found("cause", **values))[0]
    assert "0.012) with a standard deviation of 1.1 N between specimens, p = " in first
    assert "between specimens" not in findings(found("cause"))[0]


@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_a_large_amplitude_is_doubted_whatever_its_sign(sign):
    typical = rf.SUSPECTS["span_error"].typical
    values = {"groups": (("span_error",),), "amplitudes": {"span_error": sign * 4.0 * typical}}
    assert "4 times the typical amplitude" in findings(found("cause", **values))[0]
    values["amplitudes"]["span_error"] = sign * 2.0 * typical
    assert "typical amplitude" not in findings(found("cause", **values))[0]


def test_a_group_is_told_with_how_probable_its_members_are():
    first = findings(found("ambiguous"))[0]
    assert "cannot tell which of these effects it is: taper (60%), pith core (39%)" in first
    both = findings(found("ambiguous", groups=(("seating_gap",), ("taper", "pith_core"))))[0]
    assert "The cause is seating gap" in both
    assert "Something is also missing" in both


def test_effects_that_come_together_are_told_as_sets():
    sets = {("seating_gap", "machine_compliance"): 0.86, ("taper",): 0.14}
    first = findings(found("ambiguous", sets=sets))[0]
    assert (
        "Probable combinations: seating gap and machine compliance (86%); or taper (14%)." in first
    )
    alone = {("taper",): 0.6, ("pith_core",): 0.4}
    assert "combinations" not in findings(found("ambiguous", sets=alone))[0]


def test_nothing_found_is_no_claim_that_nothing_is_missing():
    limits = {
        "taper": Limit(-0.01, 0.02, 0.09, ("xylem.axial", "mesh and simulator")),
        "pith_core": Limit(0.0, 0.1, 0.001, ()),
    }
    verdict, fitted, hidden = findings(found("none", limits=limits))
    assert "nothing is missing" not in verdict.lower()
    assert "xylem.axial, phloem.axial fitted" in verdict
    # exp(0.5 * 0.1) and exp(-1.0 * 0.1)
    assert "xylem.axial times 1.05 (+0.5 sd)" in fitted
    assert "phloem.axial times 0.905 (-1.0 sd)" in fitted
    assert "taper of -0.01 to 0.02 mm/mm (9 % of the peak, imitated by xylem.axial and" in hidden
    assert "pith" not in hidden  # 0.1 % of the peak is too little to mention


@pytest.mark.parametrize("verdict", ["none", "cause", "ambiguous", "unknown"])
def test_factors_that_went_far_are_told_with_any_verdict(verdict):
    far = found(verdict, {"xylem.axial": 0.5, "phloem.axial": -2.5})
    (told,) = (text for text in findings(far) if "imitate" in text)
    assert "phloem.axial times 0.779 (-2.5 sd)" in told  # exp(-2.5 * 0.1)
    assert "xylem" not in told
    assert not any("imitate" in text for text in findings(found(verdict)))


def test_what_is_open_comes_with_the_next_experiment():
    told = " ".join(findings(found("ambiguous", next_experiment="fixture.span_mm=70")))
    assert "a second test of each specimen with fixture.span_mm=70" in told
    assert "No second test" in findings(found("conflict", next_experiment="alone"))[1]


def test_a_conflict_blames_nothing_in_particular():
    first = findings(found("conflict", {"xylem.axial": 0.5, "phloem.axial": -2.5}))[0]
    assert "contradict their stated values" in first
    assert "p = 0.0002" in first
    assert "phloem.axial times 0.779 (-2.5 sd)" in first


def test_what_only_fitted_suspects_tell_says_so():
    first = findings(found("cause", p_value=0.02))[0]
    assert "p = 0.02, yet the probability of no effect is only 0.0001" in first


def test_broken_specimens_are_named_in_the_lead():
    assert "S03" in findings(found("none", broken=("S03",)))[1]


def test_the_unknown_says_what_came_nearest():
    first = findings(found("unknown"))[0]
    assert "no set of the suspects explains it well enough to be named" in first
    assert "the fit of the factors" in first  # nothing was suspected
    near = found("unknown", amplitudes={"taper": 0.01, "pith_core": 1.0})
    assert "the most probable set (taper and pith core)" in findings(near)[0]


@pytest.mark.parametrize(
    ("shown", "misfit", "conflict", "groups", "alone", "expected"),
    [
        (False, 0.5, 0.5, [], False, "none"),
        (False, 0.5, 1e-4, [], False, "conflict"),
        (True, 0.5, 0.5, [("taper",)], False, "cause"),
        (True, 0.5, 1e-4, [("taper",), ("pith_core",)], False, "cause"),
        (True, 0.5, 0.5, [("taper",), ("pith_core", "node")], False, "ambiguous"),
        (True, 1e-4, 0.5, [("taper",)], False, "unknown"),
        (True, 0.5, 0.5, [], False, "unknown"),  # significant, but no suspect in particular
        (True, 0.5, 0.5, [], True, "none"),  # only one specimen supports it
        (False, 1e-4, 1e-4, [], False, "unknown"),
    ],
)
def test_verdicts(shown, misfit, conflict, groups, alone, expected):
    assert decide(shown, misfit, conflict, groups, alone) == expected


@pytest.mark.parametrize("tried", [False, True])
def test_a_learned_function_leads_to_effects_that_were_not_tried(tried):
    errors = np.ones((3, 5))
    gain = Gain(errors, 0.7 * errors, 2.0 * errors, BETTER)
    place = places([rf.ramie(14.4, 7.4, 0.67)], 100.0, 14.0)["fibre"]
    anatomy = SimpleNamespace(
        place=place,
        probability={"fibre": 1.0},
        supported=True,
        misfit_p_value=0.5,
        gain=gain,
        shape_gain=gain,
    )
    effects = rf.EFFECTS if tried else rf.SUSPECTS
    said = findings(found("unknown", anatomy=anatomy, effects=effects))[1]
    hint = "It may stand for fibre yield or irreversible damage"
    assert (hint in said) is not tried

"""What the first lines of a discovery claim, and what they own up to."""

from types import SimpleNamespace

import numpy as np
import pytest

import ramiefenics as rf
from ramiefenics.discovery.findings import findings
from ramiefenics.discovery.verdict import Gain, Score

BETTER, NONE = (0.4, 0.8), (0.8, 1.1)


def found(verdict: str, moves=None, curves=BETTER, shapes=BETTER, **values):
    errors = np.ones((3, 5))
    scores = {name: Score(9.0, 0.01, 0.001) for name in ("pith_core", "taper")}
    return SimpleNamespace(
        **{
            "verdict": verdict,
            "causes": {"cause": ("taper",), "ambiguous": ("taper", "pith_core")}.get(verdict, ()),
            "p_value": 0.0005,
            "misfit_p_value": 0.25,
            "scores": scores,
            "effects": rf.SUSPECTS,
            "interval": lambda name: (0.008, 0.012),
            "gain": Gain(errors, 0.7 * errors, curves),
            "shape_gain": Gain(errors, 0.7 * errors, shapes),
            "extended": None,
            "factor_moves": moves or {"xylem.axial": 0.5, "phloem.axial": -1.0},
            "dataset": SimpleNamespace(layout=SimpleNamespace(fit_sd=0.1)),
            **values,
        }
    )


@pytest.mark.parametrize("verdict", ["cause", "ambiguous"])
@pytest.mark.parametrize(
    ("curves", "shapes", "said"),
    [
        (BETTER, NONE, None),
        (NONE, NONE, "a better prediction of specimens left out is not shown"),
        (NONE, BETTER, "not shown; only that of their shapes is"),
    ],
)
def test_the_first_sentence_says_where_no_gain_is_measured(verdict, curves, shapes, said):
    first = findings(found(verdict, curves=curves, shapes=shapes))[0].split(". Curves of")[0]
    assert ("is not shown" in first) == (said is not None)
    assert said is None or said in first


def test_nothing_found_is_no_claim_that_nothing_is_missing():
    verdict, fitted = findings(found("none"))
    assert "nothing is missing" not in verdict.lower()
    assert "xylem.axial, phloem.axial fitted" in verdict
    for error in ("span", "radius", "oval", "friction", "load cell"):
        assert error in verdict
    # exp(0.5 * 0.1) and exp(-1.0 * 0.1)
    assert "xylem.axial times 1.05 (+0.5 sd)" in fitted
    assert "phloem.axial times 0.905 (-1.0 sd)" in fitted


@pytest.mark.parametrize("verdict", ["none", "cause", "ambiguous", "unknown"])
def test_factors_that_went_far_are_told_with_any_verdict(verdict):
    told = findings(found(verdict, {"xylem.axial": 0.5, "phloem.axial": -2.5}))[1]
    assert "phloem.axial times 0.779 (-2.5 sd)" in told  # exp(-2.5 * 0.1)
    assert "xylem" not in told
    assert "imitate" in told
    assert not any("imitate" in text for text in findings(found(verdict)))


def test_the_unknown_may_be_several_suspects_together():
    assert "no single one of the suspects" in findings(found("unknown"))[0]
    assert "best of them" not in findings(found("unknown"))[0]  # none was fitted
    assert "best of them" in findings(found("unknown", extended=object()))[0]

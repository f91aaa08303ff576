"""What a discovery found, in words: the verdict, and what to know before believing it."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import TYPE_CHECKING

from ramiefenics.discovery.verdict import Gain

if TYPE_CHECKING:
    from ramiefenics.discovery.outcome import Discovery

FAR = 2.0
"""Standard deviations by which fitted factors may leave what was known of them without a word."""

ALIKE = (
    "a wrong span, cylinder radius or diameter, an oval section, friction, or the load cell's scale"
)
"""Errors that change curves nearly as other moduli would."""


def findings(found: Discovery) -> list[str]:
    """Return sentences, the verdict's first."""
    return [_verdict(found), *_factors(found)]


def _verdict(found: Discovery) -> str:
    p = f"p = {found.p_value:.2g}"
    if found.verdict == "none":
        return _nothing(found, p)
    if found.verdict == "unknown":
        left = "the fit of the factors" if found.extended is None else "the best of them"
        return (
            "Something is missing, and no single one of the suspects explains it "
            f"(what {left} leaves has p = {found.misfit_p_value:.2g})."
        )
    assert found.gain is not None  # a suspect was fitted
    assert found.shape_gain is not None
    gain = (
        f"Curves of specimens left out are predicted with an error of {_errors(found.gain)}; "
        f"the shape of these curves, with the specimen's own stiffness fitted, with an error of "
        f"{_errors(found.shape_gain)}."
    )
    names = " or ".join(name.replace("_", " ") for name in found.causes)
    but = _unshown(found.gain, found.shape_gain)
    if found.verdict == "ambiguous":
        return (
            f"Something is missing ({p}): {names}, which these data do not tell apart{but}. {gain}"
        )
    cause = found.causes[0]
    low, high = found.interval(cause)
    value = f"{found.scores[cause].amplitude:.3g}{with_space(found.effects[cause].unit)}"
    size = f"{value} (95 % interval {low:.3g} to {high:.3g})"
    return f"The cause is {names}: {size}, {p}{but}. {gain}"


def with_space(unit: str) -> str:
    """Return a unit as it follows a number."""
    return "" if unit == "1" else f" {unit}"


def _nothing(found: Discovery, p: str) -> str:
    alone = [n for n, s in found.scores.items() if s.log_likelihood_ratio is not None and s.reason]
    but = f", though {', '.join(alone)} would explain a single specimen" if alone else ""
    names = ", ".join(found.factor_moves)
    return (
        f"With {names} fitted, what is left is not told from noise by any suspect ({p}) nor as a "
        f"whole (p = {found.misfit_p_value:.2g}){but}. Errors that act nearly like other values of "
        f"these factors would not show: {ALIKE}."
    )


def _unshown(curves: Gain, shapes: Gain) -> str:
    """Return what follows where predictions of curves left out are not shown to be better."""
    if curves.shown:
        return ""
    only = "; only that of their shapes is" if shapes.shown else ""
    return f", but a better prediction of specimens left out is not shown{only}"


def _factors(found: Discovery) -> list[str]:
    """Return where the fitted factors went; unless nothing was found, only if that is far."""
    moves = found.factor_moves
    far = [name for name, move in moves.items() if abs(move) > FAR]
    told = []
    if far:
        told.append(
            f"More than {FAR:g} standard deviations from what was known (fit_sd = "
            f"{found.dataset.layout.fit_sd:g}): {_values(found, far)}. The factors may be so, or "
            f"they imitate an error that acts nearly alike: {ALIKE}."
        )
    if found.verdict == "none" and len(far) < len(moves):
        rest = [name for name in moves if name not in far]
        told.append(f"Fitted: {_values(found, rest)}.")
    return told


def _values(found: Discovery, names: Iterable[str]) -> str:
    sd = found.dataset.layout.fit_sd
    moves = found.factor_moves
    return ", ".join(f"{n} times {math.exp(sd * moves[n]):.3g} ({moves[n]:+.1f} sd)" for n in names)


def _errors(gain: Gain) -> str:
    low, high = gain.interval
    return (
        f"{gain.rmse_after_N:.2f} N instead of {gain.rmse_before_N:.2f} N "
        f"(ratio {gain.ratio:.2f}, 95 % interval {low:.2f} to {high:.2f})"
    )

"""Findings of a discovery in words: the verdict, and what to know before believing it."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import TYPE_CHECKING

from ramiefenics.discovery.report.wording import listed, with_space, words
from ramiefenics.discovery.statistics.gain import Gain
from ramiefenics.discovery.statistics.hidden import Limit
from ramiefenics.discovery.statistics.verdict import INDIFFERENT, SIGNIFICANCE, UNFITTED

if TYPE_CHECKING:
    from ramiefenics.discovery.report.outcome import Discovery

FAR = 2.0
"""Number of standard deviations up to which fitted factors may depart from what was known of them
without being mentioned."""

VISIBLE = 0.02
"""Share of the peak force above which an effect that could go unnoticed is mentioned."""

MOST = 4
"""Maximum number of suspects listed in a sentence."""

UNUSUAL = 3.0
"""Size of an amplitude, relative to the typical one, above which it is doubted."""


def findings(found: Discovery) -> list[str]:
    """Return the findings as sentences, that of the verdict first."""
    return [
        _verdict(found),
        *_better(found),
        *_one_specimen(found),
        *_next(found),
        *_unfitted(found),
        *_broken(found),
        *_factors(found),
        *_hidden(found),
        *_untried(found),
    ]


def _verdict(found: Discovery) -> str:
    p = _p_value(found)
    if found.verdict == "none":
        names = ", ".join(found.factor_moves)
        return (
            f"With {names} fitted, the residual as a whole cannot be told from noise "
            f"(p = {found.misfit_p_value:.2g}), nor can the contribution of any suspect "
            f"{_alone(found, p)}."
        )
    if found.verdict == "conflict":
        return (
            "The fitted factors contradict their stated values "
            f"(p = {found.conflict_p_value:.2g}), and no suspect explains this ({p}): "
            f"{_values(found, found.factor_moves)}. The stated values may be wrong, or something "
            "imitates a change of the factors."
        )
    if found.verdict == "unknown":
        return (
            "Something is missing, and no set of the suspects explains it well enough to be named "
            f"(gain of the best set: {p}; residual of {_left(found)}: "
            f"p = {found.misfit_p_value:.2g})."
        )
    return _named(found, p)


def _better(found: Discovery) -> list[str]:
    """Return how well curves are predicted with the effects that are named, or what was learned."""
    if found.verdict == "unknown":
        return _anatomy(found)
    if found.verdict not in ("cause", "ambiguous"):
        return []
    assert found.gain is not None  # something was suspected
    assert found.shape_gain is not None
    told = [_predictions(found.gain, found.shape_gain)]
    if found.condition_gain is not None:
        told.append(
            "Curves under a left-out condition are predicted from those of the same specimens "
            f"under the other conditions with an error of {_errors(found.condition_gain)}."
        )
    return told


def _p_value(found: Discovery) -> str:
    """Return the p-value in words, and the probability of no effect if that was decisive."""
    p = f"p = {found.p_value:.2g}"
    if found.extended is None or found.p_value < SIGNIFICANCE:
        return p
    none = f"the probability of no effect is only {found.fitted_none:.1g}"
    return f"{p}, yet {none} among the sets that were fitted"


def _anatomy(found: Discovery) -> list[str]:
    anatomy = found.anatomy
    if anatomy is None:
        return []
    tried = ", ".join(f"{name} {p:.0%}" for name, p in anatomy.probability.items())
    if not anatomy.supported:
        return [f"A free function inside the model does not explain it either (tried: {tried})."]
    rest = ""
    if anatomy.misfit_p_value < SIGNIFICANCE:
        rest = f" Its residual is more than noise (p = {anatomy.misfit_p_value:.2g})."
    return [
        f"Of the free functions inside the model, {anatomy.place.sentence} explains it best "
        f"({tried}).{rest}{_similar(found)}",
        _predictions(anatomy.gain, anatomy.shape_gain),
    ]


def _similar(found: Discovery) -> str:
    """Return which effects should be tried next where a function has been learned."""
    assert found.anatomy is not None
    names = [name for name in found.anatomy.place.similar if name not in found.effects]
    if not names:
        return ""
    either = " or ".join(map(words, names))
    return f" It may stand for {either}, which are tried only if asked for by --suspect."


def _alone(found: Discovery, p: str) -> str:
    alone = _resting(found)
    if not alone:
        return f"({p})"
    rest = "rests on a single one" if len(alone) == 1 else "each rest on a single one"
    return f"supported by more than one specimen; {listed(alone)} ({p}) {rest}"


def _one_specimen(found: Discovery) -> list[str]:
    """Return which effects are not named beside others, as a single specimen decides."""
    if found.verdict not in ("cause", "ambiguous"):
        return []
    return [
        f"{words(name).capitalize()} would be named as well, but {found.reasons[name]}."
        for name in _resting(found)
    ]


def _resting(found: Discovery) -> list[str]:
    """Return the effects for which a single specimen decides."""
    return [name for name, reason in found.reasons.items() if reason.startswith("rests on")]


def _left(found: Discovery) -> str:
    names = list(found.amplitudes)
    return f"the most probable set ({listed(names)})" if names else "the fit of the factors"


def _named(found: Discovery, p: str) -> str:
    sizes = [_size(found, name) for group in found.groups if len(group) == 1 for name in group]
    open_groups = [group for group in found.groups if len(group) > 1]
    assert found.gain is not None  # something was suspected
    assert found.shape_gain is not None
    but = _unshown(found.gain, found.shape_gain)
    told = []
    if sizes:
        told.append(f"The cause{' is' if len(sizes) == 1 else 's are'} {listed(sizes)}, {p}{but}.")
    for group in open_groups:
        probable = ", ".join(
            f"{words(name)} ({found.posterior.inclusion()[name]:.0%})" for name in group
        )
        also = " also" if sizes else ""
        tail = "" if sizes else f", {p}{but}"
        told.append(
            f"Something is{also} missing, and these data cannot tell which of these effects it "
            f"is: {probable}{tail}."
        )
    return " ".join([*told, *_sets(found)] if open_groups else told)


def _sets(found: Discovery) -> list[str]:
    """Return which effects occur together, where the groups do not say so."""
    sets = found.posterior.probable()
    if max(map(len, sets), default=0) < 2:
        return []
    each = [f"{listed(names) if names else 'nothing'} ({p:.0%})" for names, p in sets.items()]
    return [f"Probable combinations: {'; or '.join(each[:MOST])}."]


def _predictions(gain: Gain, shapes: Gain) -> str:
    return (
        f"Curves of left-out specimens are predicted with an error of {_errors(gain)}; "
        "the shape of these curves, with each specimen's own stiffness fitted, is predicted with "
        f"an error of {_errors(shapes)}. The mean curve of the other specimens predicts these "
        f"curves with an error of {gain.rmse_plain_N:.2f} N, and their shape with an error of "
        f"{shapes.rmse_plain_N:.2f} N."
    )


def _size(found: Discovery, name: str) -> str:
    if name not in found.amplitudes:
        return words(name)
    low, high = found.interval(name)
    unit = with_space(found.effects[name].unit)
    value = f"{found.amplitudes[name]:.3g}{unit}"
    times = abs(found.amplitudes[name] / found.effects[name].typical)
    far = ""
    if times > UNUSUAL:
        far = f", {times:.2g} times the typical amplitude, so it may stand in for another effect"
    sd, differ = found.sd_between_specimens.get(name), ""
    if sd is not None:
        differ = f" with a standard deviation of {sd:.2g}{unit} between specimens"
    return f"{words(name)}: {value} (95 % interval {low:.3g} to {high:.3g}{far}){differ}"


def _unshown(curves: Gain, shapes: Gain) -> str:
    """Return a clause for predictions of left-out curves that are not shown to be better."""
    if curves.shown:
        return ""
    only = "; only that of their shapes is" if shapes.shown else ""
    return f", but the prediction of left-out specimens is not shown to improve{only}"


def _next(found: Discovery) -> list[str]:
    """Return what to test next."""
    if not found.next_experiment:
        return []
    if found.next_experiment == "alone":
        return [
            "No second test of those tried would tell the possible effects apart; see ramiefenics "
            "plan."
        ]
    return [
        "The most informative next step is a second test of each specimen with "
        f"{found.next_experiment}; see ramiefenics plan."
    ]


def _broken(found: Discovery) -> list[str]:
    if not found.broken:
        return []
    return [
        "Specimens that appear to have broken, slipped or been mis-measured are excluded: "
        f"{listed(found.broken)}."
    ]


def _factors(found: Discovery) -> list[str]:
    """Return the fitted factors far from what was known; all of them if nothing was found."""
    moves = found.factor_moves
    far = [name for name, move in moves.items() if abs(move) > FAR]
    told = []
    if far and found.verdict != "conflict":
        told.append(
            f"Fitted factors more than {FAR:g} standard deviations from their stated values "
            f"(fit_sd = {found.dataset.layout.fit_sd:g}): {_values(found, far)}. The factors may "
            "really have these values, or they imitate an error with a similar effect."
        )
    if found.verdict == "none" and len(far) < len(moves):
        rest = [name for name in moves if name not in far]
        told.append(f"Fitted factors: {_values(found, rest)}.")
    return told


def _hidden(found: Discovery) -> list[str]:
    """Return the effects that could be present unnoticed, the largest changes of curves first."""
    limits = {
        name: limit
        for name, limit in found.limits.items()
        if name not in found.amplitudes and limit.share > VISIBLE
    }
    names = sorted(limits, key=lambda name: -limits[name].share)
    if not names:
        return []
    told = "; ".join(_limit(found, name, limits[name]) for name in names[:MOST])
    more = len(names) - MOST
    others = f"; and {more} more, see the table" if more > 0 else ""
    return [f"What these tests could not show: {told}{others}."]


def _unfitted(found: Discovery) -> list[str]:
    """Return the suspects that only derivatives speak for, which shows that these are no guide."""
    names = [name for name, reason in found.reasons.items() if reason == UNFITTED]
    if not names:
        return []
    return [
        f"By derivatives, {listed(names)} would be probable too, but no set with such an effect "
        "was fitted better: the curves change abruptly with the parameters, or the search ended "
        "too early. The verdict is to be trusted less for this."
    ]


def _untried(found: Discovery) -> list[str]:
    """Return the suspects that could not be tried, which must not be taken for ruled out."""
    names = [
        name
        for name, reason in found.reasons.items()
        if name not in found.posterior.names and reason != INDIFFERENT
    ]
    if not names:
        return []
    more = f" and {len(names) - MOST} more" if len(names) > MOST else ""
    first = ", ".join(map(words, names[:MOST]))
    return [f"Suspects that could not be tried, for the reasons in the table: {first}{more}."]


def _limit(found: Discovery, name: str, limit: Limit) -> str:
    unit = with_space(found.effects[name].unit)
    by = f", imitated by {listed(limit.imitated_by[:2])}" if limit.imitated_by else ""
    return (
        f"{words(name)} of {limit.low:.2g} to {limit.high:.2g}{unit} "
        f"({100 * limit.share:.2g} % of the peak{by})"
    )


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

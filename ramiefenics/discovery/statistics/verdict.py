"""Verdict that the evidence allows: none, cause, ambiguous, conflict or unknown."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence

from ramiefenics.discovery.statistics.causes import Causes
from ramiefenics.discovery.statistics.evidence import Evidence
from ramiefenics.discovery.statistics.fit import Fit
from ramiefenics.discovery.statistics.fit_scatter import log_evidence

UNFITTED = "probable by derivatives only, see the findings"
"""Reason for not naming a suspect, see `without_fit`."""

INDIFFERENT = "would not show in these curves, even at its largest amplitude"
"""Reason for not trying a suspect that could be tried."""

SIGNIFICANCE = 0.005
"""Probability, if no effect is present, below which a result is significant (Benjamin et al. 2018,
Nature Human Behaviour 2, 6-10): one in two hundred data sets without any effect is said to have
one."""

IMPROBABLE = 0.01
"""Posterior probability of no effect, among the sets of effects that were fitted, below which
something is missing. If standard deviations were known, at most one in a hundred data sets without
any effect would give a smaller probability (Ville 1939); here they are estimated."""

ENOUGH = 3.0
"""Log-evidence that an effect has to gain whichever specimen is left out: odds of 20."""

VERDICTS = {
    "none": "the residual cannot be told from noise, or one specimen alone speaks for an effect",
    "cause": "one or more effects explain what is missing, and no others do",
    "ambiguous": "something is missing, and these data cannot tell which of several effects it is",
    "conflict": "the fitted factors contradict their stated values, and no suspect explains this",
    "unknown": "something is missing, and no set of the suspects explains it",
}
"""Meaning of each verdict, by name."""


def decide(
    shown: bool,
    misfit: float,
    conflict: float,
    groups: Sequence[tuple[str, ...]],
    alone: bool = False,
) -> str:
    """Return the verdict.

    Parameters
    ----------
    shown
        Whether the data show that some effect is present.
    misfit
        Probability of the misfit that the best model leaves.
    conflict
        Probability of the fitted factors given what was stated of them.
    groups
        Groups of effects, at least one effect of each being present.
    alone
        Whether there was a further group for which only one specimen speaks.
    """
    if misfit < SIGNIFICANCE:
        return "unknown"
    if shown and groups:
        return "cause" if all(len(group) == 1 for group in groups) else "ambiguous"
    if shown and not alone:
        return "unknown"  # the best set is the empty one, or was not fitted
    return "conflict" if conflict < SIGNIFICANCE else "none"


def least_gain(fit: Fit, name: str, fitted: float) -> tuple[int, float]:
    """Return the specimen without which an effect gains least, and that gain.

    No single specimen is to decide, because it may have been handled differently.

    Parameters
    ----------
    fit, name
        A fitted set of effects, and one of these effects.
    fitted
        Gain of that effect in log-evidence, between the sets with and without it, each evaluated
        where it fits. The gain by the derivatives where all effects are fitted may be less, and
        only tells what a specimen contributes.
    """
    others = [other for other in fit.chosen if other != name]
    scatter = dataclasses.replace(fit.scatter, spread={})

    def gain(evidence: Evidence) -> float:
        both = (log_evidence(evidence, chosen, scatter) for chosen in (fit.chosen, others))
        return next(both) - next(both)

    blocks = fit.evidence.blocks
    gains = {
        specimen: gain(fit.evidence.blind_to(blocks.specimen == specimen))
        for specimen in fit.evidence.whole
    }
    worst = min(gains, key=lambda specimen: gains[specimen])
    more = max(fitted - gain(fit.evidence), 0.0) if math.isfinite(fitted) else 0.0
    return worst, gains[worst] + more


def without_fit(fit: Fit, causes: Causes) -> set[str]:
    """Return the effects of groups of which no member is in the fitted set.

    Derivatives promise so much of them that sets with one of them would be the most probable, but
    no such set was fitted, or those that were fit worse. Simulations that change abruptly with
    their parameters have derivatives that promise nothing.
    """
    groups = (group for group in causes.groups() if set(fit.chosen).isdisjoint(group))
    return {name for group in groups for name in group}


def resting_on_one(fit: Fit, causes: Causes) -> dict[str, tuple[int, float]]:
    """Return the effects of a fitted set for which a single specimen decides.

    Parameters
    ----------
    fit
        Fit of the most probable set.
    causes
        Posterior over sets; of each of its groups, one effect of the fitted set is examined.

    Returns
    -------
    dict
        By name of the effect, the specimen without which it gains too little, and that gain.
    """
    alone = {}
    for group in causes.groups():
        name = next((name for name in group if name in fit.chosen), None)
        if name is not None:
            others = [other for other in fit.chosen if other != name]
            fitted = causes.gain(fit.chosen) - causes.gain(others)
            specimen, gain = least_gain(fit, name, fitted)
            if gain < ENOUGH:
                alone[name] = specimen, gain
    return alone

"""What the evidence allows to say: none, cause, ambiguous, conflict or unknown."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence

from ramiefenics.discovery.evidence import Evidence
from ramiefenics.discovery.fit import Fit
from ramiefenics.discovery.fit_scatter import log_evidence

INDIFFERENT = "makes no difference to these curves"
"""Why a suspect is not tried that could be."""

SIGNIFICANCE = 0.001
"""Probability, without any effect, of what is found: one in a thousand data sets without any is
accused."""

IMPROBABLE = 0.01
"""Probability of no effect given the data, among the sets of effects that were fitted. At most one
in a hundred data sets without any would give a smaller one (Ville 1939), if standard deviations
were known; they are the most probable ones."""

ENOUGH = 3.0
"""Log-evidence that an effect has to gain whichever specimen is left out: odds of 20."""

VERDICTS = {
    "none": "what the fit leaves is not told from noise",
    "cause": "one effect, or several, explain what is missing, and no others do",
    "ambiguous": "something is missing, and these data do not tell which of some effects it is",
    "conflict": "fitted factors contradict what was stated of them, and no effect explains it",
    "unknown": "something is missing, and no set of the suspects explains it",
}
"""By name, what each means."""


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
        Whether some effect is told from none.
    misfit
        Probability of what the best model leaves.
    conflict
        Probability of the fitted factors.
    groups
        Of effects of each of which one is there.
    alone
        Whether there was a group besides that only one specimen speaks for.
    """
    if misfit < SIGNIFICANCE:
        return "unknown"
    if shown and groups:
        return "cause" if all(len(group) == 1 for group in groups) else "ambiguous"
    if shown and not alone:
        return "unknown"  # too many suspects would each explain a part
    return "conflict" if conflict < SIGNIFICANCE else "none"


def least_gain(fit: Fit, name: str, fitted: float) -> tuple[int, float]:
    """Return the specimen without which an effect gains least, and how much that is.

    No single specimen, whose handling may be its own, is to decide.

    Parameters
    ----------
    fit, name
        A set of effects that is fitted, and one of them.
    fitted
        What that gains in log-evidence over the others, each set where it fits. By the derivatives
        where all are fitted it may be less; they tell what a specimen contributes.
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

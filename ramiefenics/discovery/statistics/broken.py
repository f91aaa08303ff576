"""Detection of specimens that slipped, broke or were mis-measured."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence

from ramiefenics.discovery.statistics.evidence import Evidence
from ramiefenics.discovery.statistics.fit_scatter import fit_scatter, log_evidence

PROBABILITY = 0.02
"""Prior probability that a specimen is broken."""

FEWEST = 3
"""Minimum number of specimens that are kept."""

LARGEST_SHARE = 1 / 3
"""Largest share of the specimens that may be taken for broken."""


def find_broken(evidence: Evidence, effects: Sequence[str]) -> Evidence:
    """Return the evidence in which specimens that are probably broken do not count.

    Specimens are taken out one after the other, each time the one without which the others are most
    probable, as long as its curves are less probable as those of a specimen like the others than as
    anything a curve can be (a mixture at the level of specimens: Box and Tiao 1968).

    Parameters
    ----------
    evidence
        Evidence of all specimens.
    effects
        Names of the effects that are present.
    """
    evidence = dataclasses.replace(evidence, broken=frozenset())
    number = evidence.blocks.number
    most = min(int(LARGEST_SHARE * number), number - FEWEST)
    odds = math.log(PROBABILITY / (1.0 - PROBABILITY))
    scatter = fit_scatter(evidence, effects)
    value = log_evidence(evidence, effects, scatter)
    while len(evidence.broken) < most:
        tried = [evidence.but_without(s) for s in evidence.whole]
        without = max(tried, key=lambda other: log_evidence(other, effects, scatter))
        refined = fit_scatter(without, effects, scatter)
        found = log_evidence(without, effects, refined)
        if found + odds <= value:
            break
        evidence, scatter, value = without, refined, found
    return evidence

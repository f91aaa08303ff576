"""Repair a printed central composite design so that it reproduces the published results."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ramiefenics.reconciliation.arrangement import Arrangements
from ramiefenics.reconciliation.least_squares import Fit, fit
from ramiefenics.reconciliation.outcome import (
    DRAWS,
    MOST_REPAIRS,
    Reconciliation,
    changed_rows,
)
from ramiefenics.reconciliation.printed_design import PrintedDesign, Publication
from ramiefenics.specification import SpecificationError

EXTRA_ROWS = 4
"""Rows that may change beyond those required for a central composite design: two exchanges."""

MOST_TRIED = 100
"""Number of arrangements that are tried before the search gives up.

All of them reproduce the published coefficients and sums of squares of single terms, but not
necessarily the other sums of squares, which are not linear and so not part of the linear program.
"""


def reconcile(design: PrintedDesign, publication: Publication, seed: int = 0) -> Reconciliation:
    """Find the central composite design that was run, given a misprinted one.

    Parameters
    ----------
    design
        Design as printed, with the responses, which are assumed to be correct.
    publication
        Coefficients and sums of squares to be reproduced, each to half a unit of its last digit.
    seed
        Seed of the random arrangements for `Reconciliation.p_value`.

    Raises
    ------
    SpecificationError
        If the printed design already reproduces the publication, or if no central composite design
        with few enough changes does.
    """
    before = fit(design.points, design.responses, publication.terms)
    if publication.compare(before, design.factors)["agrees"].all():
        raise SpecificationError(
            "the printed design",
            None,
            "is consistent: it reproduces every published number, so there is nothing to repair",
        )
    _check_total(publication, before)
    arrangements = Arrangements(design, publication)
    most = arrangements.demanded + EXTRA_ROWS
    repairs = _repairs(arrangements, most)
    if not repairs:
        raise SpecificationError(
            "the printed design",
            None,
            f"is beyond repair: no central composite design with alpha = {design.alpha:g} that "
            f"changes at most {most} of its {len(design.points)} rows reproduces the publication",
        )
    after = fit(repairs[0], design.responses, publication.terms)
    changed = len(changed_rows(repairs[0], design))
    p_value = _p_value(design, publication, repairs[0], changed, seed)
    return Reconciliation(
        design, publication, repairs, arrangements.demanded, before, after, p_value
    )


def _check_total(publication: Publication, found: Fit) -> None:
    """Check the total sum of squares, which does not depend on the arrangement."""
    printed, total = publication.sums_of_squares.get("total"), found.sums_of_squares["total"]
    if printed is not None and not printed.agrees(total):
        raise SpecificationError(
            "the printed design",
            None,
            f"is beyond repair: its responses have a total sum of squares of {total:.6g}, "
            f"however they are arranged, but {printed} is published",
        )


def _repairs(arrangements: Arrangements, most_rows: int) -> tuple[NDArray[np.float64], ...]:
    """Return the repairs with the fewest changed rows, at most `MOST_REPAIRS` of them."""
    first = next(_reproducing(arrangements, most_rows), None)
    if first is None:
        return ()
    fewest = len(changed_rows(first, arrangements.design))
    return tuple(itertools.islice(_reproducing(arrangements, fewest), MOST_REPAIRS))


def _reproducing(arrangements: Arrangements, most_rows: int) -> Iterator[NDArray[np.float64]]:
    """Yield designs that reproduce the whole publication, those with the least change first.

    Raises
    ------
    SpecificationError
        If more than `MOST_TRIED` arrangements satisfy the inequalities of the linear program.
    """
    design, publication = arrangements.design, arrangements.publication
    for tried, arranged in enumerate(arrangements.search(most_rows)):
        if tried == MOST_TRIED:
            raise SpecificationError(
                "the publication",
                None,
                f"says too little: more than {MOST_TRIED} arrangements of the rows meet its "
                "coefficients and the sums of squares of its terms",
            )
        points = arrangements.points[arranged]
        refit = fit(points, design.responses, publication.terms)
        if publication.compare(refit, design.factors)["agrees"].all():
            yield points


def _p_value(
    design: PrintedDesign,
    publication: Publication,
    repaired: NDArray[np.float64],
    most_rows: int,
    seed: int,
) -> float:
    """Return how often as few changes would reproduce the results of a random arrangement."""
    draw = np.random.default_rng(seed)
    met = 0
    for _ in range(DRAWS):
        shuffled = fit(repaired, draw.permutation(design.responses), publication.terms)
        other = replace(
            publication,
            coefficients={
                term: printed.round(shuffled.coefficients[term])
                for term, printed in publication.coefficients.items()
            },
            sums_of_squares={
                key: printed.round(shuffled.sums_of_squares[key])
                for key, printed in publication.sums_of_squares.items()
            },
        )
        try:
            met += next(_reproducing(Arrangements(design, other), most_rows), None) is not None
        except SpecificationError:  # more arrangements than are tried: counts as reproduced
            met += 1
    return met / DRAWS

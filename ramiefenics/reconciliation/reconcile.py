"""Repair a printed central composite design so that it gives what was published about it."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ramiefenics.reconciliation.arrangement import SAME, Arrangements
from ramiefenics.reconciliation.least_squares import Fit, fit
from ramiefenics.reconciliation.printed_design import PrintedDesign, Publication
from ramiefenics.specification import SpecificationError

EXTRA_ROWS = 4
"""Rows that may change beyond those that a central composite design demands: two exchanges."""

MOST_REPAIRS = 20
MOST_TRIED = 100
"""Arrangements that meet all but the sums of squares that are not linear, before giving up."""

DRAWS = 100
"""Arbitrary arrangements behind `Reconciliation.chance`."""


@dataclass(frozen=True, eq=False)
class Reconciliation:
    """A printed design and its repairs.

    Parameters
    ----------
    printed
        As printed.
    publication
        What was published about it.
    repairs
        Coded levels, shape (rows, factors) each: all designs with as few changed rows that
        reproduce the publication, the one with the fewest changed cells first; at most
        `MOST_REPAIRS`. Rows with equal responses may exchange places in each; that is no other
        repair.
    demanded
        How many rows must change for a central composite design, whatever was published.
    before, after
        Fits of the printed design and of the first repair.
    chance
        Share of arbitrary arrangements of the same responses whose coefficients and sums of
        squares, rounded like the published ones, as few changed rows would have reproduced
        too. A repair that is no accident has a small one.
    """

    printed: PrintedDesign
    publication: Publication
    repairs: tuple[NDArray[np.float64], ...]
    demanded: int
    before: Fit
    after: Fit
    chance: float

    @property
    def unique(self) -> bool:
        """Whether no other repair changes as few rows."""
        return len(self.repairs) == 1

    @property
    def rows(self) -> list[int]:
        """Numbers of the repaired rows, from 1."""
        return [int(i) + 1 for i in _changed(self.repairs[0], self.printed)]

    @property
    def changes(self) -> pd.DataFrame:
        """The repaired rows: number, levels printed and repaired, response."""
        index = np.array(self.rows) - 1
        factors, printed = self.printed.factors, self.printed
        columns: dict[str, object] = {"row": self.rows}
        columns |= {f"{f}_printed": printed.points[index, i] for i, f in enumerate(factors)}
        columns |= {f: self.repairs[0][index, i] for i, f in enumerate(factors)}
        columns[printed.response] = printed.responses[index]
        return pd.DataFrame(columns)

    @property
    def design(self) -> pd.DataFrame:
        """The repaired design with its responses, in the printed order."""
        frame = pd.DataFrame(self.repairs[0], columns=list(self.printed.factors))
        frame.insert(0, "row", range(1, len(frame) + 1))
        frame[self.printed.response] = self.printed.responses
        frame["repaired"] = frame["row"].isin(self.rows)
        return frame


def reconcile(design: PrintedDesign, publication: Publication, seed: int = 0) -> Reconciliation:
    """Find the central composite design that was run, from a misprinted one.

    Parameters
    ----------
    design
        As printed, with the responses, which are taken as they are.
    publication
        Coefficients and sums of squares to reproduce, each to half a unit of its last digit.
    seed
        Of the arbitrary arrangements behind `Reconciliation.chance`.

    Raises
    ------
    SpecificationError
        If the printed design reproduces its publication already, or if no central composite
        design with few enough changes does.
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
    changed = len(_changed(repairs[0], design))
    chance = _chance(design, publication, repairs[0], changed, seed)
    return Reconciliation(
        design, publication, repairs, arrangements.demanded, before, after, chance
    )


def _check_total(publication: Publication, found: Fit) -> None:
    """Check the total sum of squares, which no arrangement can change."""
    printed, total = publication.sums_of_squares.get("total"), found.sums_of_squares["total"]
    if printed is not None and not printed.agrees(total):
        raise SpecificationError(
            "the printed design",
            None,
            f"is beyond repair: its responses have a total sum of squares of {total:.6g}, "
            f"however they are arranged, but {printed} is published",
        )


def _repairs(arrangements: Arrangements, most_rows: int) -> tuple[NDArray[np.float64], ...]:
    """Return all repairs with the fewest changed rows, at most `MOST_REPAIRS`."""
    first = next(_reproducing(arrangements, most_rows), None)
    if first is None:
        return ()
    fewest = len(_changed(first, arrangements.design))
    return tuple(itertools.islice(_reproducing(arrangements, fewest), MOST_REPAIRS))


def _changed(points: NDArray[np.float64], design: PrintedDesign) -> NDArray[np.intp]:
    """Return which rows differ from the printed ones."""
    return np.flatnonzero(np.any(np.abs(points - design.points) > SAME, axis=1))


def _reproducing(arrangements: Arrangements, most_rows: int) -> Iterator[NDArray[np.float64]]:
    """Yield designs that reproduce all of the publication, the least change first.

    Raises
    ------
    SpecificationError
        If too many obey its inequalities, but not the sums of squares that have none.
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


def _chance(
    design: PrintedDesign,
    publication: Publication,
    repaired: NDArray[np.float64],
    most_rows: int,
    seed: int,
) -> float:
    """Return how often an arbitrary publication of these responses could be met as cheaply."""
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
        except SpecificationError:  # too little said: by chance as well as not
            met += 1
    return met / DRAWS

"""Result of a repair: the repaired rows, how certain they are, and the effect on the fit."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ramiefenics.calibration.terms import term_name
from ramiefenics.reconciliation.arrangement import SAME
from ramiefenics.reconciliation.least_squares import Fit
from ramiefenics.reconciliation.printed_design import PrintedDesign, Publication
from ramiefenics.results.result import Result, Table
from ramiefenics.results.text import markdown, stack

MOST_REPAIRS = 20
"""Largest number of repairs that are listed; there may be more."""

DRAWS = 100
"""Number of random arrangements for `Reconciliation.p_value`."""


@dataclass(frozen=True, eq=False, repr=False)
class Reconciliation(Result):
    """A printed design and its repairs.

    Parameters
    ----------
    printed
        Design as printed.
    publication
        Published results of that design.
    repairs
        Coded levels, shape (rows, factors), of the designs that reproduce the publication with the
        fewest changed rows, those with the fewest changed cells first; at most `MOST_REPAIRS`.
        Repairs that differ only by an exchange of rows with equal responses count as one.
    demanded
        Number of rows that must change to give a central composite design, whatever was published.
    before, after
        Fits of the printed design and of the first repair.
    p_value
        Share of random arrangements of the same responses whose coefficients and sums of squares,
        rounded like the published ones, could also be reproduced with as few changed rows. It is
        small for a repair that is not accidental.
    """

    title: ClassVar[str] = "Repair of a printed design"

    printed: PrintedDesign
    publication: Publication
    repairs: tuple[NDArray[np.float64], ...]
    demanded: int
    before: Fit
    after: Fit
    p_value: float

    @property
    def unique(self) -> bool:
        """Whether this is the only repair that changes as few rows."""
        return len(self.repairs) == 1

    @property
    def rows(self) -> list[int]:
        """Numbers of the repaired rows, counted from 1."""
        return [int(i) + 1 for i in changed_rows(self.repairs[0], self.printed)]

    @property
    def changes(self) -> pd.DataFrame:
        """The repaired rows with their number, printed and repaired levels, and response."""
        index = np.array(self.rows) - 1
        factors, printed = self.printed.factors, self.printed
        columns: dict[str, object] = {"row": self.rows}
        columns |= {f"{f}_printed": printed.points[index, i] for i, f in enumerate(factors)}
        columns |= {f: self.repairs[0][index, i] for i, f in enumerate(factors)}
        columns[printed.response] = printed.responses[index]
        return pd.DataFrame(columns)

    @property
    def design(self) -> pd.DataFrame:
        """The repaired design with its responses, in the printed order of the rows."""
        frame = pd.DataFrame(self.repairs[0], columns=list(self.printed.factors))
        frame.insert(0, "row", range(1, len(frame) + 1))
        frame[self.printed.response] = self.printed.responses
        frame["repaired"] = frame["row"].isin(self.rows)
        return frame

    def findings(self) -> list[str]:
        """Return which rows are repaired, how certain that is, and the effect on the fit."""
        known = len(self.repairs)
        more = "at least " if known == MOST_REPAIRS else ""
        return [
            f"{len(self.rows)} of {len(self.printed.points)} rows are repaired: "
            f"{', '.join(map(str, self.rows))}; {self.demanded} must change to give a central "
            "composite design, whatever was published.",
            "No other repair that changes as few rows reproduces the publication."
            if self.unique
            else f"It is not unique: it is one of {more}{known} repairs that change as few rows "
            "and reproduce the whole publication.",
            "Rows with equal responses may be interchanged.",
            "Had the publication come from an arbitrary arrangement of the same responses, a "
            "repair of as few rows would have reproduced it in "
            f"{round(self.p_value * DRAWS)} of {DRAWS} cases.",
            f"The model's matrix has rank {self.before.rank} of {len(self.before.terms)} as "
            f"printed and {self.after.rank} as repaired; R2 is {self.before.r_squared:.4f} as "
            f"printed and {self.after.r_squared:.4f} as repaired.",
        ]

    def overview(self) -> pd.DataFrame:
        """Return the repaired rows."""
        return self.changes

    def numbers(self) -> dict[str, Any]:
        """Return the repair and its fit."""
        factors = self.printed.factors
        published = self.publication.compare(self.after, factors)[["number", "published"]]
        return {
            "repaired_rows": self.rows,
            "demanded_rows": self.demanded,
            "repairs": len(self.repairs),
            "unique": self.unique,
            "p_value": self.p_value,
            "r_squared_printed": self.before.r_squared,
            "r_squared_repaired": self.after.r_squared,
            "coefficients": {
                term_name(term, factors): value for term, value in self.after.coefficients.items()
            },
            "published": dict(published.to_numpy()),
            "alpha": self.printed.alpha,
        }

    def tables(self) -> dict[str, Table]:
        """Return tables of the repaired design, its changes, and its fit."""
        tables = {
            "design": Table(self.design, "The repaired design."),
            "changes": Table(self.changes),
        }
        if not self.unique:
            columns = list(self.printed.factors)
            others = {
                number: pd.DataFrame(points, columns=columns).assign(row=range(1, len(points) + 1))
                for number, points in enumerate(self.repairs[1:], start=2)
            }
            stacked = stack(others, "repair")[[*columns, "repair", "row"]]
            tables["other_repairs"] = Table(stacked, "Other repairs that change as few rows.")
        return tables | self.fits()

    def fits(self) -> dict[str, Table]:
        """Return tables of published numbers, coefficients and analyses of variance.

        Each is given for the printed and the repaired design.
        """
        factors, empty = self.printed.factors, "empty where the design cannot tell terms apart"
        return {
            "published": Table(
                self._comparison(),
                "Published numbers, and those of the design as printed and as repaired.",
            ),
            "coefficients": Table(self._coefficients(), f"Coefficients; {empty}."),
            "anova_printed": Table(
                self.before.anova(factors),
                "Analysis of variance of the printed design; sums of squares of terms are of type "
                "III.",
            ),
            "anova_repaired": Table(
                self.after.anova(factors), "Analysis of variance of the repaired design."
            ),
        }

    def _comparison(self) -> pd.DataFrame:
        before, after = (
            self.publication.compare(fitted, self.printed.factors)
            for fitted in (self.before, self.after)
        )
        return pd.DataFrame(
            {
                "number": before["number"],
                "published": before["published"],
                "as printed": before["computed"].round(9) + 0.0,
                "repaired": after["computed"],
                "agrees": ["yes" if agrees else "no" for agrees in after["agrees"]],
            }
        )

    def _coefficients(self) -> pd.DataFrame:
        def values(fitted: Fit) -> list[float]:
            return [fitted.coefficients[term] for term in fitted.terms]

        return pd.DataFrame(
            {
                "term": [term_name(term, self.printed.factors) for term in self.after.terms],
                "as printed": values(self.before),
                "repaired": values(self.after),
            }
        )

    def write_more(self, folder: Path) -> None:
        """Write ``report.md``: findings and tables in Markdown."""
        head = f"# {self.title}\n\n{' '.join(self.findings())}\n\n"
        (folder / "report.md").write_text(head + self.markdown(), encoding="utf-8")

    def markdown(self) -> str:
        """Return the repaired rows, and the fits before and after the repair, in Markdown."""
        tables = {"changes": Table(self.changes, "Repaired rows."), **self.fits()}
        return "\n".join(
            f"{table.caption.removesuffix('.')}:\n\n{markdown(table.data)}"
            for table in tables.values()
        )


def changed_rows(points: NDArray[np.float64], design: PrintedDesign) -> NDArray[np.intp]:
    """Return the indices of the rows that differ from the printed ones."""
    return np.flatnonzero(np.any(np.abs(points - design.points) > SAME, axis=1))

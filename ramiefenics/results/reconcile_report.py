"""What is written of a repaired design: tables, a report, a summary."""

from __future__ import annotations

import json
from pathlib import Path

import pandas as pd

from ramiefenics.calibration.terms import term_name
from ramiefenics.reconciliation.least_squares import Fit
from ramiefenics.reconciliation.reconcile import DRAWS, MOST_REPAIRS, Reconciliation
from ramiefenics.results.draft import draft
from ramiefenics.results.manifest import versions
from ramiefenics.results.verification_report import markdown


def write_reconciliation(found: Reconciliation, folder: str | Path) -> None:
    """Write `design.csv`, `changes.csv`, `other_repairs.csv` if any, `report.md`, `summary.json`.

    Parameters
    ----------
    found
        A repaired design.
    folder
        Made if it does not exist; an earlier result in it is replaced, all at once.
    """
    with draft(Path(folder)) as place:
        found.design.to_csv(place / "design.csv", index=False)
        found.changes.to_csv(place / "changes.csv", index=False)
        others = [
            pd.DataFrame(points, columns=list(found.printed.factors)).assign(
                repair=number, row=range(1, len(points) + 1)
            )
            for number, points in enumerate(found.repairs[1:], start=2)
        ]
        if others:
            pd.concat(others).to_csv(place / "other_repairs.csv", index=False)
        head = f"# Repair of a printed design\n\n{in_words(found)}\n\n"
        (place / "report.md").write_text(head + report(found), encoding="utf-8")
        (place / "summary.json").write_text(json.dumps(_summary(found), indent=1) + "\n")


def in_words(found: Reconciliation) -> str:
    """Return the result in a few sentences."""
    rows, total = found.rows, len(found.printed.points)
    listed = ", ".join(map(str, rows))
    known = len(found.repairs)
    more = "at least " if known == MOST_REPAIRS else ""
    unique = (
        "No other repair of as few rows reproduces the publication."
        if found.unique
        else f"It is not unique: one of {more}{known} of as few rows that reproduce it all."
    )
    return (
        f"{len(rows)} of {total} rows are repaired: {listed}; {found.demanded} must change for a "
        f"central composite design, whatever was published. {unique} Rows with equal responses "
        f"may exchange places. Had the publication come from an arbitrary arrangement of the same "
        f"responses, as few rows would have reproduced it in {round(found.chance * DRAWS)} of "
        f"{DRAWS} cases. "
        f"The model's matrix has rank {found.before.rank} of {len(found.before.terms)} as "
        f"printed, {found.after.rank} repaired; R2 is {found.before.r_squared:.4f} as printed, "
        f"{found.after.r_squared:.4f} repaired."
    )


def report(found: Reconciliation) -> str:
    """Return the repaired rows, and the fit before and after, as tables in Markdown."""
    return "\n".join(
        [
            "Repaired rows:\n",
            markdown(found.changes),
            "Published numbers, and what the design gives as printed and repaired:\n",
            markdown(_comparison(found)),
            "Coefficients; empty where the design cannot tell terms apart:\n",
            markdown(_coefficients(found)),
            "Analysis of variance as printed; terms by what leaving them out costs:\n",
            markdown(found.before.anova(found.printed.factors)),
            "Analysis of variance repaired:\n",
            markdown(found.after.anova(found.printed.factors)),
        ]
    )


def _comparison(found: Reconciliation) -> pd.DataFrame:
    factors = found.printed.factors
    before, after = (
        found.publication.compare(fitted, factors) for fitted in (found.before, found.after)
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


def _coefficients(found: Reconciliation) -> pd.DataFrame:
    def values(fitted: Fit) -> list[float]:
        return [fitted.coefficients[term] for term in fitted.terms]

    return pd.DataFrame(
        {
            "term": [term_name(term, found.printed.factors) for term in found.after.terms],
            "as printed": values(found.before),
            "repaired": values(found.after),
        }
    )


def _summary(found: Reconciliation) -> dict[str, object]:
    factors = found.printed.factors
    return {
        "repaired_rows": found.rows,
        "demanded_rows": found.demanded,
        "repairs": len(found.repairs),
        "unique": found.unique,
        "chance": found.chance,
        "r_squared_printed": found.before.r_squared,
        "r_squared_repaired": found.after.r_squared,
        "coefficients": {
            term_name(term, factors): value for term, value in found.after.coefficients.items()
        },
        "published": dict(
            found.publication.compare(found.after, factors)[["number", "published"]].to_numpy()
        ),
        "alpha": found.printed.alpha,
        "versions": versions(),
    }

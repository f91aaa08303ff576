"""Check of the published tables' arithmetic; writes `docs/published_tables.md`.

    ./run python benchmarks/published_tables.py

Takes a few seconds.
"""

from __future__ import annotations

from pathlib import Path

import pandas as pd

from ramiefenics import check_anova, published_checks, reconcile
from ramiefenics.published.tables import printed_table
from ramiefenics.reconciliation.printed_design import table5
from ramiefenics.results.text import markdown

PAGE = Path(__file__).resolve().parents[1] / "docs" / "published_tables.md"

HEAD = """# The published tables, checked

Tables 1 to 8 of the study are in `ramiefenics/published/data/` as printed, with a README that
explains where they contradict themselves. `ramiefenics.published_table(5)` returns a table as a
data frame, with units in the column names. This page checks the arithmetic of the tables. It is
written by `./run python benchmarks/published_tables.py`.

A printed number stands for every value that rounds to it. Each check recomputes the number from
other printed numbers, over all values that round to them. The check holds if the two ranges
overlap.

## Source

"The study" is everywhere the paper
"Bending mechanics test and parameters calibration of ramie stalks".
It reports bending tests of the cultivar Zhong Zhu-I from the Xianning Ramie Experiment Station,
made after a standard of 2021 (GB/T 1456-2021), and simulations in LS-DYNA. The copy that was used
here contains neither the names of the authors nor journal, year or DOI; it is therefore cited by
its title.

"""

TABLE_6 = """## Table 6, the analysis of variance

The mean squares, F and p follow from the sums of squares and the degrees of freedom. Terms are
compared with the residual, the lack of fit with the pure error. "p of the printed F" is the p that
follows from the printed F alone. For X2X3 it agrees with the printed p, so the error is in F.
`ramiefenics.check_anova` does this for any such table.

"""

TABLE_5 = """## Table 5, the central composite design

As printed, X2 repeats X3 in every row except row 2, and neither Eq. 5 nor Table 6 can be
reproduced. `ramiefenics reconcile` finds the design that was run. Assigning the rows to the points
of a central composite design is an assignment problem. The published coefficients and sums of
squares, each to half a unit of its last digit, are linear inequalities on the assignment (a sum of
squares for either sign of its coefficient). Finding the smallest change that satisfies them is a
mixed-integer linear program, which HiGHS solves to proven optimality in hundredths of a second. It
minimises the number of changed rows first, and then the number of changed cells. Each solution is
then fitted and compared with all published numbers, including the pure error and the lack of fit.

"""

OWN = """## A table of your own

    ramiefenics reconcile design.csv --out results/repaired

`design.csv` has a header and one row per run, in coded levels:

    run,A,B,yield
    1,-1,-1,54.2
    2,1,-1,61.0

and `design.toml` beside it (or `--published FILE.toml`) says what was published. Write numbers as
they are printed: 0.40 is known to 0.005, 0.4 to 0.05.

    factors = ["A", "B"]
    response = "yield"
    # alpha = 1.414            distance of the axial points; the largest coded level if left out
    # model = "quadratic"      linear, interaction, quadratic, or a list of terms

    [coefficients]             # either table may be left out
    constant = 62.31
    A = 3.05
    AB = -0.40                 # or "A B", "A*B"; squares are "A^2"

    [sums_of_squares]          # of single terms (type III), and of these:
    A = 74.42
    model = 80.11
    residual = 4.02
    lack_of_fit = 3.01
    pure_error = 1.01
    total = 84.13

It writes `design.csv` (repaired), `changes.csv`, `report.md` and `report.html` with the fits
before and after, `summary.json`, and `other_repairs.csv` if the repair is not unique.

What it assumes: the design to be reached has all 2^k factorial points once, 2k axial points at
the distance alpha, and the centre in all other rows; factorial rows stay factorial and have wrong
signs, other rows of zeros and alpha have a wrong axis or sign or lost it, rows with any other
level may be anything; responses are right, and those that were analysed. It refuses a table that
reproduces its publication already, and one that does not with as many changed rows as such a
design demands and {extra} more. Sums of squares alone leave signs open: then mirror images may be
as good, and the repair is reported as not unique. The share of arbitrary arrangements of the same
responses that would have been met as cheaply tells how much the publication says: where it is not
near 0, the repair may be an accident.
"""


def checks() -> pd.DataFrame:
    """Return the arithmetic checks as a table of text."""
    return pd.DataFrame(
        [
            {
                "where": check.where,
                "number": check.what,
                "printed": str(check.printed),
                "recomputed": check.recomputed,
                "range": _range(check.low, check.high),
                "from": check.formula,
                "holds": "yes" if check.holds else "**no**",
            }
            for check in published_checks()
        ]
    )


def table_6() -> pd.DataFrame:
    """Return the check of Table 6 as a table of text."""
    found = check_anova(printed_table(6))
    ranges = [_range(low, high) for low, high in zip(found["low"], found["high"], strict=True)]
    holds = ["yes" if holds else "**no**" for holds in found["holds"]]
    return found.drop(columns=["low", "high"]).assign(range=ranges, holds=holds)


def _range(low: float, high: float) -> str:
    return f"{low:.4g} to {high:.4g}"


def main() -> None:
    """Write the page."""
    from ramiefenics.reconciliation.reconcile import EXTRA_ROWS

    repaired = reconcile(*table5())
    parts = [
        f"{HEAD}## Equations, Tables 1 to 4, 7, 8, and the text\n\n{markdown(checks())}",
        TABLE_6 + markdown(table_6()),
        f"{TABLE_5}`./run ramiefenics reconcile table5`: {' '.join(repaired.findings())}\n",
        repaired.markdown(),
        OWN.replace("{extra}", str(EXTRA_ROWS)),
    ]
    PAGE.write_text("\n".join(parts), encoding="utf-8")


if __name__ == "__main__":
    main()

"""A printed experiment: its design, its responses, and the published results."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ramiefenics.calibration.terms import Term, model_terms, parse_term, term_name
from ramiefenics.measured.tables import numbers, read_table
from ramiefenics.published.rounding import Printed
from ramiefenics.published.tables import printed_table, printed_values, published_table
from ramiefenics.reconciliation.least_squares import Fit
from ramiefenics.specification import SpecificationError
from ramiefenics.specification.reading import read_toml

SUMS = ("model", "residual", "lack of fit", "pure error", "total")
"""Sums of squares of an analysis of variance that belong to no single term."""

KEYS = ("factors", "response", "alpha", "model", "coefficients", "sums_of_squares")


@dataclass(frozen=True, eq=False)
class PrintedDesign:
    """A design in coded levels, with its responses.

    Parameters
    ----------
    factors, response
        Names of the columns.
    points
        Coded levels, shape (rows, factors).
    responses
        Responses in any unit, shape (rows,).
    alpha
        Distance of the axial points from the centre.

    Raises
    ------
    SpecificationError
        If there are fewer than two factors, alpha is below 1, or the rows are too few for a
        central composite design.
    """

    factors: tuple[str, ...]
    response: str
    points: NDArray[np.float64]
    responses: NDArray[np.float64]
    alpha: float

    def __post_init__(self) -> None:
        count = len(self.factors)
        if count < 2:
            raise SpecificationError("factors", list(self.factors), "must be at least two")
        if not self.alpha >= 1.0:
            raise SpecificationError("alpha", self.alpha, "must be at least 1")
        needed = 2**count + 2 * count
        if len(self.points) < needed:
            raise SpecificationError(
                "rows",
                len(self.points),
                f"must be at least {needed}: 2^k factorial and 2k axial points",
            )


@dataclass(frozen=True)
class Publication:
    """Published results of an experiment.

    Parameters
    ----------
    terms
        Terms of the fitted model, including the intercept.
    coefficients
        Coefficients in coded units, by term.
    sums_of_squares
        Sums of squares of the analysis of variance, by term (type III) or by a name in `SUMS`.
    """

    terms: tuple[Term, ...]
    coefficients: Mapping[Term, Printed]
    sums_of_squares: Mapping[Term | str, Printed]

    def __post_init__(self) -> None:
        if not self.coefficients and not self.sums_of_squares:
            raise SpecificationError(
                "publication", None, "must give coefficients or sums_of_squares to compare with"
            )
        if (0,) * len(self.terms[0]) in self.sums_of_squares:
            raise SpecificationError(
                "sums_of_squares", None, "must be corrected for the mean, without the constant"
            )
        for term in (*self.coefficients, *self.sums_of_squares):
            if not isinstance(term, str) and term not in self.terms:
                raise SpecificationError(
                    "model", None, f"lacks a published term, with exponents {term} of the factors"
                )

    def compare(self, found: Fit, factors: tuple[str, ...]) -> pd.DataFrame:
        """Compare the published numbers with those of a fit.

        Returns
        -------
        pandas.DataFrame
            ``number``, ``published``, ``computed``, ``agrees``.
        """
        pairs = [
            (f"coefficient, {term_name(term, factors)}", printed, found.coefficients[term])
            for term, printed in self.coefficients.items()
        ]
        pairs += [
            (
                f"sum of squares, {key if isinstance(key, str) else term_name(key, factors)}",
                printed,
                found.sums_of_squares[key],
            )
            for key, printed in self.sums_of_squares.items()
        ]
        return pd.DataFrame(
            [
                {
                    "number": name,
                    "published": str(printed),
                    "computed": value,
                    "agrees": printed.agrees(value),
                }
                for name, printed, value in pairs
            ]
        )


def table5() -> tuple[PrintedDesign, Publication]:
    """Return the study's Table 5 with its Eq. 5 and the sums of squares of its Table 6."""
    table, anova, text = published_table(5), printed_table(6), printed_values()
    factors = ("X1", "X2", "X3")
    points = table[list(factors)].to_numpy(float)
    design = PrintedDesign(
        factors, "force_N", points, table["force_N"].to_numpy(float), float(np.abs(points).max())
    )
    coefficients = {
        name.removeprefix("eq5_").removesuffix("_N"): str(number)
        for name, number in text.items()
        if name.startswith("eq5_")
    }
    sums = dict(zip(anova["source"], anova["sum_of_squares_N2"], strict=True))
    sums["total"] = sums.pop("Core total")
    # the model of Table 6 has six degrees of freedom: three factors and their three products
    return design, _publication("interaction", coefficients, sums, factors)


def read_printed_design(
    table: str | Path, settings: str | Path | None = None
) -> tuple[PrintedDesign, Publication]:
    """Read a printed design and its publication.

    Parameters
    ----------
    table
        CSV file with a header and one row per run, with coded factors and a response.
    settings
        TOML file with ``factors`` and ``response`` (names of columns), ``alpha`` (by default the
        largest coded level), ``model`` (linear, interaction, quadratic, or a list of terms; by
        default the first of these three that has the published terms) and the tables
        ``coefficients`` and ``sums_of_squares``. Numbers are to be given as printed, because their
        last digit counts. The default is the file of the same name in the folder of the table.

    Raises
    ------
    SpecificationError
        If a file or a value cannot be used.
    """
    path = Path(table)
    frame = read_table(path)
    data = read_toml(settings or path.with_suffix(".toml"), parse_float=str)
    for key in data:
        if key not in KEYS:
            raise SpecificationError(key, data[key], f"is an unknown key; known: {', '.join(KEYS)}")
    factors, response = data.get("factors"), data.get("response")
    if not isinstance(factors, list) or len(set(map(str, factors))) < max(2, len(factors)):
        raise SpecificationError(
            "factors", factors, "must be a list of two or more different columns"
        )
    if not isinstance(response, str) or response in factors:
        raise SpecificationError(
            "response", response, "must be the name of a column that is not a factor"
        )
    for name in (*factors, response):
        if name not in frame.columns:
            there = ", ".join(frame.columns)
            raise SpecificationError(path.name, name, f"is not among its columns ({there})")
    points = np.column_stack([numbers(path, frame, name) for name in factors])
    alpha = max(1.0, float(np.abs(points).max()))
    if "alpha" in data:
        alpha = _printed("alpha", data["alpha"]).value
    responses = numbers(path, frame, response)
    design = PrintedDesign(tuple(factors), response, points, responses, alpha)
    coefficients, sums = data.get("coefficients", {}), data.get("sums_of_squares", {})
    for key, part in (("coefficients", coefficients), ("sums_of_squares", sums)):
        if not isinstance(part, dict):
            raise SpecificationError(key, part, "must be a table of numbers by term")
    return design, _publication(data.get("model"), coefficients, sums, design.factors)


def _publication(
    model: str | list[str] | None,
    coefficients: Mapping[str, Any],
    sums: Mapping[str, Any],
    factors: tuple[str, ...],
) -> Publication:
    """Return the publication that cells of text, by names of terms and sums, describe."""
    by_term: dict[Term, Printed] = {}
    for name, cell in coefficients.items():
        by_term[_term("coefficients", name, factors)] = _printed(f"coefficients.{name}", cell)
    by_source: dict[Term | str, Printed] = {}
    for name, cell in sums.items():
        common = name.replace("_", " ").lower()
        source = common if common in SUMS else _term("sums_of_squares", name, factors)
        by_source[source] = _printed(f"sums_of_squares.{name}", cell)
    terms = {term for term in (*by_term, *by_source) if not isinstance(term, str)}
    if model is None:
        squared = any(max(term) > 1 for term in terms)
        crossed = any(sum(term) > 1 for term in terms)
        model = "quadratic" if squared else "interaction" if crossed else "linear"
    if isinstance(model, list):
        named = [_term("model", str(name), factors) for name in model]
        chosen = (*model_terms(len(factors), "linear")[:1], *named)
        return Publication(tuple(dict.fromkeys(chosen)), by_term, by_source)
    return Publication(model_terms(len(factors), model), by_term, by_source)


def _term(field: str, name: str, factors: tuple[str, ...]) -> Term:
    term = parse_term(name, factors)
    if term is None:
        example = f"{factors[0]} {factors[1]}"
        raise SpecificationError(
            field, name, f"must be constant, a factor, a product such as {example!r}, or a square"
        )
    return term


def _printed(field: str, cell: Any) -> Printed:
    try:
        if isinstance(cell, (bool, list, dict)):
            raise ValueError(cell)
        return Printed.read(str(cell))
    except ValueError as error:
        raise SpecificationError(field, cell, "must be a number") from error

"""Terms of polynomial models: their names, values and derivatives."""

from __future__ import annotations

import itertools
import re
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ramiefenics.calibration.factors import Array
from ramiefenics.specification import SpecificationError

Term = tuple[int, ...]
"""Exponents of the factors; all zero for the constant."""

MODELS = ("linear", "interaction", "quadratic")
"""Models with main effects only; with products of two factors as well; and also with squares."""


def model_terms(number: int, model: str) -> tuple[Term, ...]:
    """Return the terms of a model, the constant first.

    Parameters
    ----------
    number
        Number of factors.
    model
        Name of the model, one of `MODELS`.

    Raises
    ------
    SpecificationError
        If there is no model of that name.
    """
    if model not in MODELS:
        raise SpecificationError("model", model, f"must be one of {', '.join(MODELS)}")
    single = np.eye(number, dtype=int)
    terms = [np.zeros(number, dtype=int), *single]
    if model != "linear":
        terms += [single[i] + single[j] for i, j in itertools.combinations(range(number), 2)]
    if model == "quadratic":
        terms += [2 * row for row in single]
    return tuple(tuple(int(power) for power in term) for term in terms)


def term_name(term: Term, names: Sequence[str]) -> str:
    """Return a term as text, such as ``X1 X3``, ``X2^2`` or ``constant``."""
    powers = [(n, power) for n, power in zip(names, term, strict=True) if power]
    return " ".join(n if power == 1 else f"{n}^{power}" for n, power in powers) or "constant"


def parse_term(text: str, names: Sequence[str]) -> Term | None:
    """Return the term that a text such as ``X1X2``, ``X2*X1`` or ``X1^2`` names, or None."""
    short = re.sub(r"[\s*:]", "", text.replace("**", "^"))
    if short.lower() in ("constant", "intercept"):
        return (0,) * len(names)
    plain = [name.replace(" ", "") for name in names]
    for term in model_terms(len(names), "quadratic")[1:]:
        factors = [name for name, power in zip(plain, term, strict=True) for _ in range(power)]
        known = {"".join(factors), "".join(reversed(factors))}
        if max(term) == 2:
            known.add(f"{factors[0]}^2")
        if short in known:
            return term
    return None


def contains(higher: Term, lower: Term) -> bool:
    """Return whether one term is another one multiplied by one or more factors."""
    return higher != lower and all(h >= low for h, low in zip(higher, lower, strict=True))


def model_matrix(points: Array, terms: Sequence[Term] | NDArray[np.int_]) -> Array:
    """Return the values of the terms, shape (n, number of terms), at points of shape (n, k)."""
    powers = np.array(terms)
    matrix = np.ones((len(points), len(powers)))
    for column, power in zip(points.T, powers.T, strict=True):
        matrix *= column[:, None] ** power
    return matrix


def model_slopes(points: Array, terms: Sequence[Term]) -> Array:
    """Return the derivatives of the terms with respect to the factors, shape (n, terms, k)."""
    powers = np.array(terms)
    slopes = np.empty((len(points), len(powers), points.shape[1]))
    for factor in range(points.shape[1]):
        lower = powers.copy()
        lower[:, factor] = np.maximum(lower[:, factor] - 1, 0)
        slopes[:, :, factor] = powers[:, factor] * model_matrix(points, lower)
    return slopes

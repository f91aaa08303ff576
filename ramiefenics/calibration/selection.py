"""Selection of the terms of a response surface."""

from __future__ import annotations

from collections.abc import Sequence

from ramiefenics.calibration.factors import Array
from ramiefenics.calibration.surface import Surface, fit_surface
from ramiefenics.calibration.terms import Term, contains, model_terms
from ramiefenics.specification import SpecificationError

RULES = {
    "p": "hierarchical backward elimination; the term with the largest p is removed as long as p "
    "exceeds 0.05, but a term stays as long as the model has a product or square that contains it",
    "aicc": "hierarchical backward elimination; the term whose removal lowers AICc most is removed "
    "as long as one does, but a term stays as long as the model has a product or square that "
    "contains it",
    "none": "all are kept",
}
"""Descriptions of the rules, by name.

Backward elimination is described in Myers, Montgomery and Anderson-Cook (2016), section 2.8, the
hierarchy of models in Peixoto (1990), and AICc in Hurvich and Tsai (1989).
"""

LEVEL = 0.05
"""Value of p above which a term may be removed."""


def select_surface(
    response: str,
    names: Sequence[str],
    points: Array,
    values: Array,
    model: str = "quadratic",
    rule: str = "p",
) -> Surface:
    """Fit a model, and remove the terms that a rule finds superfluous.

    Parameters
    ----------
    response, names
        Name of the response, and names of the factors.
    points, values
        Coded points, shape (n, k), and responses, shape (n,); NaN where a run has none.
    model
        Model to start from, one of `MODELS`.
    rule
        Rule of selection, one of `RULES`.

    Raises
    ------
    SpecificationError
        If there is no such rule or model, or if the runs are too few or cannot tell the terms of
        the model apart.
    """
    if rule not in RULES:
        raise SpecificationError("selection", rule, f"must be one of {', '.join(RULES)}")
    terms = model_terms(len(names), model)
    surface = fit_surface(response, names, terms, points, values)
    while rule != "none":
        candidate = _least(surface) if rule == "p" else _worst(surface)
        if candidate is None:
            break
        surface = _without(surface, candidate)
    return surface


def removable(terms: Sequence[Term]) -> list[Term]:
    """Return the terms whose removal preserves the model's hierarchy; never the constant."""
    return [
        term for term in terms if any(term) and not any(contains(other, term) for other in terms)
    ]


def _least(surface: Surface) -> Term | None:
    """Return the removable term with the largest p, if that is above the level."""
    p_values = dict(zip(surface.terms, surface.fit.pvalues, strict=True))
    free = removable(surface.terms)
    term = max(free, key=lambda t: p_values[t], default=None)
    return term if term is not None and p_values[term] > LEVEL else None


def _worst(surface: Surface) -> Term | None:
    """Return the term whose removal lowers AICc most, if any does."""
    smaller = {term: _without(surface, term) for term in removable(surface.terms)}
    term = min(smaller, key=lambda t: _criterion(smaller[t]), default=None)
    better = term is not None and _criterion(smaller[term]) < _criterion(surface)
    return term if better else None


def _criterion(surface: Surface) -> tuple[float, float]:
    """Return AICc and the residual sum of squares, which decides where AICc is infinite."""
    return surface.quality["AICc"], float(surface.fit.ssr)


def _without(surface: Surface, term: Term) -> Surface:
    kept = tuple(other for other in surface.terms if other != term)
    return Surface(
        surface.response, surface.names, kept, surface.points, surface.values, surface.merged
    )

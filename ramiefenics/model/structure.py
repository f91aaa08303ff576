"""Forms and expressions in UFL, taken apart into what is compiled and the data it is applied to."""

from __future__ import annotations

from typing import Any

import ufl
from ufl.algorithms.analysis import extract_type
from ufl.algorithms.signature import compute_expression_signature, compute_form_signature
from ufl.classes import Argument, Coefficient, Constant, Label
from ufl.domain import extract_unique_domain


class Structure:
    """A form or an expression on one mesh.

    UFL computes a form's signature too, but searches for the mesh in every coefficient, which takes
    as long as all the rest of a small simulation's set-up; and it cannot compute a signature for
    expressions with derivatives that have not been applied.

    Parameters
    ----------
    expression
        Form or expression in UFL.

    Attributes
    ----------
    signature
        Signature, equal for expressions that differ at most in their mesh, in the values of their
        data, and in the numbers that UFL gives to its objects. The form compiler generates the
        same code for these.
    arguments, coefficients, constants
        Arguments and data, in the form compiler's order.
    domain, mesh
        The mesh, in UFL and in C++.
    """

    def __init__(self, expression: Any) -> None:
        found = extract_type(expression, (Argument, Coefficient, Constant, Label))
        self.arguments = sorted(
            (e for e in found if isinstance(e, Argument)), key=lambda e: e.number()
        )
        self.coefficients, self.constants, labels = (
            sorted((e for e in found if isinstance(e, kind)), key=lambda e: e.count())
            for kind in (Coefficient, Constant, Label)
        )
        numbered = (self.coefficients, self.constants, labels)
        numbers = {e: n for group in numbered for n, e in enumerate(group)}
        if isinstance(expression, ufl.Form):
            self.domain, sign = expression.ufl_domain(), compute_form_signature
        else:
            self.domain, sign = extract_unique_domain(expression), compute_expression_signature
        self.mesh = self.domain.ufl_cargo()
        self.signature = sign(expression, {self.domain: 0, **numbers})

"""Options of the form compiler, the same for every form."""

from __future__ import annotations

from typing import Any

from dolfinx import fem
from ufl.algorithms import strip_variables
from ufl.algorithms.apply_algebra_lowering import apply_algebra_lowering
from ufl.algorithms.apply_derivatives import apply_derivatives

JIT_OPTIONS = {
    # fast-math vectorises the kernels; NaN must stay NaN, as it tells Newton's method that an
    # element has turned inside out.
    "cffi_extra_compile_args": ["-O3", "-march=native", "-ffast-math", "-fno-finite-math-only"],
    "cffi_libraries": ["m"],
}


def compile_form(form: Any) -> Any:
    """Compile a UFL form, or take it from the cache."""
    return fem.form(form, jit_options=JIT_OPTIONS)


def compile_expression(expression: Any, points: Any) -> fem.Expression:
    """Compile a UFL expression at points of the reference cell, or take it from the cache.

    Derivatives are applied here because the running number of a `ufl.variable` would otherwise
    enter the expression's signature, and with it every one would be compiled anew.
    """
    expression = strip_variables(apply_derivatives(apply_algebra_lowering(expression)))
    return fem.Expression(expression, points, jit_options=JIT_OPTIONS)

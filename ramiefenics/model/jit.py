"""The form compiler: its options, the same for every form, and its cache."""

from __future__ import annotations

import fcntl
import hashlib
import os
import platform
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from dolfinx import fem
from ufl.algorithms.apply_algebra_lowering import apply_algebra_lowering
from ufl.algorithms.apply_derivatives import apply_derivatives
from ufl.corealg.map_dag import map_expr_dag
from ufl.corealg.multifunction import MultiFunction
from ufl.domain import extract_unique_domain


def _processor() -> str:
    """Return a short key of what the processor can do.

    Code compiled for this processor may crash another one with the same home folder, hence the
    same cache; an unused macro of that value keeps the two apart.
    """
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        return platform.machine()
    flags = next((line for line in lines if line.startswith(("flags", "Features"))), "")
    return hashlib.sha256(flags.encode()).hexdigest()[:12]


CACHE = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "ramiefenics" / "forms"
"""Compiled forms; of this program only, see `_compiling`."""

JIT_OPTIONS = {
    "cache_dir": str(CACHE),
    # fast-math vectorises the kernels; NaN must stay NaN, as it tells Newton's method that an
    # element has turned inside out.
    "cffi_extra_compile_args": [
        "-O3",
        "-march=native",
        "-ffast-math",
        "-fno-finite-math-only",
        f"-DPROCESSOR_{_processor()}",
    ],
    "cffi_libraries": ["m"],
}


@contextmanager
def _compiling(domain: Any) -> Iterator[None]:
    """Clear away what killed compilations have left, which would block all later ones.

    FFCx marks a form that is being compiled by its C file. Under a lock, which ends with its
    process, such a file without its product has been abandoned.
    """
    if domain.ufl_cargo().comm.rank != 0:  # the other ranks only load
        yield
        return
    CACHE.mkdir(parents=True, exist_ok=True)
    with (CACHE / "lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        names = set(os.listdir(CACHE))
        for name in names:
            if name.endswith(".c") and f"{name}.cached" not in names:
                (CACHE / name).unlink()
        yield


def compile_form(form: Any) -> Any:
    """Compile a UFL form, or take it from the cache."""
    with _compiling(form.ufl_domain()):
        return fem.form(form, jit_options=JIT_OPTIONS)


class _WithoutVariables(MultiFunction):
    """Replaces `ufl.variable` by what it labels."""

    expr = MultiFunction.reuse_if_untouched

    def variable(self, o: Any, operand: Any, label: Any) -> Any:
        """Return the labelled expression."""
        return operand


def compile_expression(expression: Any, points: Any) -> fem.Expression:
    """Compile a UFL expression at points of the reference cell, or take it from the cache.

    Derivatives are applied here because the running number of a `ufl.variable` would otherwise
    enter the expression's signature, and with it every one would be compiled anew.
    """
    expression = apply_derivatives(apply_algebra_lowering(expression))
    expression = map_expr_dag(_WithoutVariables(), expression)
    with _compiling(extract_unique_domain(expression)):
        return fem.Expression(expression, points, jit_options=JIT_OPTIONS)

"""The form compiler: its options, the same for every form, and the cache of compiled code.

Simulations differ in mesh and data, but hardly in their forms. Compiled code is cached twice: on
disk by FFCx, for all processes, and in this process, which saves the analysis by which FFCx looks
it up.
"""

from __future__ import annotations

import fcntl
import hashlib
import os
import platform
from collections.abc import Hashable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from dolfinx import fem
from mpi4py import MPI
from numpy.typing import NDArray
from ufl.algorithms.analysis import extract_coefficients, extract_constants
from ufl.algorithms.apply_algebra_lowering import apply_algebra_lowering
from ufl.algorithms.apply_derivatives import apply_derivatives
from ufl.corealg.map_dag import map_expr_dag
from ufl.corealg.multifunction import MultiFunction

from ramiefenics.model.compat import expression_with, form_with
from ramiefenics.model.seal import is_sound, seal
from ramiefenics.model.structure import Structure


def _processor() -> str:
    """Return a short key of the processor's capabilities.

    Code compiled for this processor may crash another one that shares the home folder, and hence
    the cache; an unused macro with this value keeps the two apart.
    """
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        return platform.machine()
    flags = next((line for line in lines if line.startswith(("flags", "Features"))), "")
    return hashlib.sha256(flags.encode()).hexdigest()[:12]


CACHE = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "ramiefenics" / "forms"
"""Folder of compiled forms, for this program only, see `_compiling`."""

JIT_OPTIONS = {
    # Python's own flags ask for debugging information, which takes gcc as long as the rest.
    # Fast-math vectorises the kernels, but NaN must stay NaN, as it tells Newton's method that an
    # element has turned inside out.
    "cffi_extra_compile_args": [
        "-g0",
        "-O3",
        "-march=native",
        "-ffast-math",
        "-fno-finite-math-only",
        f"-DPROCESSOR_{_processor()}",
    ],
    "cffi_libraries": ["m"],
}


@contextmanager
def _compiling(signature: str, comm: MPI.Comm) -> Iterator[dict[str, Any]]:
    """Yield FFCx's options with a separate folder for a signature, cleared of unusable files.

    FFCx marks a form as being compiled by creating its C file, and other processes then wait for
    the product. Here only the holder of the folder's lock compiles, and the lock is released when
    its process ends. Under the lock, a C file without a product must therefore be left over from a
    compilation that was killed. A product whose checksum is wrong is treated likewise. As each
    signature has a folder, different forms are compiled at the same time.
    """
    folder = CACHE / signature[:24]
    options = {**JIT_OPTIONS, "cache_dir": str(folder)}
    if comm.rank != 0:  # the other ranks only load
        yield options
        return
    folder.mkdir(parents=True, exist_ok=True)
    with (folder / "lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        for product in _unsound(folder):
            product.unlink()  # not overwritten, as other processes may be running it
            (folder / f"{product.name.partition('.')[0]}.c.cached").unlink(missing_ok=True)
        names = set(os.listdir(folder))
        for name in names:
            if name.endswith(".c") and f"{name}.cached" not in names:
                (folder / name).unlink()
        yield options
        for product in _unsound(folder):  # the new ones
            seal(product)


def _unsound(folder: Path) -> list[Path]:
    return [product for product in folder.glob("*.so") if not is_sound(product)]


@dataclass(frozen=True)
class _Expression:
    """A compiled expression, independent of its data.

    Attributes
    ----------
    compiled
        The expression, without data.
    coefficients, constants
        Indices, among those of the UFL expression, of the ones that the code takes, in its order.
    """

    compiled: fem.Expression
    coefficients: list[int]
    constants: list[int]


_forms: dict[Hashable, fem.forms.CompiledForm] = {}
_expressions: dict[Hashable, _Expression] = {}
"""Forms and expressions that this process has compiled, by structure."""


def _all_have(kept: Mapping[Hashable, Any], key: Hashable, comm: MPI.Comm) -> bool:
    """Return whether no rank has to compile; if one must, all take part."""
    return bool(comm.allreduce(key in kept, op=MPI.LAND))


def compile_form(form: Any) -> fem.Form:
    """Compile a UFL form, or take it from this process or from the disk cache; collective."""
    parts = Structure(form)
    comm, key = parts.mesh.comm, parts.signature
    if not _all_have(_forms, key, comm):
        with _compiling(key, comm) as options:
            compiled = fem.compile_form(comm, form, jit_options=options)
        _forms[key] = replace(compiled, ufl_form=None)  # mesh and data are not kept
    return form_with(replace(_forms[key], ufl_form=form), parts)


class _WithoutVariables(MultiFunction):
    """Replaces every `ufl.variable` by the expression that it labels."""

    expr = MultiFunction.reuse_if_untouched

    def variable(self, o: Any, operand: Any, label: Any) -> Any:
        """Return the labelled expression."""
        return operand


def compile_expression(expression: Any, points: NDArray[np.float64]) -> fem.Expression:
    """Compile a UFL expression at points of the reference cell, cached as by `compile_form`.

    Derivatives are applied here because the running number of a `ufl.variable` would otherwise
    enter the expression's signature on disk, and every expression would be compiled anew.
    """
    parts = Structure(expression)
    comm, key = parts.mesh.comm, (parts.signature, points.shape, points.tobytes())
    if not _all_have(_expressions, key, comm):
        with _compiling(parts.signature, comm) as options:
            _expressions[key] = _compiled(expression, parts, points, options)
    known = _expressions[key]
    return expression_with(
        known.compiled,
        [parts.coefficients[i] for i in known.coefficients],
        [parts.constants[i] for i in known.constants],
    )


def _compiled(
    expression: Any, parts: Structure, points: NDArray[np.float64], options: dict[str, Any]
) -> _Expression:
    derived = apply_derivatives(apply_algebra_lowering(expression))
    derived = map_expr_dag(_WithoutVariables(), derived)
    compiled = fem.Expression(derived, points, jit_options=options)
    code, left = compiled.ufcx_expression, extract_coefficients(derived)
    used = (left[code.original_coefficient_positions[i]] for i in range(code.num_coefficients))
    compiled._ufl_expression = compiled._cpp_object = None  # mesh and data are not kept
    return _Expression(
        compiled,
        [parts.coefficients.index(coefficient) for coefficient in used],
        [parts.constants.index(constant) for constant in extract_constants(derived)],
    )

"""Evaluation of a law at material points of any deformation, by generated C code."""

from __future__ import annotations

import functools
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ramiefenics.model.kernels.library import compiled
from ramiefenics.model.kernels.material import material_source
from ramiefenics.model.laws.base import Law

Array = NDArray[np.floating[Any]]

RESULTS = ("stress", "tangent", "energies", "update")

DECLARATION = (
    "void {0}(const double *F, const double *p, const double *last, double duration, double *out)"
)


class PointKernel:
    """The functions of a law at one point.

    Parameters
    ----------
    law
        The law.
    parameters
        Names of its parameters, in the order in which they are given.

    Raises
    ------
    UnknownOperation
        If the law uses an operation that has no counterpart in C.
    """

    def __init__(self, law: Law, parameters: tuple[str, ...]) -> None:
        module = compiled(_source(law, parameters), _declared())
        self._ffi, self._lib = module.ffi, module.lib
        start = () if law.memory is None else law.memory.start.values()
        remembered = sum(np.size(value) for value in start) + 1
        self._sizes = {"stress": 9, "tangent": 81, "energies": 2, "update": remembered}

    def evaluate(self, which: str, F: Array, p: Array, last: Array, duration_s: float) -> Array:
        """Evaluate one of `RESULTS`, as `material_source` describes them.

        Parameters
        ----------
        which
            What to evaluate.
        F
            Deformation gradient, shape (3, 3).
        p
            Parameters.
        last
            Internal variables before the step, in the order in which they are stated, followed by
            the energy dissipated so far; one unused number for an elastic law.
        duration_s
            Duration of the step.
        """
        found = np.empty(self._sizes[which])
        arrays = [np.ascontiguousarray(array, dtype=np.float64) for array in (F, p, last, found)]
        *given, out = (self._ffi.cast("double *", array.ctypes.data) for array in arrays)
        getattr(self._lib, which)(*given, duration_s, out)
        return found


def _declared() -> str:
    return "".join(f"{DECLARATION.format(name)};\n" for name in RESULTS)


@functools.cache
def _source(law: Law, parameters: tuple[str, ...]) -> str:
    wrappers = (
        f"{DECLARATION.format(name)} {{ law_{name}(F, p, last, duration, out); }}"
        for name in RESULTS
    )
    head = "#include <math.h>\n#define PADDED_POINTS 1"
    return "\n".join((head, material_source(law, parameters), *wrappers))

"""Indicators of the material's stability: volume ratio, principal stretch, strong ellipticity.

A solid is strongly elliptic where ``A_iJkL m_i N_J m_k N_L`` is positive for all directions m and
N, with ``A = dP/dF`` and the stress P at the end of a step. There, every plane wave has a real
speed, and no deformation can localise in a band (Hadamard 1903; Marsden and Hughes 1983, section
4.3; for materials with internal variables, Rice 1976). The minimum over unit vectors m and N is the
smallest eigenvalue of the acoustic tensor over all directions N. Where strong ellipticity is lost,
the solution depends on the mesh.
"""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType

import basix
import numpy as np
import ufl
from numpy.typing import NDArray

from ramiefenics.model.jit import compile_expression
from ramiefenics.model.kernels.library import compiled
from ramiefenics.model.solid import QUADRATURE_DEGREE, Solid

LEVELS = ((1.0, 24, 0), (0.2, 96, 1), (0.06, 400, 30))
"""Levels of the search for the minimum.

For each: the share of the points that take part, the lowest of the previous level; the number of
directions N on the hemisphere that are tried; the number of improvements of the best of them.
"""

FUNCTIONS = """
void stretches(int64_t, const double *, double *, double *);
void search(int64_t, const int64_t *, const double *, int, const double *, int, double *);
"""


@dataclass(frozen=True)
class PointState:
    """State of the material at every quadrature point of this rank's cells.

    Attributes
    ----------
    volume_ratio
        J, shape (cells, points).
    principal_stretch
        Smallest principal stretch, negative where J is; same shape.
    acoustic_MPa
        Smallest eigenvalue of the acoustic tensor over all directions; same shape. It is an upper
        bound, tight at the lowest points; elsewhere the search is coarse. NaN if not searched for.
    """

    volume_ratio: NDArray[np.float64]
    principal_stretch: NDArray[np.float64]
    acoustic_MPa: NDArray[np.float64]


class MaterialPoints:
    """The quadrature points of a solid, where its material's state is evaluated.

    Parameters
    ----------
    solid
        The solid.
    acoustic
        Whether acoustic eigenvalues may be searched for.
    """

    def __init__(self, solid: Solid, acoustic: bool = True) -> None:
        points, _ = basix.make_quadrature(basix.CellType.hexahedron, QUADRATURE_DEGREE[solid.order])
        self._mesh = solid.mesh
        self._cells = solid.own_cells
        self._kernel, self._acoustic = solid.kernel, acoustic
        if self._kernel is None:
            F = ufl.variable(solid.gradient(solid.displacement))
            tangent = ufl.diff(solid.stress_at(F), F)
            self._gradient = compile_expression(solid.gradient(solid.displacement), points)
            self._tangent = compile_expression(tangent, points)
        self._shape = (len(self._cells), len(points))

    def evaluate(self, search: bool = False) -> PointState:
        """Return the current state.

        Parameters
        ----------
        search
            Whether to search for acoustic eigenvalues, unless that is switched off altogether.
        """
        volume_ratio, stretch, acoustic = np.full((3, *self._shape), np.nan)
        module = _module()
        numbers = (
            module.ffi.from_buffer("double *", array)
            for array in (self._gradients(), volume_ratio, stretch)
        )
        module.lib.stretches(volume_ratio.size, *numbers)
        if search and self._acoustic:
            acoustic[:] = smallest_acoustic_eigenvalue(self._tangents()).reshape(self._shape)
        return PointState(volume_ratio, stretch, acoustic)

    def _gradients(self) -> NDArray[np.float64]:
        if self._kernel is not None:
            return self._kernel.gradients().reshape(-1, 3, 3)
        return np.asarray(self._gradient.eval(self._mesh, self._cells)).reshape(-1, 3, 3)

    def _tangents(self) -> NDArray[np.float64]:
        if self._kernel is not None:
            return self._kernel.tangents().reshape(-1, 3, 3, 3, 3)
        tangents = np.asarray(self._tangent.eval(self._mesh, self._cells))
        return tangents.reshape(-1, 3, 3, 3, 3)


def smallest_acoustic_eigenvalue(tangent: NDArray[np.float64]) -> NDArray[np.float64]:
    """Minimise ``A_iJkL m_i N_J m_k N_L`` over unit vectors m and N.

    The best of a set of directions N is improved alternately: for fixed N, the best m is an
    eigenvector of the acoustic tensor; for fixed m, the best N is an eigenvector of its
    counterpart; neither raises the value. The result is thus an upper bound of the minimum, which
    is tight at the critical points, where the search is finer.

    Parameters
    ----------
    tangent
        Derivatives A of the stress with respect to the deformation gradient, MPa, shape
        (n, 3, 3, 3, 3).

    Returns
    -------
    numpy.ndarray
        Minima, MPa, shape (n,).
    """
    module, value = _module(), np.full(len(tangent), np.inf)
    given, values = (
        module.ffi.from_buffer("double *", array)
        for array in (np.ascontiguousarray(tangent), value)
    )
    for share, directions, sweeps in LEVELS:
        lowest = np.argsort(value)[: math.ceil(share * len(value))]
        points = module.ffi.from_buffer("int64_t *", lowest)
        starts = module.ffi.from_buffer("double *", hemisphere(directions))
        module.lib.search(len(lowest), points, given, directions, starts, sweeps, values)
    return value


@functools.cache
def _module() -> ModuleType:
    source = Path(__file__).with_name("ellipticity.c").read_text(encoding="utf-8")
    return compiled(source, FUNCTIONS)


def hemisphere(count: int) -> NDArray[np.float64]:
    """Return unit vectors spread evenly over a hemisphere (Fibonacci lattice), shape (count, 3)."""
    i = np.arange(count) + 0.5
    polar, azimuth = np.arccos(1.0 - i / count), np.pi * (1.0 + 5.0**0.5) * i
    x, y = np.cos(azimuth) * np.sin(polar), np.sin(azimuth) * np.sin(polar)
    return np.stack([x, y, np.cos(polar)], axis=1)

"""Whether the material can still resist: volume ratio, principal stretch, strong ellipticity.

A solid is strongly elliptic where ``A(m, N) = m.(dP/dF : m (x) N) N``, of the stress P at the end
of a step, is positive for all directions m, N: where every plane wave has a speed, and no
deformation can localise in a band (Hadamard 1903; Marsden and Hughes 1983, section 4.3; for
materials that remember, Rice 1976). Its minimum over unit vectors is the smallest eigenvalue of the
acoustic tensor over directions N. Where it is lost, the solution depends on the mesh.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import basix
import numpy as np
import ufl
from numpy.typing import NDArray

from ramiefenics.model.jit import compile_expression
from ramiefenics.model.solid import QUADRATURE_DEGREE, Solid

LEVELS = ((1.0, 24, 0), (0.2, 96, 1), (0.06, 400, 30))
"""The search for the minimum: share of the points, lowest by the level before, that take part;
directions N on the hemisphere at which it starts; improvements of the best of them."""

BLOCK = 4096
"""Points searched at once, to save memory."""


@dataclass(frozen=True)
class PointState:
    """State of the material at every quadrature point of this rank's cells.

    Attributes
    ----------
    volume_ratio
        J, shape (cells, points).
    principal_stretch
        The smallest one, negative where J is; same shape.
    acoustic_MPa
        Smallest eigenvalue of the acoustic tensor over directions; same shape. An upper bound,
        tight at the lowest points; elsewhere the search is coarse. NaN if not sought.
    """

    volume_ratio: NDArray[np.float64]
    principal_stretch: NDArray[np.float64]
    acoustic_MPa: NDArray[np.float64]


class MaterialPoints:
    """The quadrature points of a solid.

    Parameters
    ----------
    solid
        Whose material to look at.
    acoustic
        Whether to seek acoustic eigenvalues.
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
            Whether to seek acoustic eigenvalues, where that is wanted at all.
        """
        F = self._gradients()
        volume_ratio = np.linalg.det(F)
        squared = _smallest_eigenvalue((F.transpose(0, 2, 1) @ F)[..., None])[:, 0]
        stretch = np.sqrt(np.maximum(squared, 0.0)) * np.sign(volume_ratio)
        acoustic: NDArray[np.float64] = np.full(len(F), np.nan)
        if search and self._acoustic:
            acoustic = smallest_acoustic_eigenvalue(self._tangents())
        fields = (volume_ratio, stretch, acoustic)
        return PointState(*(field.reshape(self._shape) for field in fields))

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

    The best of a set of directions N is improved by turns: for fixed N the best m is an
    eigenvector of the acoustic tensor, for fixed m the best N one of its counterpart, and
    neither turn raises the value. An upper bound of the minimum, hence; tight at the critical
    points, which are searched more finely.

    Parameters
    ----------
    tangent
        Derivatives of the stress by the deformation gradient, MPa, shape (n, 3, 3, 3, 3).

    Returns
    -------
    numpy.ndarray
        MPa, shape (n,).
    """
    # A_(iJ)(kL) to (ik)(JL): acoustic tensors for all directions are one matrix product
    form = tangent.transpose(0, 1, 3, 2, 4).reshape(-1, 9, 9)
    value = np.full(len(form), np.inf)
    for share, directions, sweeps in LEVELS:
        lowest = np.argsort(value)[: math.ceil(share * len(value))]
        for block in np.array_split(lowest, math.ceil(len(lowest) / BLOCK)):
            found = _search(form[block], directions, sweeps)
            value[block] = np.minimum(value[block], found)
    return value


def _search(form: NDArray[np.float64], directions: int, sweeps: int) -> NDArray[np.float64]:
    """Search from a number of directions N, shape (n, 9, 9) to (n,)."""
    starts = hemisphere(directions)
    if sweeps == 0:  # ranks the points only
        form, starts = form.astype(np.float32), starts.astype(np.float32)
    dyads = np.einsum("dj,dl->jld", starts, starts).reshape(9, -1)
    values = _smallest_eigenvalue((form @ dyads).reshape(-1, 3, 3, directions))
    best = values.argmin(axis=1)
    value, n = values[np.arange(len(form)), best], starts[best]
    turned = form.transpose(0, 2, 1)
    moving = np.arange(len(form))
    for _ in range(sweeps):
        m = _lowest_eigenvector(form[moving], n[moving])[1]
        lower, n[moving] = _lowest_eigenvector(turned[moving], m)
        gain = value[moving] - lower
        value[moving] = lower
        moving = moving[gain > 1e-9 * np.abs(lower)]
    return value


def hemisphere(count: int) -> NDArray[np.float64]:
    """Spread unit vectors evenly over a hemisphere (Fibonacci lattice), shape (count, 3)."""
    i = np.arange(count) + 0.5
    polar, azimuth = np.arccos(1.0 - i / count), np.pi * (1.0 + 5.0**0.5) * i
    x, y = np.cos(azimuth) * np.sin(polar), np.sin(azimuth) * np.sin(polar)
    return np.stack([x, y, np.cos(polar)], axis=1)


def _lowest_eigenvector(
    form: NDArray[np.float64], vector: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    dyad = np.einsum("ni,nj->nij", vector, vector).reshape(-1, 9, 1)
    values, vectors = np.linalg.eigh((form @ dyad).reshape(-1, 3, 3))
    return values[:, 0], vectors[:, :, 0]


def _smallest_eigenvalue(q: NDArray[np.float64]) -> NDArray[np.float64]:
    """Smallest eigenvalue of symmetric tensors, shape (n, 3, 3, d) to (n, d), in closed form.

    Smith (1961), Communications of the ACM 4, p. 168.
    """
    mean = (q[:, 0, 0] + q[:, 1, 1] + q[:, 2, 2]) / 3.0
    a, b, c = q[:, 0, 0] - mean, q[:, 1, 1] - mean, q[:, 2, 2] - mean
    d, e, f = q[:, 0, 1], q[:, 0, 2], q[:, 1, 2]
    size = np.sqrt((a * a + b * b + c * c + 2.0 * (d * d + e * e + f * f)) / 6.0)
    half = (a * (b * c - f * f) - d * (d * c - f * e) + e * (d * f - b * e)) / 2.0
    cosine = np.clip(half / np.maximum(size, 1e-12) ** 3, -1.0, 1.0)
    return mean + 2.0 * size * np.cos(np.arccos(cosine) / 3.0 + 2.0 * np.pi / 3.0)

"""What the quadrature points of a boundary remember from step to step."""

from __future__ import annotations

import basix
import basix.ufl
import numpy as np
import ufl
from dolfinx import fem
from dolfinx import mesh as dmesh

from ramiefenics.model.jit import compile_form
from ramiefenics.model.laws.base import Expr


class FacetMemory:
    """Numbers at every quadrature point of some boundary facets of hexahedra.

    They are held by a discontinuous space whose nodes are Gauss points, on the lines through the
    facet's quadrature points across the cell; all nodes of a line have its point's number, so the
    function takes on exactly these numbers on the facet.

    Parameters
    ----------
    mesh
        Hexahedra; none may have two of the facets.
    ds
        The measure on the facets.
    degree
        Its quadrature degree.
    size
        How many numbers a point remembers; zero at first.

    Attributes
    ----------
    function
        The numbers, UFL shape (size,), to be used in integrals over `ds` only.
    """

    def __init__(self, mesh: dmesh.Mesh, ds: ufl.Measure, degree: int, size: int) -> None:
        element = basix.ufl.element(
            "Lagrange",
            mesh.basix_cell(),
            degree // 2,  # one less than the quadrature has points along an edge
            lagrange_variant=basix.LagrangeVariant.gl_warped,
            shape=(size,),
            discontinuous=True,
        )
        self._space = fem.functionspace(mesh, element)
        self._ds = ds
        self.function = fem.Function(self._space, name="memory")
        # A node's basis function vanishes on the facet but at one quadrature point: its integral
        # times a number, over its integral, is the number there.
        self._weights = self._integrate(self.compile(ufl.as_vector([1.0] * size)))
        self._used = np.flatnonzero(self._weights)

    def compile(self, numbers: Expr) -> fem.Form:
        """Prepare numbers, UFL shape (size,), for `remember`."""
        return compile_form(ufl.dot(numbers, ufl.TestFunction(self._space)) * self._ds)

    def remember(self, numbers: fem.Form) -> None:
        """Let every point remember new numbers, which may depend on the old ones."""
        used = self._used
        self.function.x.array[used] = self._integrate(numbers)[used] / self._weights[used]

    @staticmethod
    def _integrate(numbers: fem.Form) -> np.ndarray:
        return np.asarray(fem.assemble_vector(numbers).array)

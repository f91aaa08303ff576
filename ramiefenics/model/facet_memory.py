"""Numbers at the quadrature points of a boundary, kept from step to step."""

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

    They are stored in a function of a discontinuous space whose nodes are Gauss points, on the
    lines that cross the cell through the facet's quadrature points. All nodes of a line have the
    number of its quadrature point, so the function has exactly these values on the facet.

    Parameters
    ----------
    mesh
        Hexahedra, none of which may have more than one of the facets.
    ds
        Measure on the facets.
    degree
        Quadrature degree of the measure.
    size
        How many numbers a point has; they are zero at first.

    Attributes
    ----------
    function
        The numbers, UFL shape (size,), for use in integrals over `ds` only.
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
        # A node's basis function vanishes at all quadrature points of the facet but one, so the
        # integral of a number times this function, over that of the function, is the number there.
        self._weights = self._integrate(self.compile(ufl.as_vector([1.0] * size)))
        self._used = np.flatnonzero(self._weights)

    def compile(self, numbers: Expr) -> fem.Form:
        """Compile an expression for new numbers, UFL shape (size,), for `remember`."""
        return compile_form(ufl.dot(numbers, ufl.TestFunction(self._space)) * self._ds)

    def remember(self, numbers: fem.Form) -> None:
        """Store new numbers at every point; they may depend on the old ones."""
        used = self._used
        self.function.x.array[used] = self._integrate(numbers)[used] / self._weights[used]

    @staticmethod
    def _integrate(numbers: fem.Form) -> np.ndarray:
        return np.asarray(fem.assemble_vector(numbers).array)

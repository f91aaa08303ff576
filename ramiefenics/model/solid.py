"""A layered hyperelastic solid on a mesh: displacement, energy, stress."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import ufl
from dolfinx import fem
from dolfinx import mesh as dmesh

from ramiefenics.model.compat import geometry_order
from ramiefenics.model.laws import LAWS
from ramiefenics.model.laws.base import Expr
from ramiefenics.specification import Material
from ramiefenics.specification.material import G_PER_CM3

QUADRATURE_DEGREE = {1: 2, 2: 4}
"""Volume quadrature by element order: 2 x 2 x 2 and 3 x 3 x 3 points, full integration."""


class Solid:
    """Displacement field and stored energy of a layered solid.

    The layers' parameters are cell-wise data to the forms, so that one compiled form serves
    any number of layers and any constants.

    Parameters
    ----------
    mesh
        Hexahedra; the displacement has the order of the geometry.
    cells
        Layer of every cell, 1 for the first material.
    materials
        One per layer.
    law
        Name of the hyperelastic law.
    serendipity
        Whether the displacement does without nodes inside faces and cells (Arnold and Awanou 2011).

    Attributes
    ----------
    space
        Vector space of the displacement, mm.
    displacement
        The unknown.
    density
        Cell-wise, tonne/mm3.
    duration
        Of the step from the last accepted state, s.
    """

    def __init__(
        self,
        mesh: dmesh.Mesh,
        cells: dmesh.MeshTags,
        materials: Sequence[Material],
        law: str,
        serendipity: bool = False,
    ) -> None:
        self.mesh = mesh
        self.law = LAWS[law]
        parameters = [self.law.parameters(material) for material in materials]
        self.order = geometry_order(mesh)
        family = "S" if serendipity else "Lagrange"
        self.space = fem.functionspace(mesh, (family, self.order, (mesh.geometry.dim,)))
        self.cellwise = fem.functionspace(mesh, ("DG", 0))
        self.displacement = fem.Function(self.space, name="displacement")
        self.duration = fem.Constant(mesh, 0.0)
        self._parameters = {
            name: self._layerwise(name, cells, [p[name] for p in parameters])
            for name in parameters[0]
        }
        densities = [G_PER_CM3 * material.density_g_per_cm3 for material in materials]
        self.density = self._layerwise("density", cells, densities)
        self.dx = ufl.Measure(
            "dx", mesh, metadata={"quadrature_degree": QUADRATURE_DEGREE[self.order]}
        )

    def _layerwise(self, name: str, cells: dmesh.MeshTags, values: Sequence[float]) -> fem.Function:
        """Return a cell-wise function with one value per layer."""
        function = fem.Function(self.cellwise, name=name)
        for tag, value in enumerate(values, start=1):
            function.x.array[cells.find(tag)] = value
        function.x.scatter_forward()
        return function

    def gradient(self, displacement: Expr) -> Expr:
        """Return the deformation gradient of a displacement, UFL shape (3, 3)."""
        return ufl.Identity(3) + ufl.grad(displacement)

    def energy_density(self, F: Expr) -> Expr:
        """Return the stored energy per undeformed volume, N/mm2."""
        return self.law.energy(F, self._parameters)

    def stress(self, displacement: Expr) -> Expr:
        """Return the first Piola-Kirchhoff stress, MPa, UFL shape (3, 3)."""
        F = ufl.variable(self.gradient(displacement))
        return ufl.diff(self.energy_density(F), F)

    def energy(self) -> Expr:
        """Return the stored energy of the mesh, a UFL functional, N mm."""
        return self.energy_density(self.gradient(self.displacement)) * self.dx

    def cauchy(self) -> Expr:
        """Return the Cauchy stress, MPa, UFL shape (3, 3)."""
        F = self.gradient(self.displacement)
        return self.stress(self.displacement) * F.T / ufl.det(F)

    def symmetry(self, facets: Any, axis: int) -> fem.DirichletBC:
        """Hold one displacement component at zero on facets."""
        space = self.space.sub(axis)
        scalar, _ = space.collapse()
        dim = self.mesh.topology.dim - 1
        dofs = fem.locate_dofs_topological((space, scalar), dim, facets)
        return fem.dirichletbc(fem.Function(scalar), dofs, space)

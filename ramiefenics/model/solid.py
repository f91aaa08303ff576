"""A layered solid on a mesh: displacement, energy, stress and internal variables."""

from __future__ import annotations

import logging
from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import Any

import numpy as np
import ufl
from dolfinx import fem
from dolfinx import mesh as dmesh
from mpi4py import MPI
from numpy.typing import NDArray

from ramiefenics.model.compat import geometry_order
from ramiefenics.model.equations import FormTerm, Term
from ramiefenics.model.jit import compile_form
from ramiefenics.model.kernels.element import ElementKernel
from ramiefenics.model.kernels.lowering import UnknownOperation
from ramiefenics.model.kernels.term import KernelTerm
from ramiefenics.model.laws import law_named
from ramiefenics.model.laws.base import Expr, State
from ramiefenics.model.local_law import FIBRE_X, fibre, local_law
from ramiefenics.model.material_memory import MaterialMemory
from ramiefenics.specification import Material
from ramiefenics.specification.material import G_PER_CM3

log = logging.getLogger(__name__)

QUADRATURE_DEGREE = {1: 2, 2: 4}
"""Degree of the volume's full quadrature by element order: 2 x 2 x 2 and 3 x 3 x 3 points."""

DISSIPATED = "dissipated"
"""Name of the dissipated energy, N/mm2, which is stored beside the law's internal variables."""


def volume_measure(mesh: dmesh.Mesh, order: int, cells: dmesh.MeshTags) -> ufl.Measure:
    """Return the measure of volume, by tags of cells, with full integration."""
    metadata = {"quadrature_degree": QUADRATURE_DEGREE[order]}
    return ufl.Measure("dx", mesh, subdomain_data=cells, metadata=metadata)


class Solid:
    """Displacement field and stored energy of a layered solid.

    The layers' parameters are cell-wise data of the forms, so that one compiled form serves any
    number of layers and any constants.

    Parameters
    ----------
    mesh
        Hexahedra; the displacement has the order of the geometry.
    cells
        Layer of every cell, 1 for the first material; cells with other tags are not part of it.
    materials
        Material of each layer.
    law
        Material law, as in the specification.
    serendipity
        Whether the displacement has no nodes inside faces and cells (Arnold and Awanou 2011).
    local
        Fields that vary from point to point, by the names in `local_law`.

    Attributes
    ----------
    space
        Vector space of the displacement, mm.
    displacement
        The unknown.
    density
        Cell-wise density, tonne/mm3.
    cells
        Local cells of the layers, those that this rank owns first.
    duration
        Duration of the step from the last accepted state, s.
    """

    def __init__(
        self,
        mesh: dmesh.Mesh,
        cells: dmesh.MeshTags,
        materials: Sequence[Material],
        law: str,
        serendipity: bool = False,
        local: Mapping[str, fem.Function] | None = None,
    ) -> None:
        self.mesh = mesh
        self._local = dict(local or {})
        self.law = local_law(law_named(law), tuple(self._local))
        parameters = [self.law.parameters_of(material) for material in materials]
        self.order = geometry_order(mesh)
        family = "S" if serendipity else "Lagrange"
        self.space = fem.functionspace(mesh, (family, self.order, (mesh.geometry.dim,)))
        self.cellwise = fem.functionspace(mesh, ("DG", 0))
        self.displacement = fem.Function(self.space, name="displacement")
        self.duration = fem.Constant(mesh, 0.0)
        self._layers = {
            name: self._layerwise(name, cells, [p[name] for p in parameters])
            for name in parameters[0]
        }
        self._parameters = self._layers | self._local
        densities = [G_PER_CM3 * material.density_g_per_cm3 for material in materials]
        self.density = self._layerwise("density", cells, densities)
        self.cells = np.flatnonzero(self.density.x.array).astype(np.int32)
        everywhere = len(self.cells) == len(self.density.x.array)
        self.dx = volume_measure(mesh, self.order, cells)
        if not mesh.comm.allreduce(everywhere, op=MPI.LAND):
            self.dx = self.dx(tuple(range(1, len(materials) + 1)))
        self._memory = None
        if self.law.memory is not None:
            start = {**self.law.memory.start, DISSIPATED: 0.0}
            self._memory = MaterialMemory(mesh, self.order, start, self.cells)

    @property
    def own_cells(self) -> NDArray[np.int32]:
        """The cells that this rank owns."""
        local = self.mesh.topology.index_map(self.mesh.topology.dim).size_local
        return self.cells[self.cells < local]

    @cached_property
    def kernel(self) -> ElementKernel | None:
        """Integrals over the cells by generated C; None if the form compiler must be used."""
        try:
            return ElementKernel(
                self.law,
                self._layers,
                self._local,
                self._memory,
                self.displacement,
                self.duration,
                QUADRATURE_DEGREE[self.order],
                self.cells,
            )
        except UnknownOperation as error:
            log.info(
                "the law %s is compiled by the form compiler, whose code is slower: %s",
                self.law.name,
                error,
            )
            return None

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

    def fibres(self, F: Expr) -> Expr:
        """Return the fibres' unit vector at rest as mapped by F, UFL shape (3,)."""
        return F * fibre(self._local) if FIBRE_X in self._local else F[:, 2]

    @property
    def _last(self) -> State:
        """Internal variables at the end of the last step."""
        return {} if self._memory is None else self._memory.last

    def state(self, F: Expr) -> State:
        """Return the internal variables at the end of a step to the deformation gradient F."""
        return self.law.state(F, self._parameters, self._last, self.duration)

    def energy_density(self, F: Expr, state: State | None = None) -> Expr:
        """Return the stored energy per undeformed volume, N/mm2.

        Parameters
        ----------
        F
            Deformation gradient, UFL shape (3, 3).
        state
            Internal variables; by default those that follow from F.
        """
        return self.law.stored(F, self._parameters, self.state(F) if state is None else state)

    def stress_at(self, F: Expr) -> Expr:
        """Return the first Piola-Kirchhoff stress at a `ufl.variable`, MPa, UFL shape (3, 3)."""
        return self.law.stress(F, self._parameters, self._last, self.duration)

    def stress(self, displacement: Expr) -> Expr:
        """Return the first Piola-Kirchhoff stress, MPa, UFL shape (3, 3)."""
        return self.stress_at(ufl.variable(self.gradient(displacement)))

    def energy(self) -> Expr:
        """Return the stored energy of the solid, a UFL functional, N mm."""
        return self.energy_density(self.gradient(self.displacement)) * self.dx

    def term(self) -> Term:
        """Return the contribution of the stress to the equations."""
        if self.kernel is not None:
            return KernelTerm(self.kernel)
        return FormTerm(self.virtual_work(ufl.TestFunction(self.space)), self.displacement)

    def energies(self) -> tuple[float, float]:
        """Return the energies that this rank's cells store, and have dissipated so far, N mm."""
        if self.kernel is not None:
            return self.kernel.energies()
        stored, dissipated = self._energies
        lost = 0.0 if dissipated is None else fem.assemble_scalar(dissipated)
        return float(fem.assemble_scalar(stored)), float(lost)

    @cached_property
    def _energies(self) -> tuple[fem.Form, fem.Form | None]:
        dissipation = self.dissipation()
        compiled = None if dissipation is None else compile_form(dissipation)
        return compile_form(self.energy()), compiled

    def virtual_work(self, v: Expr) -> Expr:
        """Return the virtual work of the stress on a test function, a UFL form, N mm."""
        if self._memory is None:
            return ufl.derivative(self.energy(), self.displacement, v)
        return ufl.inner(self.stress(self.displacement), ufl.grad(v)) * self.dx

    def dissipation(self) -> Expr | None:
        """Return the energy dissipated so far, a UFL functional, N mm; None for an elastic law."""
        if self._memory is None:
            return None
        F = self.gradient(self.displacement)
        return self._dissipated(F, self.state(F)) * self.dx

    def _dissipated(self, F: Expr, state: State) -> Expr:
        step = self.law.dissipated(F, self._parameters, self._last, state, self.duration)
        return self._last[DISSIPATED] + step

    def remember(self) -> None:
        """Store the internal variables of the current state, and reset the duration to zero."""
        if self._memory is not None:
            self._memory.remember(self._updated(self._memory))
        self.duration.value = 0.0

    def take_over(self, before: Solid, turn: NDArray[np.float64]) -> None:
        """Take over displacement and internal variables of the same solid before it was turned.

        Parameters
        ----------
        before
            Solid of the same cells.
        turn
            Rotation about Z by which it was turned, shape (3, 3).
        """
        moved = before.displacement.x.array.reshape(-1, 3) @ turn.T
        self.displacement.x.array[:] = moved.ravel()
        if self._memory is not None and before._memory is not None:
            self._memory.take_over(before._memory, turn)

    def internal_variables(
        self, points: NDArray[np.float64], cells: NDArray[np.int32]
    ) -> dict[str, NDArray[np.float64]]:
        """Return the internal variables of the current state, by name with unit.

        Parameters
        ----------
        points
            Points in reference coordinates, shape (n, 3).
        cells
            Local cells.

        Returns
        -------
        dict
            The law's internal variables and the dissipation so far, each of shape (cells, n, ...);
            empty for an elastic law.
        """
        if self._memory is None or self.law.memory is None:
            return {}
        units = {**self.law.memory.units, DISSIPATED: "Nmm_per_mm3"}
        values = self._memory.interpolate(self._updated(self._memory), points, cells)
        return {f"{n}_{units[n]}" if n in units else n: value for n, value in values.items()}

    def _updated(self, memory: MaterialMemory) -> NDArray[np.float64]:
        """Return the internal variables of the current state, ghosts included."""
        return memory.evaluate(self._now) if self.kernel is None else self.kernel.updated()

    @cached_property
    def _now(self) -> fem.Expression:
        """Compiled expression for the internal variables of the current state."""
        assert self._memory is not None
        F = self.gradient(self.displacement)
        state = self.state(F)
        return self._memory.compile({**state, DISSIPATED: self._dissipated(F, state)})

    def cauchy(self) -> Expr:
        """Return the Cauchy stress, MPa, UFL shape (3, 3)."""
        F = self.gradient(self.displacement)
        return self.stress(self.displacement) * F.T / ufl.det(F)

    def symmetry(self, facets: Any, axis: int) -> fem.DirichletBC:
        """Return the condition that one displacement component is zero on facets."""
        space = self.space.sub(axis)
        scalar, _ = space.collapse()
        dim = self.mesh.topology.dim - 1
        dofs = fem.locate_dofs_topological((space, scalar), dim, facets)
        return fem.dirichletbc(fem.Function(scalar), dofs, space)

"""Frictional contact of the stalk's surface with rigid cylinders and plates by Nitsche's method.

With x = X + u, a cylinder of axis x_c and radius R_c, gap g = |x - x_c| - R_c and normal n = grad g
(from the cylinder into the stalk), nominal traction t = P N and gamma > 0, the pressure is
``p = [n.t - gamma g]_+``, except across wide gaps, see `GAP_LIMIT`; the weak form is

    int P : grad v dX - int (p n + t_f).v dS - theta int (n.t - p) / gamma n.(A : grad v) N dS = 0

(Chouly, Hild and Renard 2015, for small strain; Mlika, Renard and Chouly 2017, for large). The
last term vanishes at the solution whatever multiplies ``n.t - p``. The material's tangent A is
therefore taken at the last converged step, which keeps the compiled tangent small, and the normal
is not varied, which keeps the discrete forces in exact equilibrium.

The friction is ``t_f = -mu_f p b``, Coulomb's law with internal variables at every quadrature
point, see `friction`.

With the order m of the elements and the thickness t_c of the surface cells, the stabilisation is

    gamma = 20 m^2 / t_c d2W/da2(F + a n (x) N),

where 20 stands for `ContactMethod.stabilisation`. The derivative is taken at a = 0 and at the
centre of each cell, where N is the radial direction of the undeformed stalk and
``n = cof(F) N / |cof(F) N|`` the normal of the deformed surface. gamma never falls below
its value at rest.
"""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import ufl
from dolfinx import fem
from dolfinx import mesh as dmesh
from mpi4py import MPI
from numpy.typing import NDArray

from ramiefenics.model.equations import FormTerm, Term
from ramiefenics.model.facet_memory import FacetMemory
from ramiefenics.model.friction import FrictionLaw, Grip
from ramiefenics.model.jit import compile_expression, compile_form
from ramiefenics.model.kernels.facet import FacetKernel
from ramiefenics.model.kernels.lowering import UnknownOperation
from ramiefenics.model.kernels.term import KernelTerm
from ramiefenics.model.laws.base import Expr
from ramiefenics.model.pieces import within_cells
from ramiefenics.model.solid import Solid
from ramiefenics.specification import ContactMethod, Cylinder, Friction

log = logging.getLogger(__name__)

SURFACE_QUADRATURE_DEGREE = {1: 4, 2: 6}
"""Quadrature degree on the surface, by element order.

It is higher than the volume's, because the edge of contact cuts facets.
"""


SLIPS = 0.9
"""Mobilised share of the friction above which a point counts as slipping."""

PLATE_RADIUS_MM = 1e3
"""Distance of a plate's axis behind its surface.

A plate is treated as a cylinder from whose axis distances are measured along Y alone.
"""

GAP_LIMIT = 0.1
"""Widest gap g across which points touch, over the thickness t_c of the surface cells.

At a solution, the gaps of touching points are far smaller. On the way to one, a cell that is
crushed by too large a Newton step could otherwise hold itself crushed by its own stress, without
touching anything.
"""


@dataclass(frozen=True)
class Obstacle:
    """A rigid cylinder or plate, its position at the start, and the facets that may touch it.

    Attributes
    ----------
    cylinder
        The cylinder.
    front_mm
        Y of its front: of its lowest point, or of the highest if it is below the stalk.
    facets
        Boundary facets that can touch it, local indices.
    """

    cylinder: Cylinder
    front_mm: float
    facets: NDArray[np.int32]

    @property
    def radius_mm(self) -> float:
        """Distance of its surface from its axis; `PLATE_RADIUS_MM` for a plate."""
        return PLATE_RADIUS_MM if self.cylinder.flat else self.cylinder.radius_mm

    @property
    def y_mm(self) -> float:
        """Y of its axis at the start."""
        return self.front_mm + self.cylinder.up * self.radius_mm


def depth(cylinder: Cylinder, front_mm: float, points: NDArray[np.float64]) -> float:
    """Return the largest depth along Y of a cylinder beyond points; -inf if it covers none.

    Parameters
    ----------
    cylinder
        The cylinder.
    front_mm
        Y of its front, see `Obstacle`.
    points
        Points on the surface that it faces, shape (n, 3).
    """
    beyond = cylinder.up * (points[:, 1] - front_mm)
    if not cylinder.flat:
        squared = cylinder.radius_mm**2 - (points[:, 2] - cylinder.z_mm) ** 2
        beyond += np.sqrt(np.maximum(squared, 0.0)) - cylinder.radius_mm
        beyond = beyond[squared >= 0.0]
    return float(np.max(beyond, initial=-np.inf))


@dataclass(frozen=True)
class ContactSums:
    """Sums over one obstacle's contact with the mesh.

    Attributes
    ----------
    cylinder
        The obstacle.
    force_y_N
        Force on the stalk along Y.
    friction_work_Nmm
        Energy dissipated by friction so far.
    area_mm2
        Touching area, undeformed.
    first_mm3, second_mm4
        First and second moments of that area, (X, Z), with deformed positions.
    """

    cylinder: Cylinder
    force_y_N: float
    friction_work_Nmm: float
    area_mm2: float
    first_mm3: tuple[float, float]
    second_mm4: tuple[float, float]


class Contact:
    """Contact terms of the weak form, and results of contact after a step.

    All obstacles share one integral: axis, radius and motion are cell-wise data, as are the
    stabilisation and its lower bound.

    Parameters
    ----------
    solid
        The deforming solid.
    obstacles
        Obstacles that it may touch, each with facets of its own.
    friction
        Constants of Coulomb friction.
    method
        Nitsche's parameters.
    cell_thickness_mm
        Thickness t_c of the surface cells along the normal.

    Attributes
    ----------
    gap
        Distance g from the obstacle, mm; in UFL, like the following three.
    pressure, friction, traction
        Stress that the obstacle exerts per undeformed area, MPa: normal p, tangential t_f and total
        p n + t_f; the latter two of shape (3,).
    ds
        Measure on the facets of all obstacles.
    """

    def __init__(
        self,
        solid: Solid,
        obstacles: tuple[Obstacle, ...],
        friction: Friction,
        method: ContactMethod,
        cell_thickness_mm: float,
    ) -> None:
        self.solid = solid
        self.obstacles = obstacles
        self._friction = friction
        self._method = method
        mesh = solid.mesh
        self._plane = fem.functionspace(mesh, ("DG", 0, (2,)))  # (Y, Z), across the cylinders
        self._axis = fem.Function(self._plane)
        self._motion = fem.Function(self._plane)
        self._radius = fem.Function(solid.cellwise)
        self._curved = fem.Function(solid.cellwise)  # 0 for plates, 1 for cylinders
        self.gamma = fem.Function(solid.cellwise, name="stabilisation")
        self._previous = fem.Function(solid.space)
        self._reach = fem.Constant(mesh, GAP_LIMIT * cell_thickness_mm)
        self._descent_mm = 0.0  # of the moving obstacles, up to the last converged step
        self._further_mm = 0.0  # since then
        self._mark_cells()
        self._state()
        # the inverse inequality behind Nitsche's method scales with m^2 / t_c
        self._gamma_scale = method.stabilisation * solid.order**2 / cell_thickness_mm
        self._stiffness = self._normal_stiffness()
        self._floor = self._evaluate_stiffness()
        self.gamma.x.array[:] = 1.0
        self.update_stabilisation()
        self._sums = self._compile_sums()

    def _mark_cells(self) -> None:
        mesh = self.solid.mesh
        dim = mesh.topology.dim
        mesh.topology.create_connectivity(dim - 1, dim)
        cell_of = mesh.topology.connectivity(dim - 1, dim)
        self._cells = [
            np.unique(np.array([cell_of.links(f)[0] for f in o.facets], dtype=np.int32))
            for o in self.obstacles
        ]
        self._radius.x.array[:] = 1.0
        axis = self._axis.x.array.reshape(-1, 2)
        for obstacle, cells in zip(self.obstacles, self._cells, strict=True):
            axis[cells] = (obstacle.y_mm, obstacle.cylinder.z_mm)
            self._radius.x.array[cells] = obstacle.radius_mm
            self._curved.x.array[cells] = 0.0 if obstacle.cylinder.flat else 1.0
        self._facets = facets = np.unique(np.concatenate([o.facets for o in self.obstacles]))
        tags = dmesh.meshtags(mesh, dim - 1, facets, np.ones(len(facets), dtype=np.int32))
        degree = SURFACE_QUADRATURE_DEGREE[self.solid.order]
        self.ds = ufl.Measure(
            "ds", mesh, subdomain_data=tags, metadata={"quadrature_degree": degree}
        )(1)
        self._all_cells = np.unique(np.concatenate(self._cells))

    def _state(self) -> None:
        """Express pressure, slip and traction in UFL."""
        u = self.solid.displacement
        mesh = self.solid.mesh
        x = ufl.SpatialCoordinate(mesh) + u
        along_z = self._curved * (x[2] - self._axis[1])
        across = ufl.as_vector((0, x[1] - self._axis[0], along_z))
        distance = ufl.sqrt(ufl.dot(across, across))
        self._normal = n = across / distance
        self.gap = gap = distance - self._radius
        t = self.solid.stress(u) * ufl.FacetNormal(mesh)
        self._normal_traction = ufl.dot(n, t)
        trial = self._normal_traction - self.gamma * gap
        near = ufl.lt(gap, self._reach)
        self.pressure = ufl.conditional(ufl.And(ufl.ge(trial, 0), near), trial, 0)

        def along(vector: Expr) -> Expr:
            return vector - ufl.dot(vector, n) * n

        moved = u - self._previous - ufl.as_vector((0, self._motion[0], self._motion[1]))
        self._slip = along(moved)
        law = FrictionLaw(mesh, self._friction, self._method.presliding_mm)
        degree = SURFACE_QUADRATURE_DEGREE[self.solid.order]
        self._memory = FacetMemory(mesh, self.ds, degree, 6)
        *b, slid, largest, work = self._memory.function
        before = Grip(along(ufl.as_vector(b)), slid)
        self._grip = law.slip(before, self._slip)
        mobilised = self._grip.mobilised
        largest_now = law.coefficient(self._grip) * self.pressure
        self.friction = -largest_now * mobilised
        self.traction = self.pressure * n + self.friction
        # mu_f p by the trapezoidal rule
        mean = (largest + largest_now) / 2
        self._work = work + mean * law.opposed_slip(before, self._slip)
        touching, _ = self.states()
        grip = (*mobilised, self._grip.slid_mm, largest_now)
        self._present = self._memory.compile(
            ufl.as_vector((*(touching * number for number in grip), self._work))
        )

    def states(self) -> tuple[Expr, Expr]:
        """Return UFL indicators, 0 or 1, of contact, and of slip while in contact."""
        b = self._grip.mobilised
        touching = ufl.conditional(ufl.gt(self.pressure, 0), 1.0, 0.0)
        slipping = ufl.conditional(ufl.gt(ufl.dot(b, b), SLIPS**2), touching, 0.0)
        return touching, slipping

    def term(self) -> Term:
        """Return the contribution of contact to the equations."""
        u = self.solid.displacement
        if not self._method.theta:  # else there are derivatives of the test function too
            try:
                return KernelTerm(
                    FacetKernel(
                        self.traction,
                        self.gap - self._reach,
                        u,
                        self.solid.duration,
                        within_cells(self.solid.mesh, self._facets),
                        SURFACE_QUADRATURE_DEGREE[self.solid.order],
                    )
                )
            except UnknownOperation as error:
                log.info(
                    "contact is compiled by the form compiler, whose code is slower: %s", error
                )
        return FormTerm(self.residual(ufl.TestFunction(self.solid.space)), u)

    def residual(self, v: Expr) -> Expr:
        """Return the contribution of contact to the residual, a UFL form linear in `v`."""
        form = -ufl.dot(self.traction, v) * self.ds
        if self._method.theta:
            stress = self.solid.stress(self._previous)
            change = ufl.derivative(stress, self._previous, v) * ufl.FacetNormal(self.solid.mesh)
            misfit = (self._normal_traction - self.pressure) / self.gamma
            theta = fem.Constant(
                self.solid.mesh, float(self._method.theta)
            )  # one form for 1 and -1
            form -= theta * misfit * ufl.dot(self._normal, change) * self.ds
        return form

    def _normal_stiffness(self) -> fem.Expression:
        """Return the second derivative ``d2W/da2`` above at the centre of every cell."""
        mesh = self.solid.mesh
        X = ufl.SpatialCoordinate(mesh)
        N = ufl.as_vector((X[0], X[1], 0)) / ufl.sqrt(X[0] ** 2 + X[1] ** 2)
        F = self.solid.gradient(self.solid.displacement)
        n = ufl.inv(F).T * N
        n = n / ufl.sqrt(ufl.dot(n, n))
        amount = ufl.variable(fem.Constant(mesh, 0.0))
        # at fixed internal variables: the stiffness of unloading, which is the largest
        state = self.solid.state(F)
        energy = self.solid.energy_density(F + amount * ufl.outer(n, N), state)
        second = ufl.diff(ufl.diff(energy, amount), amount)
        points = np.full((1, mesh.topology.dim), 0.5)
        return compile_expression(second, points)

    def _evaluate_stiffness(self) -> NDArray[np.float64]:
        values = self._stiffness.eval(self.solid.mesh, self._all_cells)
        return np.asarray(values, dtype=np.float64).reshape(-1)

    def update_stabilisation(self) -> None:
        """Update gamma to the current normal stiffness, but not below the one at rest."""
        stiffness = np.maximum(self._evaluate_stiffness(), self._floor)
        self.gamma.x.array[self._all_cells] = self._gamma_scale * stiffness
        self.gamma.x.scatter_forward()

    def place(self, dy: float) -> None:
        """Set the position of the moving obstacles for the next step.

        Parameters
        ----------
        dy
            Displacement along Y from the last converged position, mm.
        """
        self._further_mm = -dy
        axis = self._axis.x.array.reshape(-1, 2)
        motion = self._motion.x.array.reshape(-1, 2)
        for obstacle, cells in zip(self.obstacles, self._cells, strict=True):
            if obstacle.cylinder.moves:
                axis[cells, 0] += dy - motion[cells, 0]
                motion[cells, 0] = dy

    def advance(self) -> None:
        """Make the current state the last converged one."""
        self._memory.remember(self._present)
        self._previous.x.array[:] = self.solid.displacement.x.array
        self._motion.x.array[:] = 0.0
        self._descent_mm, self._further_mm = self._descent_mm + self._further_mm, 0.0

    def begin(self, rises_mm: Sequence[float]) -> None:
        """Count slip from the current displacement, and let each obstacle start higher by its rise.

        To be called before anything has touched.
        """
        self._previous.x.array[:] = self.solid.displacement.x.array
        axis = self._axis.x.array.reshape(-1, 2)
        for cells, rise in zip(self._cells, rises_mm, strict=True):
            axis[cells, 0] += rise
        self.obstacles = tuple(
            replace(obstacle, front_mm=obstacle.front_mm + rise)
            for obstacle, rise in zip(self.obstacles, rises_mm, strict=True)
        )
        self.update_stabilisation()

    def front(self, obstacle: Obstacle) -> float:
        """Return the current Y of an obstacle's front, mm."""
        descent = self._descent_mm + self._further_mm
        return obstacle.front_mm - (descent if obstacle.cylinder.moves else 0.0)

    def nodes(self) -> list[NDArray[np.int32]]:
        """Return for each obstacle the local nodes of its cells, on which its forces act."""
        nodes_of = self.solid.space.dofmap.list
        return [np.unique(nodes_of[cells]) for cells in self._cells]

    @property
    def slip(self) -> Expr:
        """Tangential motion over the obstacle in this step, mm, UFL shape (3,)."""
        return self._slip

    def _compile_sums(self) -> fem.Form:
        w = ufl.TestFunction(fem.functionspace(self.solid.mesh, ("DG", 0, (7,))))
        touching, _ = self.states()
        x = ufl.SpatialCoordinate(self.solid.mesh) + self.solid.displacement
        moments = (1.0, x[0], x[2], x[0] ** 2, x[2] ** 2)
        values = (self.traction[1], self._work, *(touching * moment for moment in moments))
        return compile_form(ufl.dot(ufl.as_vector(values), w) * self.ds)

    def sums(self) -> tuple[ContactSums, ...]:
        """Return the sums over the contact of each obstacle; collective."""
        values = fem.assemble_vector(self._sums).array.reshape(-1, 7)
        sums = []
        for obstacle, cells in zip(self.obstacles, self._cells, strict=True):
            local = values[cells].sum(axis=0)
            force, work, area, x, z, xx, zz = self.solid.mesh.comm.allreduce(local, op=MPI.SUM)
            sums.append(ContactSums(obstacle.cylinder, force, work, area, (x, z), (xx, zz)))
        return tuple(sums)

"""Results read off a converged step: forces, contact, section, energies."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass

import numpy as np
from dolfinx import fem
from mpi4py import MPI
from numpy.typing import NDArray

from ramiefenics.model.bending import BendingProblem
from ramiefenics.model.contact import ContactSums, depth
from ramiefenics.model.ellipticity import MaterialPoints, PointState
from ramiefenics.model.shape import straightened
from ramiefenics.model.tube import SURFACES
from ramiefenics.specification import Cylinder

UNFELT_MM, SWALLOWED = 0.1, 0.5
"""Penetrations beyond which the mesh has missed a cylinder.

The first holds without any force, the second, over the cylinder's radius, with any force.
"""

NOTHING_N = 1e-3
"""Force that counts as none: Newton's method stops far below it, but not at zero."""


@dataclass(frozen=True)
class Observables:
    """Scalars of one converged step, for the whole stalk.

    Attributes
    ----------
    force_N
        Force exerted by all cylinders that move.
    support_force_N
        Force borne by all cylinders that do not move.
    indenter_contact_length_mm
        Extent along Z of the touching area on the first cylinder of the fixture that moves, four
        standard deviations, which for an ellipse is its axis.
    indenter_contact_width_mm
        Extent along X of the same area, measured in the same way.
    support_contact_length_mm
        Extent along Z of the touching area on the first cylinder that does not move, measured in
        the same way.
    support_contact_width_mm
        Extent along X of that area, measured in the same way.
    section_height_mm
        Extent along Y of the section under the first cylinder that moves, which is midspan if that
        cylinder is in the middle.
    section_width_mm
        Extent along X of that section.
    void_height_mm
        Remaining height of the pith void in that section; NaN for a solid core, or in a node.
    void_force_N
        Force along Y between the void's walls, wherever they touch.
    overhang_mm
        Least length along Z of the stalk beyond the middle of its contact with a fixed cylinder, on
        the cylinder's side of the stalk; NaN if a fixed cylinder has no contact.
    penetration_mm
        Largest distance along Y by which the front of a cylinder is beyond a vertex of the mesh.
    penetration_radii
        The same over the cylinder's radius; zero for plates.
    stored_energy_Nmm
        Stored energy.
    friction_work_Nmm
        Energy dissipated by friction so far.
    dissipated_Nmm
        Energy dissipated by the material and the bond so far.
    min_volume_ratio
        Lowest ratio J of a volume to that at rest, over all quadrature points.
    min_principal_stretch
        Lowest principal stretch over all quadrature points; negative where J is.
    min_acoustic_MPa
        Lowest eigenvalue of the acoustic tensor over all directions and quadrature points. Where it
        is negative, the material has lost strong ellipticity and the result depends on the mesh. It
        is NaN where it was not searched for, which is done at saved steps only.
    """

    force_N: float
    support_force_N: float
    indenter_contact_length_mm: float
    indenter_contact_width_mm: float
    support_contact_length_mm: float
    support_contact_width_mm: float
    section_height_mm: float
    section_width_mm: float
    void_height_mm: float
    void_force_N: float
    overhang_mm: float
    penetration_mm: float
    penetration_radii: float
    stored_energy_Nmm: float
    friction_work_Nmm: float
    dissipated_Nmm: float
    min_volume_ratio: float
    min_principal_stretch: float
    min_acoustic_MPa: float

    def physical_end(self) -> str | None:
        """Return why the model cannot describe what follows; None if it can."""
        if self.overhang_mm <= 0.0 or (self.force_N > NOTHING_N and math.isnan(self.overhang_mm)):
            return "the stalk has slipped off a support"
        return None

    def missed_contact(self) -> str:
        """Return a message that explains a missed contact."""
        how = "without force" if self.force_N <= 0.0 else "with too little force"
        return (
            f"a cylinder has penetrated the surface by {self.penetration_mm:.2g} mm {how} "
            "(too few quadrature points of the mesh are under it: reduce "
            "numerics.mesh.contact_size)"
        )

    @property
    def misses_contact(self) -> bool:
        """Whether a cylinder has penetrated the surface undetected; shorter steps may detect it."""
        unfelt = self.force_N <= 0.0 and self.penetration_mm > UNFELT_MM
        return unfelt or self.penetration_radii > SWALLOWED


class Observer:
    """Evaluates the observables of a `BendingProblem`; collective.

    Parameters
    ----------
    problem
        Problem to observe, after each converged step and before the contact advances.

    Attributes
    ----------
    material
        State of the quadrature points at the last observation.
    """

    def __init__(self, problem: BendingProblem) -> None:
        self.problem = problem
        self._points = MaterialPoints(problem.solid, problem.test.numerics.acoustic_check)
        self.material: PointState  # set by the first observation
        mesh = problem.tube.mesh
        self._vertices = fem.functionspace(mesh, ("Lagrange", 1))
        self._at = self._vertices.tabulate_dof_coordinates()
        self._straight = straightened(problem.test.stalk, self._at)
        self._moved = fem.Function(fem.functionspace(mesh, ("Lagrange", 1, (3,))))
        self._fixture = problem.test.fixture
        self._section = self._on_section("outer")
        self._bore = self._on_section("inner")
        dim = mesh.topology.dim
        self._facing = [
            (obstacle, fem.locate_dofs_topological(self._vertices, dim - 1, obstacle.facets))
            for obstacle in problem.contact.obstacles
        ]
        self._end = (0.5 - 1e-6) * problem.test.stalk.length_mm
        stalk, at_mm = problem.test.stalk, self._fixture.indenter.z_mm
        low, high = stalk.node_mm or (math.inf, math.inf)
        self._has_void = stalk.void_diameter_mm > 0.0 and not low <= at_mm <= high
        self._void_centre = stalk.void_centre_mm(at_mm)

    def _on_section(self, name: str) -> NDArray[np.int32]:
        """Return the vertices of a surface in the plane under the first cylinder that moves."""
        facets = self.problem.tube.facets.find(SURFACES[name])
        dim = self.problem.tube.mesh.topology.dim
        dofs = fem.locate_dofs_topological(self._vertices, dim - 1, facets)
        tolerance = 1e-6 * self.problem.test.stalk.length_mm
        return dofs[np.abs(self._straight[dofs, 2] - self._fixture.indenter.z_mm) < tolerance]

    def vertex_displacement(self) -> NDArray[np.float64]:
        """Return the displacement at the vertices, mm, shape (vertices, 3), ghosts included."""
        self._moved.interpolate(self.problem.solid.displacement)
        return self._moved.x.array.reshape(-1, 3)

    def observe(self) -> Observables:
        """Return the observables of the current state."""
        problem, comm = self.problem, self.problem.tube.mesh.comm
        sums = problem.contact.sums()
        position = self._at + self.vertex_displacement()
        pressed, borne = problem.forces(sums)
        indenter, support = (
            self._axes(next(s for s in sums if s.cylinder == cylinder))
            for cylinder in (self._fixture.indenter, self._fixture.support)
        )
        section = self._extent(position[self._section])
        self.material = self._points.evaluate()
        stored, lost = (
            float(comm.allreduce(energy, op=MPI.SUM) * problem.factor)
            for energy in problem.energies()
        )
        work = sum(s.friction_work_Nmm for s in sums) * problem.factor
        penetration, in_radii = self._penetration(position)
        return Observables(
            force_N=pressed,
            support_force_N=borne,
            indenter_contact_length_mm=indenter[1],
            indenter_contact_width_mm=indenter[0],
            support_contact_length_mm=support[1],
            support_contact_width_mm=support[0],
            section_height_mm=section[1],
            section_width_mm=section[0] * (1.0 if problem.test.numerics.domain == "full" else 2.0),
            void_height_mm=self._void_height(position) if self._has_void else float("nan"),
            void_force_N=problem.factor * problem.walls.force_y_N() if problem.walls else 0.0,
            overhang_mm=self._overhang(position, sums),
            penetration_mm=penetration,
            penetration_radii=in_radii,
            stored_energy_Nmm=stored,
            friction_work_Nmm=float(work),
            dissipated_Nmm=lost,
            min_volume_ratio=self._least(self.material.volume_ratio),
            min_principal_stretch=self._least(self.material.principal_stretch),
            min_acoustic_MPa=self._least(self.material.acoustic_MPa),
        )

    def search(self, observables: Observables) -> Observables:
        """Add the least acoustic eigenvalue to the observables of the current state."""
        self.material = self._points.evaluate(search=True)
        least = self._least(self.material.acoustic_MPa)
        return dataclasses.replace(observables, min_acoustic_MPa=least)

    def _least(self, values: NDArray[np.float64]) -> float:
        comm = self.problem.tube.mesh.comm
        return float(comm.allreduce(values.min(initial=np.inf), op=MPI.MIN))

    def _extent(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the size of the bounding box of the points of all ranks, shape (3,)."""
        comm = self.problem.tube.mesh.comm
        low = points.min(axis=0) if len(points) else np.full(3, np.inf)
        high = points.max(axis=0) if len(points) else np.full(3, -np.inf)
        comm.Allreduce(MPI.IN_PLACE, low, op=MPI.MIN)
        comm.Allreduce(MPI.IN_PLACE, high, op=MPI.MAX)
        return high - low

    def _void_height(self, position: NDArray[np.float64]) -> float:
        """Return the distance from the highest floor point to the lowest roof point of the void."""
        comm = self.problem.tube.mesh.comm
        _, centre = self._void_centre
        roof = self._bore[(self._straight[self._bore, 1] > centre) & self._in_middle()]
        floor = self._bore[(self._straight[self._bore, 1] < centre) & self._in_middle()]
        top = comm.allreduce(position[roof, 1].min(initial=np.inf), op=MPI.MIN)
        bottom = comm.allreduce(position[floor, 1].max(initial=-np.inf), op=MPI.MAX)
        return float(top - bottom)

    def _overhang(self, position: NDArray[np.float64], sums: tuple[ContactSums, ...]) -> float:
        """Return the least distance along Z from a fixed cylinder's contact to the stalk's end."""
        left = []
        for contact in sums:
            cylinder = contact.cylinder
            if cylinder.moves:
                continue
            if contact.area_mm2 == 0.0:
                return float("nan")
            outward = math.copysign(1.0, cylinder.z_mm)
            facing = cylinder.up * self._straight[:, 1] > 0.0
            end = position[(outward * self._straight[:, 2] > self._end) & facing, 2]
            middle = 0.0 if self._cut(cylinder)[1] else contact.first_mm3[1] / contact.area_mm2
            left.append((outward * (end - middle)).min(initial=np.inf))
        return float(self.problem.tube.mesh.comm.allreduce(min(left), op=MPI.MIN))

    def _penetration(self, position: NDArray[np.float64]) -> tuple[float, float]:
        """Return the largest depth of a cylinder's front beyond the vertices, mm and radii."""
        deepest = np.zeros(2)
        for obstacle, vertices in self._facing:
            cylinder, front = obstacle.cylinder, self.problem.contact.front(obstacle)
            largest = max(depth(cylinder, front, position[vertices]), 0.0)
            deepest[:] = np.maximum(deepest, (largest, largest / cylinder.radius_mm))
        self.problem.tube.mesh.comm.Allreduce(MPI.IN_PLACE, deepest, op=MPI.MAX)
        return float(deepest[0]), float(deepest[1])

    def _in_middle(self) -> NDArray[np.bool_]:
        """Mark the bore's vertices near its middle, where roof and floor would meet first."""
        x = np.abs(self._at[self._bore, 0] - self._void_centre[0])
        return x < 0.3 * self.problem.test.stalk.void_diameter_mm / 2.0

    def _cut(self, cylinder: Cylinder) -> tuple[bool, bool]:
        """Return whether the planes X = 0 and Z = 0 of symmetry cut a cylinder's contact."""
        domain = self.problem.test.numerics.domain
        return domain != "full", domain == "quarter" and cylinder.z_mm == 0.0

    def _axes(self, contact: ContactSums) -> tuple[float, float]:
        """Return the axes along X and Z of the ellipse with the touching area's second moments.

        Where a symmetry plane cuts the area, the centroid is on that plane.
        """
        area = contact.area_mm2
        if area == 0.0:
            return 0.0, 0.0
        cut = self._cut(contact.cylinder)
        variances = (
            second / area - (0.0 if on_plane else first / area) ** 2
            for first, second, on_plane in zip(
                contact.first_mm3, contact.second_mm4, cut, strict=True
            )
        )
        x, z = (4.0 * math.sqrt(max(variance, 0.0)) for variance in variances)
        return x, z

"""The boundary value problem of a bending test: mesh, solid, contact, forms."""

from __future__ import annotations

import numpy as np
import ufl
from dolfinx import fem
from dolfinx import mesh as dmesh
from mpi4py import MPI

from ramiefenics.model.bond import PENETRATION, BondFilm
from ramiefenics.model.contact import Contact, ContactSums, Obstacle, depth
from ramiefenics.model.equations import Equations, Term
from ramiefenics.model.jit import compile_form
from ramiefenics.model.laws import check_law
from ramiefenics.model.shape import straightened
from ramiefenics.model.solid import Solid
from ramiefenics.model.tissue import tissue_fields
from ramiefenics.model.tube import FILM_TAG, SURFACES, TubeMesh, build_tube
from ramiefenics.model.void_contact import void_contact
from ramiefenics.specification import BendingTest, Cylinder

SYMMETRY_FACTOR = {"quarter": 4.0, "half": 2.0, "full": 1.0}
"""Factor from the modelled part to the whole stalk, by domain."""


LONG_S = 1e9
"""Time at rest before a test, after which all relaxation is complete."""


class BendingProblem:
    """A test's equations, ready to be solved at any position of the indenter.

    Parameters
    ----------
    test
        Specification of the test.
    comm
        MPI communicator; construction is collective.
    tube
        Mesh to use in place of the recipe's.

    Attributes
    ----------
    tube, solid, contact
        Mesh, solid, and contact with the fixture.
    film
        Bond of the outermost layer; None if it is perfect.
    walls
        Contact between the void's walls; None without a void.
    terms
        Contributions to the equations: those of the solid, of contact, and of film and walls unless
        these are None.
    equations
        Sum of the terms.
    mass
        Compiled form of the consistent mass, bilinear, tonne.
    bcs
        Symmetry conditions; nothing else holds the stalk.
    factor
        Factor from the modelled part to the whole stalk.
    """

    def __init__(self, test: BendingTest, comm: MPI.Comm, tube: TubeMesh | None = None) -> None:
        check_law(test)
        self.test = test
        self.factor = SYMMETRY_FACTOR[test.numerics.domain]
        self.tube = build_tube(test, comm) if tube is None else tube
        stalk = test.stalk
        recipe = test.numerics.mesh
        self.solid = Solid(
            self.tube.mesh,
            self.tube.cells,
            stalk.materials,
            test.law,
            recipe.serendipity,
            tissue_fields(stalk, self.tube),
        )
        radii = test.stalk.radii_mm
        elements = recipe.rind_elements + (recipe.wall_elements if len(radii) == 2 else 0)
        self.film = None if stalk.bond.perfect else self._bond_film(radii[-1] - radii[-2])
        self.contact = Contact(
            self.solid,
            self._obstacles(),
            test.fixture.friction,
            test.numerics.contact,
            (radii[-1] - radii[-2]) / elements * 2.0 * stalk.top_mm / stalk.outer_diameter_mm,
        )
        self.bcs = [
            self.solid.symmetry(self.tube.facets.find(SURFACES[name]), axis)
            for name, axis in (("symmetry_x", 0), ("symmetry_z", 2))
            if comm.allreduce(len(self.tube.facets.find(SURFACES[name])))
        ]
        u = self.solid.displacement
        self.walls = void_contact(
            u,
            self.tube.facets.find(SURFACES["inner"]),
            stalk.void_diameter_mm,
            test.numerics.contact.stabilisation
            * self.solid.order**2
            * stalk.materials[0].elastic.E_X_MPa,
        )
        self._rest = np.zeros_like(u.x.array)
        v, du = ufl.TestFunction(self.solid.space), ufl.TrialFunction(self.solid.space)
        self.terms: tuple[Term, ...] = (
            self.solid.term(),
            self.contact.term(),
            *([] if self.film is None else [self.film.term()]),
            *([] if self.walls is None else [self.walls]),
        )
        has_potential = self.film is None and self.solid.law.memory is None
        frictionless = test.fixture.friction.static == 0.0
        self.equations = Equations(u, self.terms, self.bcs, has_potential and frictionless)
        self.mass = compile_form(self.solid.density * ufl.inner(du, v) * self.solid.dx)

    @property
    def unknowns(self) -> int:
        """Global number of degrees of freedom."""
        dofmap = self.solid.space.dofmap
        return int(dofmap.index_map.size_global * dofmap.index_map_bs)

    @property
    def displacement(self) -> fem.Function:
        """The unknown."""
        return self.solid.displacement

    def stored_energy(self) -> float:
        """Return the energy stored on this rank, N mm."""
        return self.energies()[0]

    def energies(self) -> tuple[float, float]:
        """Return the energies stored, and dissipated so far, on this rank, N mm."""
        stored, dissipated = self.solid.energies()
        if self.walls is not None:
            stored += self.walls.energy()
        if self.film is None:
            return stored, dissipated
        in_bond, by_bond = self.film.energies()
        return stored + in_bond, dissipated + by_bond

    def first_guess(self, travel: float) -> None:
        """Set the displacement of a stalk pushed rigidly halfway, which touches all obstacles."""
        self.solid.displacement.interpolate(lambda x: np.outer((0, -travel / 2.0, 0), x[0] ** 0))
        self.solid.displacement.x.array[:] += self._rest

    def take_over(self, before: BendingProblem) -> None:
        """Begin in the state in which another test has left the same stalk.

        The stalk may have been turned about its axis since.

        Parameters
        ----------
        before
            Problem of the other test at its end, unloaded and on a mesh of the same cells.
        """
        angle = np.radians(self.test.stalk.rotation_deg - before.test.stalk.rotation_deg)
        turn = np.eye(3)
        turn[:2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
        self.solid.take_over(before.solid, turn)
        if self.film is not None and before.film is not None:
            self.film.take_over(before.film)
        self._touch()

    def begin_at_rest(self) -> None:
        """Take the current displacement as that at rest, where every cylinder just touches."""
        self._touch()
        self.solid.duration.value = LONG_S
        self.solid.remember()

    def _touch(self) -> None:
        """Begin at the current displacement, with every cylinder moved to where it just touches."""
        mesh, moved = self.tube.mesh, fem.functionspace(self.tube.mesh, ("Lagrange", 1, (3,)))
        displacement = fem.Function(moved)
        displacement.interpolate(self.solid.displacement)
        at = moved.tabulate_dof_coordinates()
        now = at + displacement.x.array.reshape(-1, 3)
        rises = []
        for obstacle in self.contact.obstacles:
            nodes = fem.locate_dofs_topological(moved, mesh.topology.dim - 1, obstacle.facets)
            depths = [depth(obstacle.cylinder, obstacle.front_mm, x[nodes]) for x in (at, now)]
            before, after = (mesh.comm.allreduce(value, op=MPI.MAX) for value in depths)
            rises.append(obstacle.cylinder.up * (after - before))
        self.contact.begin(rises)
        self._pair_walls()
        self._rest[:] = self.solid.displacement.x.array

    def place(self, travel: float, duration_s: float) -> None:
        """Move the indenters down from their last accepted position; may be called repeatedly."""
        self.solid.duration.value = duration_s
        self.contact.place(-travel)

    def remember(self) -> None:
        """Update slip and internal variables to the current state."""
        self.contact.advance()
        self.solid.remember()
        if self.film is not None:
            self.film.remember()
        self._pair_walls()

    def accept(self) -> None:
        """Make the current state the last accepted one, from which a step starts."""
        self.remember()
        self.contact.update_stabilisation()

    def _pair_walls(self) -> None:
        if self.walls is not None and self.walls.refresh():
            self.equations.couple(self.walls.couplings)

    def forces(self, sums: tuple[ContactSums, ...]) -> tuple[float, float]:
        """Return the forces that moving obstacles exert and fixed ones bear, N, whole stalk."""
        pressed = 0.0 - sum(s.force_y_N for s in sums if s.cylinder.moves)  # no negative zero
        borne = sum(s.force_y_N for s in sums if not s.cylinder.moves)
        return pressed * self.factor, borne * self.factor

    def _bond_film(self, thickness_mm: float) -> BondFilm:
        """Return the bond of an outermost layer of a given thickness."""
        stalk = self.test.stalk
        young = stalk.materials[len(stalk.layers) - 1].elastic.E_X_MPa
        penalty = young / (PENETRATION * thickness_mm) ** 2
        return BondFilm(self.solid, self.tube.cells, FILM_TAG, stalk.bond, penalty)

    def _obstacles(self) -> tuple[Obstacle, ...]:
        """Return the fixture's cylinders, each with the part of the surface that it can reach."""
        mesh = self.tube.mesh
        outer = self.tube.facets.find(SURFACES["outer"])
        middle = dmesh.compute_midpoints(mesh, mesh.topology.dim - 1, outer)
        middle = straightened(self.test.stalk, middle)
        cylinders = self.test.fixture.cylinders
        quarter = self.test.numerics.domain == "quarter"
        obstacles = []
        for cylinder in cylinders:
            if not (quarter and cylinder.z_mm < 0.0):
                low, high = _reach(cylinder, cylinders)
                facing = (cylinder.up * middle[:, 1] > 0) & (low < middle[:, 2])
                facets = outer[facing & (middle[:, 2] < high)]
                # a tapered stalk lies tilted on its supports; here the supports are moved instead
                obstacles.append(Obstacle(cylinder, self.test.front_mm(cylinder), facets))
        return tuple(obstacles)


def _reach(cylinder: Cylinder, cylinders: tuple[Cylinder, ...]) -> tuple[float, float]:
    """Return the range of Z that a cylinder may touch, which ends halfway to the next one.

    A plate may touch everything on its side.
    """
    low, high = -np.inf, np.inf
    for other in cylinders:
        if not (cylinder.flat or other.flat or other.z_mm == cylinder.z_mm):
            distance = other.z_mm - cylinder.z_mm
            # a cell exactly halfway between two cylinders touches neither, or rounding would decide
            edge = cylinder.z_mm + distance * (0.5 - 2e-6)
            low, high = (low, min(high, edge)) if distance > 0 else (max(low, edge), high)
    return low, high

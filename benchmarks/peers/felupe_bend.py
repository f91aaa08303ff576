"""Bend a layered quarter tube between two rigid cylinders with FElupe.

Usage: python felupe_bend.py MESH.msh [--friction MU] [--out forces.csv]

Hex8 elements with full integration, compressible neo-Hookean layers, node-to-surface penalty
contact (a pressure of 200 N/mm3 times the penetration, so each node has 200 times its area),
14 steps of 1 mm, each started from the linear extrapolation of the two before it. Forces are
for the whole tube (4 times the quarter). Needs felupe (11.3 or newer) and pypardiso.
"""

import argparse
import csv
from collections.abc import Callable
from pathlib import Path
from typing import Any

import felupe as fem
import numpy as np
from pypardiso import PyPardisoSolver
from scipy.sparse import csr_matrix, triu

YOUNG = {1: 30.0, 2: 120.0}  # MPa, of the volume tags xylem and phloem
SURFACES = (11, 13, 14)  # tags of the outer surface and of the symmetry planes across X and Z
CYLINDER_RADIUS = 5.0  # mm
TUBE_RADIUS = 7.115  # mm
SUPPORT_Z = 50.0  # mm
CONTACT_REACH = 15.0  # mm along z from a cylinder's axis within which the tube may touch it
PENALTY = 200.0  # N/mm3
ELASTIC_SLIP = 0.01  # mm, of sticking nodes under friction
END = 14.0  # mm
SETTLE = 1e-3  # mm, initial penetration of the support: without it nothing would hold the tube
TOLERANCE = 1e-6  # of the residual, relative to the reaction forces


def read_mesh(path: Path) -> tuple[np.ndarray, dict[int, np.ndarray], dict[int, np.ndarray]]:
    """Return the points, and the cells by volume tag and by surface tag, of a Gmsh 2.2 file."""
    lines = path.read_text().splitlines()
    start = lines.index("$Nodes") + 2
    points = np.array([line.split()[1:] for line in lines[start : start + int(lines[start - 1])]])
    volumes: dict[int, list] = {}
    surfaces: dict[int, list] = {}
    start = lines.index("$Elements") + 2
    for line in lines[start : start + int(lines[start - 1])]:
        _, kind, tags, tag, *rest = map(int, line.split())
        (volumes if kind == 5 else surfaces).setdefault(tag, []).append(rest[tags - 1 :])
    return (
        points.astype(float),
        {tag: np.array(cells) - 1 for tag, cells in volumes.items()},
        {tag: np.array(cells) - 1 for tag, cells in surfaces.items()},
    )


def nodal_areas(points: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Return the area that belongs to each point: a quarter of each quadrilateral around it."""
    corner = points[faces]
    cross = np.cross(corner[:, 2] - corner[:, 0], corner[:, 3] - corner[:, 1])
    areas = np.linalg.norm(cross, axis=1) / 2
    return np.bincount(faces.ravel(), np.repeat(areas / 4, 4), minlength=len(points))


def cylinder_contacts(
    field: fem.FieldContainer, center: int, areas: np.ndarray, friction: float
) -> list[fem.ContactRigidCylinder]:
    """Return a cylinder's contacts, one per size of nodal area (inside, on edges, at corners)."""
    points = field.region.mesh.points
    side = points[:, 1] * np.sign(points[center, 1]) > 0
    near = np.abs(points[:, 2] - points[center, 2]) < CONTACT_REACH
    nodes = np.flatnonzero((areas > 0) & side & near)
    size = np.round(np.log2(areas[nodes]))
    return [
        fem.ContactRigidCylinder(
            field,
            points=nodes[size == one],
            centerpoint=center,
            radius=CYLINDER_RADIUS,
            axis=[1, 0, 0],
            friction=friction,
            multiplier=PENALTY * areas[nodes[size == one]].mean(),
            elastic_slip=ELASTIC_SLIP,
        )
        for one in np.unique(size)
    ]


def displacement(points: np.ndarray, cells: np.ndarray) -> fem.FieldContainer:
    """Return a displacement field on some cells, with values at all points."""
    mesh = fem.Mesh(points, cells, "hexahedron")
    return fem.FieldContainer([fem.Field(fem.RegionHexahedron(mesh), dim=3)])


class Pardiso(PyPardisoSolver):
    """Solver that takes half of a symmetric matrix and analyses a sparsity pattern only once."""

    def __init__(self, symmetric: bool) -> None:
        super().__init__(mtype=-2 if symmetric else 11)
        self.symmetric = symmetric
        self.pattern = (np.empty(0), np.empty(0))

    def __call__(self, matrix: csr_matrix, right: np.ndarray) -> np.ndarray:
        """Return the solution of the linear system."""
        matrix = triu(matrix, format="csr") if self.symmetric else matrix
        self._check_A(matrix)
        pattern = (matrix.indptr, matrix.indices)
        known = all(map(np.array_equal, pattern, self.pattern))
        self.pattern = pattern
        self.set_phase(23 if known else 13)  # 1 analyse, 2 factorise, 3 solve
        return self._call_pardiso(matrix, self._check_b(matrix, right))


def neo_hooke(tag: int) -> fem.NeoHooke:
    """Return the material of a volume tag."""
    return fem.NeoHooke(mu=YOUNG[tag] / 2.6, bulk=YOUNG[tag] / 1.2)


class Model:
    """The quarter tube, its two cylinders, and the displacement found so far."""

    def __init__(
        self,
        path: Path,
        friction: float,
        material: Callable[[int], Any] = neo_hooke,
        tags: tuple[int, int, int] = SURFACES,
    ) -> None:
        points, volumes, surfaces = read_mesh(path)
        outer, symmetry_x, symmetry_z = (surfaces[tag] for tag in tags)
        areas = np.append(nodal_areas(points, outer), [0.0, 0.0])
        self.indenter, support = len(points), len(points) + 1
        height = TUBE_RADIUS + CYLINDER_RADIUS
        centers = [[0.0, height, 0.0], [0.0, -height, SUPPORT_Z]]
        points = np.vstack([points, centers])
        self.field = displacement(points, np.concatenate(list(volumes.values())))
        self.items: list = [
            fem.SolidBody(material(tag), displacement(points, cells))
            for tag, cells in volumes.items()
        ]
        for center in (self.indenter, support):
            self.items += cylinder_contacts(self.field, center, areas, friction)
        self.held = np.concatenate(
            [
                3 * np.unique(symmetry_x),
                3 * np.unique(symmetry_z) + 2,
                3 * self.indenter + np.arange(6),
            ]
        )
        self.free = np.setdiff1d(np.arange(points.size), self.held)
        self.field[0].values[:-2, 1] = -SETTLE
        self.solver = Pardiso(symmetric=not friction)

    def push(self, depth: float, guess: np.ndarray) -> tuple[np.ndarray, float, int]:
        """Return displacement, indenter force of the whole tube, and iterations at a depth."""
        self.field[0].values[:] = guess
        self.field[0].values[self.indenter, 1] = -depth
        result = fem.newtonraphson(
            items=self.items,
            x0=self.field,
            dof1=self.free,
            dof0=self.held,
            ext0=self.field[0].values.ravel()[self.held],
            solver=self.solver,
            tol=TOLERANCE,
            maxiter=30,
            verbose=0,
        )
        self.field.link(result.x)
        force = -4 * result.fun.reshape(-1, 3)[self.indenter, 1]
        return result.x[0].values.copy(), force, result.iterations


def bend(model: Model, step: float = 1.0) -> list[tuple[float, float]]:
    """Return the depth of the indenter and its force after each step, mm and N."""
    before = now = model.field[0].values.copy()
    forces = []
    for number in range(1, round(END / step) + 1):
        depth = number * step
        guess = 2 * now - before if number > 2 else now
        before = now
        now, force, iterations = model.push(depth, guess)
        forces.append((depth, force))
        print(f"{depth:5.2f} mm  {force:9.4f} N  {iterations} iterations", flush=True)
    return forces


def write(forces: list[tuple[float, float]], path: Path) -> None:
    """Write depths and forces as CSV."""
    with path.open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(["displacement_mm", "force_N"])
        writer.writerows((f"{depth:g}", f"{force:.5f}") for depth, force in forces)


def main() -> None:
    """Run from the command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("mesh", type=Path)
    parser.add_argument("--friction", type=float, default=0.0, help="Coulomb coefficient")
    parser.add_argument("--out", type=Path, default=Path("forces.csv"))
    options = parser.parse_args()
    write(bend(Model(options.mesh, options.friction)), options.out)


if __name__ == "__main__":
    main()

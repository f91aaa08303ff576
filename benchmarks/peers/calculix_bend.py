"""Bend a layered quarter tube between two rigid cylinders with CalculiX.

Usage: python calculix_bend.py MESH.msh [--friction MU] [--closing PENALTY] [--out forces.csv]

C3D8 elements, compressible neo-Hookean layers, node-to-surface penalty contact of 200 N/mm3
with cylinders of flat facets whose nodes are all prescribed; steps of 1 mm. With --closing PENALTY
the inner nodes are moved so that the void is 11 mm wide, and the tube is pinched between two
opposite cylinders until the void closes and its roof touches its floor, with surface-to-surface
contact of that penalty. Weak springs to the ground keep the tube from drifting. Forces are for the
whole tube (4 times the quarter). Needs ccx (2.20 or newer) on the PATH and nothing beyond Python's
standard library.
"""

import argparse
import csv
import math
import re
import subprocess
import tempfile
from collections.abc import Iterable
from dataclasses import dataclass, replace
from pathlib import Path

YOUNG = {1: 30.0, 2: 120.0}  # MPa, of the volume tags xylem and phloem
OUTER, INNER, SYMMETRY_X, SYMMETRY_Z, END = 11, 12, 13, 14, 15  # surface tags
TUBE_RADIUS, XYLEM_RADIUS, VOID_RADIUS = 7.115, 6.42, 3.64  # mm
WIDE_RADIUS = 5.5  # mm, of the widened void that closes
CYLINDER_X = (-1.0, 9.0)  # mm, extent along the axis
CONTACT_REACH = 15.0  # mm along z from a cylinder's axis within which the tube may touch it
FACET = 0.218  # mm, length around a cylinder
FACETS_ANGLE = 60.0  # degrees, covered by facets on each side of the line of first contact
SIDES_HEIGHT = 2.0  # mm; faces of the void closer to y = 0 belong to neither roof nor floor
TENSION = 1e-6  # MPa, of nodes far apart: negligible
STICK_SLOPE = 20.0  # N/mm3, tangential stiffness of sticking under friction
SETTLE = 1e-3  # mm, initial penetration of both cylinders
GROUND = 1e-5  # N/mm, spring on each node of the two ends of the tube
# Corners of a hexahedron's faces as CalculiX numbers them, S1 to S6.
FACES = ((0, 1, 2, 3), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7))

Cells = dict[int, list[list[int]]]


def read_mesh(path: Path) -> tuple[list[list[float]], Cells, Cells]:
    """Return the points, and the cells by volume tag and by surface tag, of a Gmsh 2.2 file."""
    lines = path.read_text().splitlines()
    start = lines.index("$Nodes") + 2
    points = [
        [float(word) for word in line.split()[1:]]
        for line in lines[start : start + int(lines[start - 1])]
    ]
    volumes: Cells = {}
    surfaces: Cells = {}
    start = lines.index("$Elements") + 2
    for line in lines[start : start + int(lines[start - 1])]:
        _, kind, tags, tag, *rest = map(int, line.split())
        (volumes if kind == 5 else surfaces).setdefault(tag, []).append(rest[tags - 1 :])
    return points, volumes, surfaces


def widened(point: list[float]) -> list[float]:
    """Return where a node moves as the void is widened; the outside of the xylem stays."""
    x, y, z = point
    radius = math.hypot(x, y)
    share = max(XYLEM_RADIUS - radius, 0.0) / (XYLEM_RADIUS - VOID_RADIUS)  # 1 at the void
    factor = 1.0 + share * (WIDE_RADIUS - VOID_RADIUS) / radius
    return [factor * x, factor * y, z]


def keyword(name: str, rows: Iterable[Iterable[object]]) -> str:
    """Return a keyword line and its data lines."""
    return "\n".join([name, *(", ".join(map(str, row)) for row in rows)]) + "\n"


def cylinder(
    name: str, side: int, z: float, radius: float, node: int, element: int
) -> tuple[str, int, int]:
    """Return the input of a cylinder above (side 1) or below (-1) the tube, and the next ids."""
    center = side * (TUBE_RADIUS + radius - SETTLE)
    nodes: list[tuple[float, ...]] = []
    elements: list[tuple[int, ...]] = []
    facets = round(math.radians(FACETS_ANGLE) * radius / FACET)
    for i in range(-facets, facets + 1):
        angle = math.radians(i * FACETS_ANGLE / facets)
        for ring in (radius - 1.0, radius):
            y = center - side * ring * math.cos(angle)
            for x in CYLINDER_X:
                nodes.append((node + len(nodes), x, y, z + side * ring * math.sin(angle)))
    for i in range(2 * facets):
        a = node + 4 * i  # inner ring at both ends along x, then the outer ring, then the next i
        elements.append((element + i, a, a + 1, a + 5, a + 4, a + 2, a + 3, a + 7, a + 6))
    text = keyword(f"*NODE, NSET={name}", nodes)
    text += keyword(f"*ELEMENT, TYPE=C3D8, ELSET={name}", elements)
    text += keyword(f"*SURFACE, NAME={name}_FACE", [(name, "S2")])
    text += f"*SOLID SECTION, ELSET={name}, MATERIAL=CYLINDER\n"
    return text, node + len(nodes), element + len(elements)


@dataclass(frozen=True)
class Setting:
    """Settings that differ between the problems.

    Attributes
    ----------
    friction
        Coulomb's coefficient.
    radius, support_z
        Radius of the cylinders, and position of the lower one along the tube, mm.
    travel, every
        Travel of the upper cylinder, and interval of it after which forces are printed, mm.
    penalty
        Stiffness of contact, N/mm3.
    walls
        Whether the void is widened, and its roof may touch its floor.
    """

    friction: float = 0.0
    radius: float = 5.0
    support_z: float = 50.0
    travel: float = 14.0
    every: float = 1.0
    penalty: float = 200.0
    walls: bool = False


CLOSING = Setting(radius=15.0, support_z=0.0, travel=12.0, every=0.25, walls=True)

PATIENT = """*CONTROLS, PARAMETERS=TIME INCREMENTATION
8, 12, 9, 40, 20, 4, , 10
0.25, 0.5, 0.75, 0.85, , , 1.5
"""
"""Limits with more iterations than usual, which are needed where the walls come into contact."""


def tube(points: list[list[float]], volumes: Cells, surfaces: Cells, setting: Setting) -> str:
    """Return the input of the tube: nodes, layers, faces that may touch, symmetry planes."""
    text = keyword("*NODE, NSET=TUBE", ((i, *point) for i, point in enumerate(points, 1)))
    outer, inner = ({frozenset(face) for face in surfaces[tag]} for tag in (OUTER, INNER))
    touching: dict[str, list] = {"INDENTER": [], "SUPPORT": [], "ROOF": [], "FLOOR": []}
    element = 0
    for tag, cells in volumes.items():
        rows = []
        for cell in cells:
            element += 1
            rows.append((element, *cell))
            center = [sum(points[n - 1][k] for n in cell) / 8 for k in range(3)]
            name, z = ("SUPPORT", setting.support_z) if center[1] < 0 else ("INDENTER", 0.0)
            for face, corners in enumerate(FACES, 1):
                nodes = frozenset(cell[c] for c in corners)
                if nodes in outer and abs(center[2] - z) < CONTACT_REACH:
                    touching[name].append((element, f"S{face}"))
                if nodes in inner and abs(center[1]) > SIDES_HEIGHT:
                    wall = "ROOF" if center[1] > 0 else "FLOOR"
                    touching[wall].append((element, f"S{face}"))
        text += keyword(f"*ELEMENT, TYPE=C3D8, ELSET=LAYER{tag}", rows)
        text += f"*SOLID SECTION, ELSET=LAYER{tag}, MATERIAL=LAYER{tag}\n"
        law = (YOUNG[tag] / 2.6 / 2, 2 / (YOUNG[tag] / 1.2))
        text += keyword(f"*MATERIAL, NAME=LAYER{tag}\n*HYPERELASTIC, NEO HOOKE", [law])
    for name, faces in touching.items():
        text += keyword(f"*SURFACE, NAME={name}_OF_TUBE", faces)
    for name, tag in (("SYMMETRY_X", SYMMETRY_X), ("SYMMETRY_Z", SYMMETRY_Z)):
        text += keyword(f"*NSET, NSET={name}", ((n,) for n in nodes_of(surfaces[tag])))
    return text


def nodes_of(faces: list[list[int]]) -> list[int]:
    """Return the nodes of some faces, each once."""
    return sorted({node for face in faces for node in face})


def contact(setting: Setting) -> str:
    """Return the input of the contact with both cylinders, and of that between the void's walls."""
    kind = "SURFACE" if setting.walls else "NODE"
    text = "*MATERIAL, NAME=CYLINDER\n*ELASTIC\n1000., 0.3\n"
    text += "*SURFACE INTERACTION, NAME=TOUCH\n"
    law = f"*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR\n{setting.penalty}, {TENSION:f}\n"
    text += law
    if setting.friction:
        text += f"*FRICTION\n{setting.friction}, {STICK_SLOPE}\n"
    for name in ("INDENTER", "SUPPORT"):
        text += f"*CONTACT PAIR, INTERACTION=TOUCH, TYPE={kind} TO SURFACE\n"
        text += f"{name}_OF_TUBE, {name}_FACE\n"
    if setting.walls:
        text += "*SURFACE INTERACTION, NAME=WALLS\n" + law
        text += f"*CONTACT PAIR, INTERACTION=WALLS, TYPE={kind} TO SURFACE\n"
        text += "ROOF_OF_TUBE, FLOOR_OF_TUBE\n"
    return text


def loading(setting: Setting) -> str:
    """Return the input of the fixed nodes and the only step, which stops to print forces."""
    travel, every = setting.travel, setting.every
    return f"""*BOUNDARY
SYMMETRY_X, 1
SYMMETRY_Z, 3
SUPPORT, 1, 3
*AMPLITUDE, NAME=PUSH
0., 0., {travel}, -{travel}
*TIME POINTS, NAME=WHOLE, GENERATE
{every}, {travel}, {every}
*STEP, NLGEOM, INC=1000
*STATIC
{every}, {travel}, {1e-7 if setting.walls else 1e-4}, {every}
{PATIENT if setting.walls else ""}*BOUNDARY
INDENTER, 1
INDENTER, 3
*BOUNDARY, AMPLITUDE=PUSH
INDENTER, 2, 2, 1.
*NODE PRINT, NSET=INDENTER, TOTALS=ONLY, TIME POINTS=WHOLE
RF
*END STEP
"""


def input_file(mesh: Path, setting: Setting) -> str:
    """Return the whole input file of CalculiX."""
    points, volumes, surfaces = read_mesh(mesh)
    if setting.walls:
        points = [widened(point) for point in points]
    text = tube(points, volumes, surfaces, setting)
    node, element = len(points) + 1, sum(map(len, volumes.values())) + 1
    for name, side, z in (("INDENTER", 1, 0.0), ("SUPPORT", -1, setting.support_z)):
        part, node, element = cylinder(name, side, z, setting.radius, node, element)
        text += part
    held = nodes_of(surfaces[SYMMETRY_Z] + surfaces[END])
    springs = [(element + i, n) for i, n in enumerate(held)]
    text += keyword("*ELEMENT, TYPE=SPRING1, ELSET=GROUND", springs)
    text += f"*SPRING, ELSET=GROUND\n2\n{GROUND:f}\n"
    return text + contact(setting) + loading(setting)


def indenter_forces(printed: str) -> list[tuple[float, float]]:
    """Return depths, and forces of the whole tube, from CalculiX's printed output."""
    pattern = r"total force.*INDENTER and time\s+(\S+)\s+\S+\s+(\S+)"
    return [
        (round(float(time), 4), -4 * float(force)) for time, force in re.findall(pattern, printed)
    ]


def main() -> None:
    """Run from the command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("mesh", type=Path)
    parser.add_argument("--friction", type=float, default=0.0, help="Coulomb coefficient")
    parser.add_argument("--closing", type=float, metavar="PENALTY", help="pinch; in N/mm3")
    parser.add_argument("--out", type=Path, default=Path("forces.csv"))
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        job = Path(folder, "bend")
        setting = Setting(friction=options.friction)
        if options.closing:
            setting = replace(CLOSING, penalty=options.closing)
        job.with_suffix(".inp").write_text(input_file(options.mesh, setting))
        with job.with_suffix(".log").open("w") as log:
            subprocess.run(["ccx", "bend"], cwd=folder, stdout=log, check=True)
        forces = indenter_forces(job.with_suffix(".dat").read_text())
    with options.out.open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(["displacement_mm", "force_N"])
        writer.writerows((depth, f"{force:.5f}") for depth, force in forces)


if __name__ == "__main__":
    main()

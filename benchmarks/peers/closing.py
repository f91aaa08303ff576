"""A tube whose void closes, by this code and CalculiX, on the same mesh.

    python3 benchmarks/peers/closing.py MESH.msh

The nodes of the race's mesh are moved until the void is 11 mm wide, and the wall 1.6 mm thick.
Writes the forces of CalculiX to `ramiefenics/verification/data/closing_neohooke_L1.csv`, with which
`ramiefenics verify codes` compares.
"""

from __future__ import annotations

import argparse
import math
import subprocess
import sys
import tempfile
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
DATA = ROOT / "ramiefenics" / "verification" / "data"
VOID, XYLEM = 7.28, 12.84  # mm, diameters of the mesh
WIDE = 11.0  # mm, of the void here
SETTINGS = ["--radius", "15", "--travel", "24"]


def widened(mesh: str) -> str:
    """Return a mesh with a wider void; the outside of the xylem stays."""
    lines = mesh.splitlines()
    start = lines.index("$Nodes") + 2
    for at in range(start, start + int(lines[start - 1])):
        number, *words = lines[at].split()
        x, y, z = map(float, words)
        radius = math.hypot(x, y)
        share = (XYLEM / 2.0 - radius) / (XYLEM - VOID) * 2.0  # 1 at the void
        factor = 1.0 + max(share, 0.0) * (WIDE - VOID) / 2.0 / radius
        lines[at] = f"{number} {factor * x!r} {factor * y!r} {z!r}"
    return "\n".join(lines) + "\n"


def main() -> None:
    """Run."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("mesh", type=Path)
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        mesh = Path(folder) / "wide.msh"
        mesh.write_text(widened(arguments.mesh.read_text()))
        script = str(HERE / "ramiefenics_bend.py")
        ours = Path(folder) / "ours.csv"
        command = [str(ROOT / "run"), "python", script, str(mesh), "--void", str(WIDE), *SETTINGS]
        subprocess.run([*command, "--out", str(ours)], check=True)
        theirs = DATA / "closing_neohooke_L1.csv"
        command = [sys.executable, str(HERE / "calculix_bend.py"), str(mesh), "--walls", *SETTINGS]
        subprocess.run([*command, "--out", str(theirs)], check=True)
        for path in (ours, theirs):
            print(path.read_text())


if __name__ == "__main__":
    main()

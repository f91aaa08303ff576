"""Forces of CalculiX on a tube whose void closes, with which `ramiefenics verify codes` compares.

    python3 benchmarks/peers/closing.py

The nodes of the race's mesh are moved until the void is 11 mm wide, and the wall 1.6 mm thick; the
tube is pinched between two cylinders of 15 mm radius. CalculiX has two penalties, which tell where
the limit of a stiffer one is. Writes `ramiefenics/verification/data/closing_neohooke_L1.csv`; six
minutes.
"""

from __future__ import annotations

import math
import subprocess
import sys
import tempfile
from pathlib import Path

HERE = Path(__file__).resolve().parent
DATA = HERE.parents[1] / "ramiefenics" / "verification" / "data"
VOID, XYLEM = 7.28, 12.84  # mm, diameters of the mesh
WIDE = 11.0  # mm, of the void here
PENALTIES = (500.0, 2000.0)  # N/mm3


def widened(mesh: str) -> str:
    """Return a mesh with a wider void; the outside of the xylem stays."""
    lines = mesh.splitlines()
    start = lines.index("$Nodes") + 2
    for at in range(start, start + int(lines[start - 1])):
        number, *words = lines[at].split()
        x, y, z = map(float, words)
        radius = math.hypot(x, y)
        share = max(XYLEM / 2.0 - radius, 0.0) / (XYLEM - VOID) * 2.0  # 1 at the void
        factor = 1.0 + share * (WIDE - VOID) / 2.0 / radius
        lines[at] = f"{number} {factor * x!r} {factor * y!r} {z!r}"
    return "\n".join(lines) + "\n"


def main() -> None:
    """Run."""
    with tempfile.TemporaryDirectory() as folder:
        mesh = Path(folder) / "wide.msh"
        mesh.write_text(widened((DATA / "tube_L1.msh").read_text()))
        rows = ["code,displacement_mm,force_N"]
        for penalty in PENALTIES:
            out = Path(folder) / "forces.csv"
            command = [sys.executable, str(HERE / "calculix_bend.py"), str(mesh)]
            command += ["--closing", str(penalty), "--out", str(out)]
            subprocess.run(command, check=True)
            label = f"CalculiX 2.20; {penalty:g} N/mm3"
            rows += [f"{label},{row}" for row in out.read_text().split()[1:]]
    (DATA / "closing_neohooke_L1.csv").write_text("\n".join(rows) + "\n")


if __name__ == "__main__":
    main()

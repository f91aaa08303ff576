"""CalculiX's forces on a tube whose void closes, the reference of `ramiefenics verify closed`.

    python3 benchmarks/peers/closing.py

Two penalties show where the limit of stiff contact lies. Takes six minutes. Writes
`ramiefenics/verification/data/closing_neohooke_L1.csv`.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
from pathlib import Path

HERE = Path(__file__).resolve().parent
DATA = HERE.parents[1] / "ramiefenics" / "verification" / "data"
PENALTIES = (500, 2000)  # N/mm3


def main() -> None:
    """Run CalculiX with each penalty, and write the forces."""
    rows = ["code,displacement_mm,force_N"]
    with tempfile.TemporaryDirectory() as folder:
        for penalty in PENALTIES:
            out = Path(folder) / "forces.csv"
            command = [sys.executable, str(HERE / "calculix_bend.py"), str(DATA / "tube_L1.msh")]
            command += ["--closing", str(penalty), "--out", str(out)]
            subprocess.run(command, check=True)
            label = f"CalculiX 2.20; {penalty} N/mm3"
            rows += [f"{label},{row}" for row in out.read_text().split()[1:]]
    (DATA / "closing_neohooke_L1.csv").write_text("\n".join(rows) + "\n")


if __name__ == "__main__":
    main()

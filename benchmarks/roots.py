"""Discovery of what simulations of bent maize roots lack, genotype by genotype.

    ./run python benchmarks/roots.py FOLDER [--roots 12] [--genotype A632]

FOLDER has the measured roots of Hostetler, Erndwein and others 2022 (Annals of Botany, doi
10.1093/aob/mcac029): `specimens.csv` and `curves`. Takes ten to forty minutes for each genotype
on two cores. Results go to `results/roots-GENOTYPE`, the verdicts to `records/roots.json`.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import tempfile
import time
from pathlib import Path
from typing import Any

import pandas as pd
from record import read_record, write_record

from ramiefenics.effects import SUSPECTS

TO_MM, TOE_MM = 2.0, 0.5
"""Displacement from the toe up to which curves are compared, and the longest toe."""

BASELINE = """
[fixture]
span_mm = 17.5
indenter_radius_mm = 2.5
support_radius_mm = 2.5
friction = { static = 0.3, dynamic = 0.3 }

[stalk]
length_mm = 30
void_diameter_mm = 0

[[stalk.layers]]
name = "root"
outer_diameter_mm = 4

[stalk.layers.material]
density_g_per_cm3 = 0.9
elastic = { E_X_MPa = 16, E_Z_MPa = 180, nu_XY = 0.3, nu_XZ = 0.03, G_XZ_MPa = 18 }
"""
DATASET = f"""
title = "Brace roots of maize, {{genotype}}"
baseline = "root.toml"
fit_sd = 1.0
from_mm = 0.2
to_mm = {TO_MM}

[specimens]
"stalk.layers.root.outer_diameter_mm" = "diameter_major_mm"
"stalk.section_height_mm" = "diameter_minor_mm"

[seating]
zero = "toe"
"""
"""Layout of the data set.

The roots are assumed to lie on their wider side, because it was not recorded which diameter faced
the indenter."""

TRIED = (*SUSPECTS, "fibre_yield")
"""Suspects: the default ones, and one to which the functions learned from two genotypes led."""


def chosen(folder: Path, genotype: str, number: int) -> pd.DataFrame:
    """Return roots whose test was rated good and goes far enough, evenly from all plants."""
    table = pd.read_csv(folder / "specimens.csv")
    table["curve"] = [str((folder / path).resolve()) for path in table["curve"]]
    ends = [pd.read_csv(path)["displacement_mm"].max() for path in table["curve"]]
    good = (table["note"] == "good test") & (pd.Series(ends) > TO_MM + TOE_MM)
    if genotype != "all":
        good &= table["genotype"] == genotype
    table = table[good].sample(frac=1.0, random_state=1)
    turn = table.groupby(["genotype", "plant"]).cumcount()
    return table.iloc[turn.argsort(kind="stable")].head(number).sort_index()


def write_dataset(table: pd.DataFrame, genotype: str, folder: Path) -> None:
    """Write a data-set folder of measured roots."""
    folder.mkdir(parents=True)
    table.to_csv(folder / "specimens.csv", index=False)
    (folder / "root.toml").write_text(BASELINE)
    (folder / "dataset.toml").write_text(DATASET.format(genotype=genotype))


def run(folder: Path, genotype: str, number: int) -> dict[str, Any]:
    """Run `ramiefenics discover` on the roots of a genotype, and return its verdict."""
    out = Path("results") / f"roots-{genotype}"
    with tempfile.TemporaryDirectory() as name:
        data = Path(name) / "data"
        table = chosen(folder, genotype, number)
        write_dataset(table, genotype, data)
        return {"roots": len(table), **discovered(data, out)}


def discovered(data: Path, out: Path) -> dict[str, Any]:
    """Run `ramiefenics discover` on a data set; return what is recorded of its verdict."""
    start = time.perf_counter()
    command = ["ramiefenics", "discover", str(data), "--out", str(out)]
    subprocess.run([*command, *(f"--suspect={name}" for name in TRIED)], check=True)
    wall = time.perf_counter() - start
    verdict = json.loads((out / "verdict.json").read_text())
    kept = ["verdict", "groups", "p_value", "misfit_p_value", "probabilities", "amplitudes"]
    kept += ["limits", "gain", "shape_gain", "anatomy", "findings"]
    return {"wall_s": wall, **{key: verdict[key] for key in kept}}


def main() -> None:
    """Run the genotypes that are not recorded yet."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--roots", type=int, default=12, help="of each genotype, at most")
    parser.add_argument("--genotype", nargs="+", default=["A632", "Oh43", "B73"])
    arguments = parser.parse_args()
    for genotype in arguments.genotype:
        record = read_record("roots")
        label = f"{genotype} {arguments.roots}"
        if label not in record:
            record[label] = run(arguments.folder, genotype, arguments.roots)
            write_record("roots", record)
        print(label, record[label]["verdict"], record[label]["groups"], flush=True)


if __name__ == "__main__":
    main()

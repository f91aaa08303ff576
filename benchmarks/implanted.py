"""Errors implanted into measured curves of maize roots, to be found beside what the roots have.

    ./run python benchmarks/implanted.py FOLDER [--cases N]

FOLDER is that of `benchmarks/roots.py`. Twelve roots of one genotype are given to `ramiefenics
discover` as they are and with an error in all of their records, or in those of a second machine,
which tested every other root. Their displacement is shifted so that their toes are as long as the
simulated ones, because a gap or an offset cannot show in a displacement that begins at the toe, and
where contact began is not recorded. Takes twenty minutes for each case on two cores; keeps finished
cases in `records/implanted.json`.
"""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from record import read_record, write_record
from roots import TO_MM, chosen, discovered, write_dataset

import ramiefenics as rf
from ramiefenics.measured.record import Record
from ramiefenics.measured.seating import toe_mm

GENOTYPE, ROOTS = "A632", 12
HALF = "second"


@dataclass(frozen=True)
class Implant:
    """An error of the machine or of the stated span.

    Attributes
    ----------
    effect
        Name of the effect that describes it.
    amplitude
        Its amplitude, in the unit of the effect.
    half
        Whether only the records of the second machine have it.
    """

    effect: str
    amplitude: float
    half: bool

    @property
    def name(self) -> str:
        """Name by which `discover` should find it."""
        return f"{self.effect}_of_{HALF}" if self.half else self.effect


CASES: dict[str, Implant | None] = {"untouched": None} | {
    f"{effect} {amplitude:g} in {where}": Implant(effect, amplitude, where == "half")
    for effect, amplitude in (
        ("machine_compliance", 0.01),
        ("seating_gap", 0.1),
        ("load_scale", 0.3),
        ("load_offset", 3.0),
        ("span_error", 2.0),
        ("span_error", -2.0),
    )
    for where in ("all", "half")
}

RECORDED: dict[str, Callable[[pd.DataFrame, float], pd.DataFrame]] = {
    "machine_compliance": lambda c, a: c.assign(
        displacement_mm=c["displacement_mm"] + a * c["force_N"]
    ),
    "seating_gap": lambda c, a: c.assign(displacement_mm=c["displacement_mm"] + a),
    "load_scale": lambda c, a: c.assign(force_N=(1.0 + a) * c["force_N"]),
    "load_offset": lambda c, a: c.assign(force_N=c["force_N"] + a),
}
"""Records with an error of the machine. The span is stated, so its error is not in the records."""


def with_simulated_toe(record: Record) -> Record:
    """Return a record whose curve is shifted to have as long a toe as the simulated baseline."""
    protocol = replace(record.test.protocol, travel_mm=TO_MM, save_every_mm=TO_MM)
    bent = rf.simulate(replace(record.test, protocol=protocol)).curve
    travel, force = (bent[name].to_numpy() for name in ("displacement_mm", "force_N"))
    toe = toe_mm(lambda at: np.interp(at, travel, force), record.straight_mm)
    moved = record.curve.assign(displacement_mm=record.curve["displacement_mm"] + toe)
    return replace(record, curve=moved)


def write_case(roots: rf.Dataset, implant: Implant | None, folder: Path) -> None:
    """Write the data set of a case."""
    table = pd.DataFrame([record.row for record in roots.records])
    table["machine"] = np.resize(["first", HALF], len(table))
    fixture = roots.baseline.fixture
    assert isinstance(fixture, rf.Fixture)  # as `roots.BASELINE` has it
    table["span_mm"] = fixture.span_mm
    table["curve"] = [f"curves/{record.name}.csv" for record in roots.records]
    curves = [record.curve for record in roots.records]
    curves = [curve[curve["displacement_mm"] < TO_MM + 0.1] for curve in curves]  # none breaks
    if implant is not None:
        wrong = (table["machine"] == HALF) | (not implant.half)
        if implant.effect == "span_error":
            table.loc[wrong, "span_mm"] -= implant.amplitude
        else:
            record_wrongly = RECORDED[implant.effect]
            curves = [
                record_wrongly(curve, implant.amplitude) if of else curve
                for curve, of in zip(curves, wrong, strict=True)
            ]
    write_dataset(table, GENOTYPE, folder)
    (folder / "curves").mkdir()
    for name, curve in zip(table["curve"], curves, strict=True):
        curve.to_csv(folder / name, index=False)
    layout = (folder / "dataset.toml").read_text().replace('"toe"', '"machine"')
    columns = '[specimens]\n"fixture.span_mm" = "span_mm"\n"group" = "machine"'
    (folder / "dataset.toml").write_text(layout.replace("[specimens]", columns))


def run(roots: rf.Dataset, implant: Implant | None, label: str) -> dict[str, Any]:
    """Run `ramiefenics discover` on a case, and return its verdict."""
    hidden = {} if implant is None else {implant.name: implant.amplitude}
    with tempfile.TemporaryDirectory() as name:
        data = Path(name) / "data"
        write_case(roots, implant, data)
        out = Path("results") / f"implanted-{label.replace(' ', '-')}"
        return {"hidden": hidden, **discovered(data, out)}


def main() -> None:
    """Run the cases that are not recorded yet."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--cases", type=int, default=len(CASES), help="how many, at most")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        data = Path(name) / "data"
        write_dataset(chosen(arguments.folder, GENOTYPE, ROOTS), GENOTYPE, data)
        roots = rf.read_dataset(data)
    roots = replace(roots, records=tuple(map(with_simulated_toe, roots.records)))
    for label, implant in list(CASES.items())[: arguments.cases]:
        record = read_record("implanted")
        if label not in record:
            record[label] = run(roots, implant, label)
            write_record("implanted", record)
        found = record[label]
        print(label, found["verdict"], found["groups"], found["amplitudes"], flush=True)


if __name__ == "__main__":
    main()

"""Errors implanted into measured curves of maize roots, to be found beside what the roots have.

    ./run python benchmarks/implanted.py FOLDER [--cases N]

FOLDER is that of `benchmarks/roots.py`. Twelve roots of one genotype are given to `ramiefenics
discover` as they are and with an error in all of their records, or in those of a second machine,
which tested every other root. Displacement begins at the toe. A gap or an offset cannot show then,
so for these it begins where contact does instead; as that was not recorded, it is taken to be where
the toe becomes as long as a simulated one, which is right to about 0.05 mm for each root. Takes
twenty minutes for each case on two cores; keeps finished cases in `records/implanted.json`.
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
from roots import TO_MM, TOE_MM, chosen, discovered, write_dataset

import ramiefenics as rf
from ramiefenics.measured.record import Record
from ramiefenics.measured.seating import toe_mm

GENOTYPE, ROOTS = "A632", 12
HALF = "second"


@dataclass(frozen=True)
class Case:
    """An error of the machine or of the stated span, or none.

    Attributes
    ----------
    toe
        Whether displacement begins at the toe.
    effect
        Name of the effect that describes the error; empty for none.
    amplitude
        Its amplitude, in the unit of the effect.
    half
        Whether only the records of the second machine have it.
    """

    toe: bool = True
    effect: str = ""
    amplitude: float = 0.0
    half: bool = False

    @property
    def name(self) -> str:
        """Name by which `discover` should find the error."""
        return f"{self.effect}_of_{HALF}" if self.half else self.effect

    @property
    def label(self) -> str:
        """Label of the case in the record."""
        if not self.effect:
            return "untouched" if self.toe else "untouched from contact"
        return f"{self.effect} {self.amplitude:g} in {'half' if self.half else 'all'}"


CASES = (
    Case(),
    Case(toe=False),
    *(
        Case(effect not in ("seating_gap", "load_offset"), effect, amplitude, half)
        for half in (True, False)
        for effect, amplitude in (
            ("machine_compliance", 0.03),
            ("seating_gap", 0.1),
            ("span_error", 2.0),
            ("load_offset", 4.0),
            ("load_scale", 0.3),
            ("span_error", -2.0),
        )
    ),
)

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


def write_case(roots: rf.Dataset, case: Case, folder: Path) -> None:
    """Write the data set of a case."""
    records = roots.records if case.toe else tuple(map(with_simulated_toe, roots.records))
    table = pd.DataFrame([record.row for record in records])
    table["machine"] = np.resize(["first", HALF], len(table))
    fixture = roots.baseline.fixture
    assert isinstance(fixture, rf.Fixture)  # as `roots.BASELINE` has it
    table["span_mm"] = fixture.span_mm
    table["curve"] = [f"curves/{record.name}.csv" for record in records]
    curves = [record.curve for record in records]
    curves = [curve[curve["displacement_mm"] < TO_MM + TOE_MM] for curve in curves]  # none breaks
    wrong = (table["machine"] == HALF) | (not case.half)
    if case.effect == "span_error":
        table.loc[wrong, "span_mm"] -= case.amplitude
    elif case.effect:
        record_wrongly = RECORDED[case.effect]
        curves = [
            record_wrongly(curve, case.amplitude) if of else curve
            for curve, of in zip(curves, wrong, strict=True)
        ]
    write_dataset(table, GENOTYPE, folder)
    (folder / "curves").mkdir()
    for name, curve in zip(table["curve"], curves, strict=True):
        curve.to_csv(folder / name, index=False)
    columns = '[specimens]\n"fixture.span_mm" = "span_mm"\n"group" = "machine"'
    layout = (folder / "dataset.toml").read_text().replace("[specimens]", columns)
    if not case.toe:
        layout = layout.replace('"toe"', '"machine"')
        layout = layout.replace("from_mm = 0.2", "from_mm = 0.3")  # where all records have begun
    (folder / "dataset.toml").write_text(layout)


def run(roots: rf.Dataset, case: Case) -> dict[str, Any]:
    """Run `ramiefenics discover` on a case, and return its verdict."""
    with tempfile.TemporaryDirectory() as name:
        data = Path(name) / "data"
        write_case(roots, case, data)
        out = Path("results") / f"implanted-{case.label.replace(' ', '-')}"
        hidden = {case.name: case.amplitude} if case.effect else {}
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
    for case in CASES[: arguments.cases]:
        record = read_record("implanted")
        if case.label not in record:
            record[case.label] = run(roots, case)
            write_record("implanted", record)
        found = record[case.label]
        print(case.label, found["verdict"], found["groups"], found["amplitudes"], flush=True)


if __name__ == "__main__":
    main()

"""Random bad inputs, and independent checks of those that are accepted.

A file that a user could have written is corrupted at random, or a key is given a random value.
Whatever reads the file may refuse it with a `SpecificationError` or accept it. What is accepted is
judged by an oracle that shares no code with the program's checks.
"""

from __future__ import annotations

import itertools
import math
import re
import shutil
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

import ramiefenics as rf
from ramiefenics.calibration import study as calibration
from ramiefenics.discovery.curves.observed import observe
from ramiefenics.measured.readers.base import Reader
from ramiefenics.model.laws import Law
from ramiefenics.specification.explained import keys
from ramiefenics.specification.files import dump_test
from ramiefenics.specification.user_file import load_objects
from ramiefenics.validation import study as validation

NUMBER = re.compile(rb"(?<![\w.])-?\d+\.?\d*(?:[eE][+-]?\d+)?")
NASTY = [
    *("nan", "inf", "-inf", "-1", "0", "-0.0", "1e308", "1e-308", "1e30", "9" * 310, "9" * 4300),
    *("0x10", "1_000", "''", "'text'", "[]", "[1, 2]", "{}", "true", "1979-05-27", "1e5", "1e-5"),
    *("'=cmd()'", '"""', "a.b = 1", "[" * 500, "'" + "x" * 200_000 + "'", "3", "-3.5", "\\u0000"),
]
JUNK = [
    b"\0",
    b"\xff\xfe",
    b"\n\n[a]\n",
    b'"',
    b";",
    b",",
    b"\t",
    b"=",
    b"\r",
    b"'",
    "µé中".encode(),
]


@dataclass(frozen=True)
class Target:
    """A reader of files that is attacked.

    Attributes
    ----------
    files
        Contents of files that a user could have written, by name.
    read
        Reads the folder with these files; returns what is wrong with the input that it accepted,
        or an empty string.
    spoilt
        Names of the files that may be corrupted.
    """

    files: Mapping[str, bytes]
    read: Callable[[Path], str]
    spoilt: tuple[str, ...]


def spoil(content: bytes, rng: np.random.Generator) -> bytes:
    """Return a file with one to three random defects."""
    for _ in range(int(rng.integers(1, 4))):
        content = rng.choice(DEFECTS)(content, rng)  # type: ignore[arg-type]
    return content


def _number(content: bytes, rng: np.random.Generator) -> bytes:
    places = [*NUMBER.finditer(content)]
    if not places:
        return content
    at = places[int(rng.integers(len(places)))]
    return content[: at.start()] + str(rng.choice(NASTY)).encode() + content[at.end() :]


def _byte(content: bytes, rng: np.random.Generator) -> bytes:
    at = int(rng.integers(len(content) + 1))
    return content[:at] + bytes([int(rng.integers(256))]) + content[at + 1 :]


def _insert(content: bytes, rng: np.random.Generator) -> bytes:
    at = int(rng.integers(len(content) + 1))
    return content[:at] + JUNK[int(rng.integers(len(JUNK)))] + content[at:]


def _cut(content: bytes, rng: np.random.Generator) -> bytes:
    start, end = sorted(rng.integers(len(content) + 1, size=2))
    return content[:start] if rng.random() < 0.3 else content[:start] + content[end:]


def _line(content: bytes, rng: np.random.Generator) -> bytes:
    lines = content.split(b"\n")
    one, other = rng.integers(len(lines), size=2)
    how = int(rng.integers(4))
    if how == 0:
        del lines[one]
    elif how == 1:
        lines.insert(one, lines[other])
    elif how == 2:
        lines[one], lines[other] = lines[other], lines[one]
    else:
        lines[one] += b"," + lines[other]
    return b"\n".join(lines)


DEFECTS = [_number, _number, _number, _byte, _insert, _cut, _line]


def specification_faults(test: rf.BendingTest) -> str:
    """Return why an accepted specification is nonsense, or an empty string."""
    diameters = [test.stalk.void_diameter_mm]
    diameters += [layer.outer_diameter_mm for layer in test.stalk.layers]
    if not all(math.isfinite(d) for d in diameters) or diameters[0] < 0.0:
        return f"diameters {diameters}"
    if any(inner >= outer for inner, outer in itertools.pairwise(diameters)):
        return f"diameters {diameters}"
    for layer in test.stalk.layers:
        e = layer.material.elastic
        x, z, transverse, axial = 1 / e.E_X_MPa, 1 / e.E_Z_MPa, e.nu_XY, e.nu_XZ
        compliance = np.array(
            [
                [x, -transverse * x, -axial * x],
                [-transverse * x, x, -axial * x],
                [-axial * x, -axial * x, z],
            ]
        )
        if not np.isfinite(compliance).all() or np.linalg.eigvalsh(compliance).min() <= 0.0:
            return f"unstable constants of {layer.name}"
        if not layer.material.density_g_per_cm3 > 0.0 or not e.G_XZ_MPa > 0.0:
            return f"constants of {layer.name}"
    lengths = [test.stalk.length_mm, test.protocol.travel_mm]
    if not all(0.0 < length < 1e6 for length in lengths):
        return f"lengths {lengths}"
    friction = test.fixture.friction
    if not 0.0 <= friction.dynamic <= friction.static < 1e6:
        return f"friction {friction}"
    return ""


def curve_faults(name: str, curve: pd.DataFrame) -> str:
    """Return why an accepted curve is nonsense, or an empty string."""
    displacement, force = curve["displacement_mm"], curve["force_N"]
    if len(curve) < 20 or not np.isfinite(curve[["displacement_mm", "force_N"]].to_numpy()).all():
        return f"{name}: {len(curve)} rows, or not finite"
    if np.ptp(displacement) <= 0.0 or np.ptp(force) <= 0.0 or force.abs().max() > 1e6:
        return f"{name}: from {force.min()} to {force.max()} N"
    return ""


def _specification(folder: Path) -> str:
    test = rf.read_test(folder / "spec.toml")
    return specification_faults(test)


def _dataset(folder: Path) -> str:
    dataset = rf.read_dataset(folder)
    observed = observe(dataset)
    faults = [curve_faults(record.name, record.curve) for record in dataset.records]
    faults += [specification_faults(record.test) for record in dataset.records]
    if not np.isfinite(observed.force_N).all():
        faults.append("reduced curves are not finite")
    return next(filter(None, faults), "")


def _raw(name: str, **options: Any) -> Callable[[Path], str]:
    def read(folder: Path) -> str:
        curves = rf.read_raw([folder / name], **options)
        faults = [curve_faults(name, curve.curve) for name, curve in curves.items()]
        return next(filter(None, faults), "")

    return read


def _calibration(folder: Path) -> str:
    study = calibration.read_study(folder / "study.toml")
    if not all(factor.low < factor.high for factor in study.factors):
        return "a factor's range is empty"
    runs = len(study.plan().coded)
    return "" if runs < 1e5 else f"{runs} runs"


def _validation(folder: Path) -> str:
    study = validation.read_validation(folder / "study.toml")
    on = {name for split in study.splits for name in split.on}
    return "" if on <= {seen.name for seen in study.observations} else f"calibrated on {on}"


def _own(kind: type, what: str) -> Callable[[Path], str]:
    def read(folder: Path) -> str:
        found: list[Any] = load_objects(folder / "own.py", kind, what)
        return "" if all(isinstance(one, kind) for one in found) else f"{found}"

    return read


def targets() -> dict[str, Target]:
    """Return the targets by name."""
    package = Path(rf.__file__).parent
    text = (package.parent / "CONTRIBUTING.md").read_text(encoding="utf-8")
    law, *effects, reader = re.findall(r"```python\n(.*?)```", text, re.DOTALL)
    rows = "\n".join(
        f"{0.1 * n:.1f},{0.5 * n:.2f},{0.3 * n + 0.01 * (n % 3):.3f}" for n in range(60)
    )
    curve = "displacement_mm,force_N\n" + "\n".join(
        line.split(",", 1)[0] + "," + line.rsplit(",", 1)[1] for line in rows.splitlines()
    )
    other = curve.replace(".3", ".4")
    layout = (
        'title = "Stalks"\nbaseline = "table3"\nfit_sd = 0.1\nfrom_mm = 0.5\n'
        "fixture = { span_mm = 100, indenter_radius_mm = 5 }\n\n[specimens]\n"
        '"stalk.layers.phloem.outer_diameter_mm" = "outer"\n\n[tests]\n"fixture.span_mm" = "span"\n'
    )
    dataset = {
        "dataset.toml": layout,
        "specimens.csv": "specimen,outer\na,14.2\nb,13.9\n",
        "tests.csv": "specimen,curve,span\na,a.csv,100\nb,b.csv,80\n",
        "a.csv": curve,
        "b.csv": other,
    }
    headings = (
        "Specimen label,stalk 1\nDiameter,14.2,mm\n\nTime,Extension,Load\n(s),(mm),(N)\n" + rows
    )
    study = (package / "calibration/studies/table4.toml").read_text()
    published = (package / "validation/studies/published.toml").read_text()

    def target(files: Mapping[str, str], read: Callable[[Path], str], *spoilt: str) -> Target:
        content = {name: text.encode() for name, text in files.items()}
        return Target(content, read, spoilt or tuple(files))

    return {
        "specification": target(
            {"spec.toml": dump_test(rf.ramie(14.2, 7.3, 0.67))}, _specification
        ),
        "data set": target(dataset, _dataset),
        "raw, with headings": target({"a.csv": headings}, _raw("a.csv")),
        "raw, columns": target(
            {"a.txt": rows.replace(",", " ")},
            _raw("a.txt", format="columns", columns=("time_s", "displacement_mm", "force_N")),
        ),
        "calibration": target({"study.toml": study}, _calibration),
        "validation": target({"study.toml": published}, _validation),
        "own law": target({"own.py": law}, _own(Law, "law")),
        "own effect": target({"own.py": effects[0]}, _own(rf.Effect, "effects")),
        "own format": target({"own.py": reader}, _own(Reader, "format")),
    }


def attack(target: Target, folder: Path, rng: np.random.Generator) -> str:
    """Corrupt one of a target's files and read them; return what is wrong if they are accepted."""
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    victim = str(rng.choice(target.spoilt))
    for name, content in target.files.items():
        (folder / name).write_bytes(spoil(content, rng) if name == victim else content)
    return target.read(folder)


def set_a_key(test: rf.BendingTest, rng: np.random.Generator) -> str:
    """Give a random key a random value; return what is wrong if it is accepted."""
    named = [key.path for key in keys() if key.type]
    layer = str(rng.choice(["xylem", "phloem", "bark"]))
    key = str(rng.choice(named)).replace("NAME", layer)
    return specification_faults(rf.override(test, [f"{key}={rng.choice(NASTY)}"]))

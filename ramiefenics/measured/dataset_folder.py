"""Creation of a folder of measured data from raw files."""

from __future__ import annotations

import math
import shutil
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import pandas as pd
import tomli_w

from ramiefenics.measured import RawCurve
from ramiefenics.measured.listing import SPECIMENS
from ramiefenics.measured.readers.words import DIAMETERS, SPANS
from ramiefenics.measured.record import REDUCED
from ramiefenics.measured.tables import parse_number
from ramiefenics.results.draft import draft
from ramiefenics.results.text import unspoken
from ramiefenics.specification import Fixture, SpecificationError
from ramiefenics.specification.files import archive_test
from ramiefenics.specification.sources import as_test

CURVES = "curves"
"""Name of the folder of the curves."""

HEAD = """\
# Measured data for `ramiefenics reduce` and `discover`; see docs/discovery.md for all keys.
# Enter the diameters in specimens.csv, and name their columns here, for instance
#   [specimens]
#   "stalk.void_diameter_mm" = "void_mm"
#   "stalk.layers.phloem.outer_diameter_mm" = "diameter_mm"
# Displacement is counted from the machine's zero; with zero = "threshold" in [seating] from
# contact; with zero = "toe" from where the line through the first straight part has no force.

"""


def check_new(folder: Path) -> None:
    """Check that a folder has no files of a data set yet, as they may have been edited.

    Raises
    ------
    SpecificationError
        If it has any.
    """
    for name in ("dataset.toml", SPECIMENS, CURVES):
        if (folder / name).exists():
            allowed = f"must not have a {name} yet; choose another folder"
            raise SpecificationError("out", str(folder), allowed)


def write_dataset(
    curves: Mapping[str, RawCurve],
    folder: str | Path,
    baseline: str,
    speed_mm_per_min: float | None = None,
    format: str | Path | None = None,
) -> Path:
    """Write ``dataset.toml``, ``specimens.csv`` and a file per curve, as `read_dataset` reads them.

    Parameters
    ----------
    curves
        Curves by specimen. The values in their headers become columns of `specimens.csv`.
    folder
        Folder, created if it does not exist; nothing in it appears half-written.
    baseline
        Baseline specification: a TOML file, which is copied, or a published test of ramie.
    speed_mm_per_min
        Speed of the crosshead, for the record.
    format
        Format of the raw files, as for `read_raw`, for the record; a Python file is copied.

    Raises
    ------
    SpecificationError
        If there is a data set in the folder, or the baseline cannot be used.
    """
    folder = Path(folder)
    check_new(folder)
    own, test = baseline.endswith(".toml"), as_test(baseline)
    layout: dict[str, object] = {"baseline": "baseline.toml" if own else baseline}
    if speed_mm_per_min is not None:
        layout["speed_mm_per_min"] = speed_mm_per_min
    if format is not None:
        layout["format"] = Path(format).name
    test.fixture.check_beam(REDUCED)
    if isinstance(test.fixture, Fixture):
        layout["fixture"] = {"span_mm": test.fixture.span_mm}
    layout |= taken(curves, baseline)[0]
    rows = [
        {"specimen": name, **_renamed(raw.header), "curve": f"{CURVES}/{name}.csv"}
        for name, raw in curves.items()
    ]
    with draft(folder, replace=False) as made:
        if own:
            archive_test(test, made / "baseline.toml")
        if str(format).endswith(".py"):
            shutil.copy(str(format), made)
        (made / "dataset.toml").write_text(HEAD + tomli_w.dumps(layout), encoding="utf-8")
        table = pd.DataFrame(rows)
        order = [*(name for name in table.columns if name != "curve"), "curve"]
        unspoken(table[order]).to_csv(made / SPECIMENS, index=False)
        (made / CURVES).mkdir()
        for name, raw in curves.items():
            raw.curve.to_csv(made / CURVES / f"{name}.csv", index=False, float_format="%.8g")
    return folder


def taken(
    curves: Mapping[str, RawCurve], baseline: str
) -> tuple[dict[str, dict[str, Any]], list[str]]:
    """Return what the headers of raw files state about specimens and supports.

    Parameters
    ----------
    curves
        Curves by specimen.
    baseline
        Baseline specification of the specimens.

    Returns
    -------
    tuple
        Tables for ``dataset.toml``, and one sentence on the origin of each value.
    """
    test = as_test(baseline)
    outermost = test.stalk.layers[-1].name
    found: dict[str, dict[str, Any]] = {}
    diameter, span = (_said_by_all(curves, words) for words in (DIAMETERS, SPANS))
    if diameter:
        found["specimens"] = {f"stalk.layers.{outermost}.outer_diameter_mm": diameter}
        told = [f"the outer diameters of {outermost} are taken from {diameter!r} in the files"]
    else:
        size = test.stalk.outer_diameter_mm
        told = [f"no diameter in the files: all specimens have that of the baseline, {size:g} mm"]
    spans = {float(raw.header[span]) for raw in curves.values()} if span else set()
    if len(spans) == 1 and isinstance(test.fixture, Fixture):
        (value,) = spans
        found["fixture"] = {"span_mm": value}
        told.append(f"the span of {value:g} mm is taken from {span!r} in the files")
    elif isinstance(test.fixture, Fixture):
        told.append(f"the span is that of the baseline, {test.fixture.span_mm:g} mm")
    return found, told


def _said_by_all(curves: Mapping[str, RawCurve], words: Sequence[str]) -> str:
    """Return the first key in all headers with one of some words and a length in mm, or ""."""
    first = next(iter(curves.values())).header
    for key in first:
        named = any(word in key.lower() for word in words) and "(mm)" in key.lower()
        values = [parse_number(raw.header.get(key, "")) for raw in curves.values()]
        if named and all(math.isfinite(value) and value > 0.0 for value in values):
            return key
    return ""


def _renamed(header: Mapping[str, str]) -> dict[str, str]:
    """Return a header with those names changed that a data set needs for itself."""
    taken = ("specimen", "curve")
    return {f"{name} in the file" if name in taken else name: v for name, v in header.items()}

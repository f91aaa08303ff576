"""Creation of a folder of measured data from raw files."""

from __future__ import annotations

import shutil
import warnings
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any

import pandas as pd
import tomli_w

from ramiefenics.measured.dataset import load_dataset
from ramiefenics.measured.listing import SPECIMENS
from ramiefenics.measured.raw import RawCurve
from ramiefenics.measured.record import REDUCED
from ramiefenics.measured.stated import take_stated
from ramiefenics.results.draft import draft
from ramiefenics.results.text import unspoken
from ramiefenics.specification import Fixture, SpecificationError, SpecificationWarning
from ramiefenics.specification.reading import read_toml
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
        If there is a data set in the folder, or the baseline cannot be used, alone or with the
        specimens' diameters and spans.
    """
    folder = Path(folder)
    check_new(folder)
    own, test = baseline.endswith(".toml"), as_test(baseline)
    layout: dict[str, Any] = {"baseline": "baseline.toml" if own else baseline}
    if speed_mm_per_min is not None:
        layout["speed_mm_per_min"] = speed_mm_per_min
    if format is not None:
        layout["format"] = Path(format).name
    test.fixture.check_beam(REDUCED)
    if isinstance(test.fixture, Fixture):
        layout["fixture"] = {"span_mm": test.fixture.span_mm}
    taken = take_stated(curves, test, baseline)
    layout |= taken.layout
    rows = [
        {
            "specimen": name,
            **_renamed(raw.header, taken.columns),
            **{column: values[name] for column, values in taken.columns.items()},
            "curve": f"{CURVES}/{name}.csv",
        }
        for name, raw in curves.items()
    ]
    with draft(folder, replace=False) as made:
        if own:
            _copy_test(Path(baseline), made / "baseline.toml")
        if str(format).endswith(".py"):
            shutil.copy(str(format), made)
        (made / "dataset.toml").write_text(HEAD + tomli_w.dumps(layout), encoding="utf-8")
        table = pd.DataFrame(rows)
        order = [*(name for name in table.columns if name != "curve"), "curve"]
        unspoken(table[order]).to_csv(made / SPECIMENS, index=False)
        (made / CURVES).mkdir()
        for name, raw in curves.items():
            raw.curve.to_csv(made / CURVES / f"{name}.csv", index=False, float_format="%.8g")
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", SpecificationWarning)  # reading the folder tells them
            load_dataset(made)
    return folder


def _copy_test(path: Path, to: Path) -> None:
    """Copy a specification as it is, so that what it leaves out stays left out, and its law."""
    data = read_toml(path)
    law = data.get("law")
    if not str(law).endswith(".py"):
        shutil.copyfile(path, to)
        return
    shutil.copy(path.parent / str(law), to.parent)
    to.write_text(tomli_w.dumps({**data, "law": Path(str(law)).name}), encoding="utf-8")


def _renamed(header: Mapping[str, str], columns: Collection[str]) -> dict[str, str]:
    """Return a header with those names changed that a data set needs for itself."""
    needed = ("specimen", "curve", *columns)
    return {f"{name} in the file" if name in needed else name: v for name, v in header.items()}

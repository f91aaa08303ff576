"""Reading of results from their folders."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path
from typing import Any

import pandas as pd

from ramiefenics.results.result import Picture, Result
from ramiefenics.results.stored import find_summary, read_stored, stored_pictures
from ramiefenics.solve.quasistatic import Ending, Jump
from ramiefenics.solve.result import BendingResult, Statistics
from ramiefenics.specification import BendingTest, SpecificationError, read_test


def read_folder(folder: str | Path) -> Result:
    """Read a result from the folder that `write_folder` has written.

    Parameters
    ----------
    folder
        Folder of results.

    Returns
    -------
    Result
        A `BendingResult` without snapshots, which keeps the figures of these as pictures and cannot
        write their fields again; or a `StoredResult` for any other kind of result.

    Raises
    ------
    SpecificationError
        If it is not such a folder, or a file in it cannot be read.
    """
    folder = Path(folder)
    if find_summary(folder)[1]["folder"]["result"] == BendingResult.__name__:
        return read_bend(folder)
    return read_stored(folder)


def read_bend(folder: str | Path) -> BendingResult:
    """Read the result of a simulation from its folder.

    Parameters
    ----------
    folder
        Folder of results, as written by `ramiefenics bend`.

    Raises
    ------
    SpecificationError
        If it is not such a folder, or a file in it cannot be read.
    """
    folder = Path(folder)
    if missing := [name for name in FILES if not (folder / name).is_file()]:
        allowed = f"must be a folder of results of ramiefenics bend, but has no {missing[0]}"
        raise SpecificationError("folder", str(folder), allowed)
    test = read_test(folder / "specification.toml")
    try:
        told: dict[str, Any] = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
        tests, all_told = test.tests, [told, *told.get("further", [])]
        names = ["curve", *(f"curve_{number}" for number in range(2, len(all_told) + 1))]
        first, *further = (
            _result(one, pd.read_csv(folder / f"{name}.csv"), own)
            for one, name, own in zip(tests, names, all_told, strict=False)
        )
        return dataclasses.replace(
            first, test=test, further=tuple(further), pictures=_pictures(folder, told)
        )
    except (OSError, ValueError, KeyError, TypeError) as error:
        allowed = f"must hold intact results of ramiefenics bend ({type(error).__name__}: {error})"
        raise SpecificationError("folder", str(folder), allowed) from error


def _pictures(folder: Path, told: dict[str, Any]) -> dict[str, Picture]:
    """Return the stored figures of the snapshots; those of curves can be drawn anew."""
    kept = {
        name: caption
        for name, caption in told["folder"]["figures"].items()
        if name not in ("curve", "curves") and (folder / f"{name}.png").is_file()
    }
    return stored_pictures(folder, kept)


def _result(test: BendingTest, curve: pd.DataFrame, told: dict[str, Any]) -> BendingResult:
    """Return the result of one test from its curve and its part of the summary."""
    statistics = Statistics(**{name: told[name] for name in Statistics.__dataclass_fields__})
    jumps = tuple(Jump(**jump) for jump in told["jumps"])
    return BendingResult(test, curve, (), statistics, Ending(**told["ending"]), jumps)


FILES = ("specification.toml", "curve.csv", "summary.json")

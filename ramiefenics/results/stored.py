"""A result as read back from its folder."""

from __future__ import annotations

import json
import shutil
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ramiefenics.results.exchange import RECORD, recorded
from ramiefenics.results.result import Picture, Result, Table
from ramiefenics.specification import BendingTest, SpecificationError, read_test

if TYPE_CHECKING:
    import xarray as xr

OWN = ("title", "findings", "notes", "completed", "folder", "versions")
"""Keys that every summary has besides those of a study's numbers."""


@dataclass(frozen=True, repr=False)
class StoredResult(Result):
    """Result of a study as read back: its text, numbers, tables, figures and specifications.

    Its figures are made of pixels. Printed, plotted or written again, it is the same as before:
    what it does not make anew, such as figures as vectors, is copied.

    Attributes
    ----------
    folder
        Folder of the summary, which has all files but those of `write_more`.
    told
        The whole summary.
    """

    folder: Path
    told: dict[str, Any]

    @property
    def title(self) -> str:
        """Title of the result, in one line."""
        return str(self.told["title"])

    @property
    def overview_first(self) -> bool:
        """Whether the overview comes before the findings."""
        return bool(self.told["folder"]["overview_first"])

    @property
    def completed(self) -> bool:
        """Whether the whole study could be carried out."""
        return bool(self.told["completed"])

    def findings(self) -> list[str]:
        """Return the findings."""
        return list(self.told["findings"])

    def notes(self) -> list[str]:
        """Return what users of the findings should know."""
        return list(self.told["notes"])

    def numbers(self) -> dict[str, Any]:
        """Return the study's numbers."""
        return {name: value for name, value in self.told.items() if name not in OWN}

    def overview(self) -> pd.DataFrame | None:
        """Return the table that is printed."""
        table = self.told["folder"]["overview"]
        return None if table is None else pd.DataFrame(**table)

    def tables(self) -> dict[str, Table]:
        """Return all tables."""
        return {
            name: _table(self.folder / f"{name}.csv", **about)
            for name, about in self.told["folder"]["tables"].items()
        }

    def to_xarray(self) -> xr.Dataset:
        """Return the table ``curves`` as an xarray data set.

        Its dimensions are the table's first column, which names the curve of each row, and
        ``displacement_mm`` with the displacements of all curves. Every other column is interpolated
        linearly between the rows of a curve, and is NaN outside them.

        Raises
        ------
        SpecificationError
            If there is no table of curves.
        """
        table = self.tables().get("curves")
        if table is None or "displacement_mm" not in table.data:
            allowed = "cannot be an xarray data set: this result has no table of curves"
            raise SpecificationError("result", self.title, allowed)
        return _to_xarray(table.data)

    def figures(self) -> dict[str, Picture]:
        """Return all figures, as pixels."""
        return stored_pictures(self.folder, self.told["folder"]["figures"])

    def specifications(self) -> dict[str, BendingTest]:
        """Return specifications to continue with."""
        names = self.told["folder"]["specifications"]
        return {name: read_test(self.folder / f"{name}.toml") for name in names}

    def user_files(self) -> list[Path]:
        """Return the user's own Python files that it depends on."""
        return [self.folder / name for name in self.told["folder"]["user_files"]]

    def write_more(self, folder: Path) -> None:
        """Copy the files that have not been written anew."""
        within = self.folder.name == self.told["folder"]["place"]
        whole = self.folder.parent if within else self.folder
        for name in recorded(whole) - {RECORD}:
            source, target = whole / name, folder / name
            if source.is_file() and not target.exists():
                target.parent.mkdir(parents=True, exist_ok=True)
                shutil.copy(source, target)

    def _contents(self) -> dict[str, Any]:
        return dict(self.told["folder"])


def stored_pictures(folder: Path, captions: Mapping[str, str]) -> dict[str, Picture]:
    """Return figures as the PNG files of a folder have them, by name."""
    return {
        name: Picture(partial(_pixels, folder / f"{name}.png"), caption)
        for name, caption in captions.items()
    }


def find_summary(folder: Path) -> tuple[Path, dict[str, Any]]:
    """Return a folder of results, or the subfolder that has most of its files, and the summary.

    Raises
    ------
    SpecificationError
        If there is no summary.
    """
    for path in (*sorted(folder.glob("*.json")), *sorted(folder.glob("*/*.json"))):
        try:
            told = json.loads(path.read_text(encoding="utf-8"))
        except (OSError, ValueError):
            continue
        if not isinstance(told, dict) or not set(OWN) <= set(told):
            continue
        if path.parent in (folder, folder / told["folder"]["place"]):
            return path.parent, told
    allowed = "must be a folder of results that ramiefenics has written"
    raise SpecificationError("folder", str(folder), allowed)


def read_stored(folder: Path) -> StoredResult:
    """Read a result of any kind from its folder.

    Raises
    ------
    SpecificationError
        If it is not a folder of results, or if a file in it is missing or not of its kind.
    """
    found = StoredResult(*find_summary(folder))
    try:
        repr(found)
        _ = found.tables(), found.specifications()
        for picture in found.figures().values():
            picture.draw()
    except (OSError, ValueError, KeyError, TypeError, SyntaxError) as error:
        allowed = f"must hold intact results of ramiefenics ({type(error).__name__}: {error})"
        raise SpecificationError("folder", str(folder), allowed) from error
    return found


def _table(path: Path, caption: str, digits: int, text: Collection[str] = ()) -> Table:
    """Read a table, with text as it is and with empty cells of other columns as NaN."""
    try:
        names = pd.read_csv(path, nrows=0).columns
    except pd.errors.EmptyDataError:
        return Table(pd.DataFrame(), caption, digits)
    data = pd.read_csv(
        path,
        dtype=dict.fromkeys(text, str),
        na_values={name: [""] for name in names if name not in text},
        keep_default_na=False,
    )
    return Table(data, caption, digits)


def _to_xarray(table: pd.DataFrame) -> xr.Dataset:
    import xarray as xr

    label, *columns = table.columns.drop("displacement_mm")
    at = np.unique(table["displacement_mm"])
    curves = dict(iter(table.groupby(label, sort=False)))
    values = {
        name: [
            np.interp(at, c["displacement_mm"], c[name], np.nan, np.nan) for c in curves.values()
        ]
        for name in columns
    }
    return xr.Dataset(
        {name: ((label, "displacement_mm"), value) for name, value in values.items()},
        {label: list(curves), "displacement_mm": at},
    )


def _pixels(path: Path) -> NDArray[np.uint8]:
    from matplotlib.image import imread

    return np.asarray(255.0 * imread(path)[..., :3] + 0.5, dtype=np.uint8)

"""A result as read back from its folder."""

from __future__ import annotations

import json
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ramiefenics.results.result import Picture, Result, Table
from ramiefenics.specification import BendingTest, SpecificationError, read_test

OWN = ("title", "findings", "notes", "completed", "folder", "versions")
"""Keys that every summary has besides those of a study's numbers."""


@dataclass(frozen=True, repr=False)
class StoredResult(Result):
    """Result of a study as read back: its text, numbers, tables, figures and specifications.

    Its figures are made of pixels. Printed, plotted or written again, it is the same as before.

    Attributes
    ----------
    folder
        Folder that it was read from.
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
            name: Table(pd.read_csv(self.folder / f"{name}.csv"), **about)
            for name, about in self.told["folder"]["tables"].items()
        }

    def figures(self) -> dict[str, Picture]:
        """Return all figures, as pixels."""
        return {
            name: Picture(partial(_pixels, self.folder / f"{name}.png"), caption)
            for name, caption in self.told["folder"]["figures"].items()
        }

    def specifications(self) -> dict[str, BendingTest]:
        """Return specifications to continue with."""
        names = self.told["folder"]["specifications"]
        return {name: read_test(self.folder / f"{name}.toml") for name in names}

    def user_files(self) -> list[Path]:
        """Return the user's own Python files that it depends on."""
        return [self.folder / name for name in self.told["folder"]["user_files"]]

    def _contents(self) -> dict[str, Any]:
        return dict(self.told["folder"])


def summary_of(folder: Path) -> dict[str, Any]:
    """Return the summary in a folder of results.

    Raises
    ------
    SpecificationError
        If the folder has none.
    """
    for path in sorted(folder.glob("*.json")):
        try:
            told = json.loads(path.read_text(encoding="utf-8"))
        except (OSError, ValueError):
            continue
        if isinstance(told, dict) and set(OWN) <= set(told):
            return told
    allowed = "must be a folder of results that ramiefenics has written"
    raise SpecificationError("folder", str(folder), allowed)


def read_stored(folder: Path) -> StoredResult:
    """Read a result of any kind from its folder.

    Raises
    ------
    SpecificationError
        If it is not a folder of results, or if a file in it is missing or not of its kind.
    """
    found = StoredResult(folder, summary_of(folder))
    try:
        repr(found)
        _ = found.tables(), found.specifications()
        for picture in found.figures().values():
            picture.draw()
    except (OSError, ValueError, KeyError, TypeError, SyntaxError) as error:
        allowed = f"must hold intact results of ramiefenics ({type(error).__name__}: {error})"
        raise SpecificationError("folder", str(folder), allowed) from error
    return found


def _pixels(path: Path) -> NDArray[np.uint8]:
    from matplotlib.image import imread

    return np.asarray(255.0 * imread(path)[..., :3] + 0.5, dtype=np.uint8)

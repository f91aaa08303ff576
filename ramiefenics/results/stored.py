"""A result as its folder tells it."""

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
"""What every summary has besides a study's numbers."""


@dataclass(frozen=True, repr=False)
class StoredResult(Result):
    """The result of a study, read back: its words, numbers, tables, figures and specifications.

    Figures are pictures. Printed, plotted and written again it is as it was.

    Attributes
    ----------
    folder
        Where it is.
    told
        The whole summary.
    """

    folder: Path
    told: dict[str, Any]

    @property
    def title(self) -> str:
        """What it is, in a line."""
        return str(self.told["title"])

    @property
    def overview_first(self) -> bool:
        """Whether the overview is what was asked for."""
        return bool(self.told["folder"]["overview_first"])

    @property
    def completed(self) -> bool:
        """Whether all of it could be done."""
        return bool(self.told["completed"])

    def findings(self) -> list[str]:
        """Return what was found."""
        return list(self.told["findings"])

    def notes(self) -> list[str]:
        """Return what whoever uses the findings should know."""
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
        """Return all figures, as pictures."""
        return {
            name: Picture(partial(_pixels, self.folder / f"{name}.png"), caption)
            for name, caption in self.told["folder"]["figures"].items()
        }

    def specifications(self) -> dict[str, BendingTest]:
        """Return specifications to go on with."""
        names = self.told["folder"]["specifications"]
        return {name: read_test(self.folder / f"{name}.toml") for name in names}

    def user_files(self) -> list[Path]:
        """Return Python files of the user's own that it depends on."""
        return [self.folder / name for name in self.told["folder"]["user_files"]]

    def _contents(self) -> dict[str, Any]:
        return dict(self.told["folder"])


def summary_of(folder: Path) -> dict[str, Any]:
    """Return the summary in a folder of results.

    Raises
    ------
    SpecificationError
        If it has none.
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
    """Read the folder of any result.

    Raises
    ------
    SpecificationError
        If it is none, or something in it is missing or no such file.
    """
    found = StoredResult(folder, summary_of(folder))
    try:
        repr(found)
        _ = found.tables(), found.specifications()
        for picture in found.figures().values():
            picture.draw()
    except (OSError, ValueError, KeyError, TypeError, SyntaxError) as error:
        allowed = f"must hold what ramiefenics wrote ({type(error).__name__}: {error})"
        raise SpecificationError("folder", str(folder), allowed) from error
    return found


def _pixels(path: Path) -> NDArray[np.uint8]:
    from matplotlib.image import imread

    return np.asarray(255.0 * imread(path)[..., :3] + 0.5, dtype=np.uint8)

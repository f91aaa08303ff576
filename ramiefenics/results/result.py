"""What every study gives back, in the same words."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ramiefenics.results.manifest import finite, versions
from ramiefenics.results.style import VECTOR
from ramiefenics.results.text import cells
from ramiefenics.specification import BendingTest, SpecificationError

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True)
class Table:
    """A table of a result.

    Attributes
    ----------
    data
        Its content; columns' names have units.
    caption
        For the page; a table without one is only in the folder.
    digits
        Of numbers in the folder's file.
    """

    data: pd.DataFrame
    caption: str = ""
    digits: int = 8


@dataclass(frozen=True)
class Picture:
    """A figure of a result, drawn when it is asked for.

    Attributes
    ----------
    draw
        Returns a figure, or RGB pixels of shape (height, width, 3).
    caption
        For the page.
    """

    draw: Callable[[], Figure | NDArray[np.uint8]]
    caption: str

    def figure(self) -> Figure:
        """Return it as a figure of Matplotlib."""
        from matplotlib.figure import Figure

        drawn = self.draw()
        if isinstance(drawn, Figure):
            return drawn
        height, width, _ = drawn.shape
        figure = Figure(figsize=(8.0, 8.0 * height / width), dpi=200)
        axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
        axes.set_axis_off()
        axes.imshow(drawn)
        return figure

    def png(self) -> bytes:
        """Return it as the content of a PNG file."""
        return _png(self.draw())

    def files(self) -> dict[str, bytes]:
        """Return it as the contents of files by the ends of their names: PNG, PDF and SVG.

        Pixels are PNG only.
        """
        from matplotlib import rc_context

        drawn = self.draw()
        files = {"png": _png(drawn)}
        if not isinstance(drawn, np.ndarray):
            with rc_context(VECTOR):
                for end, undated in (("pdf", "CreationDate"), ("svg", "Date")):
                    file = BytesIO()
                    drawn.savefig(file, format=end, metadata={undated: None})
                    files[end] = file.getvalue()
        return files


def _png(drawn: Figure | NDArray[np.uint8]) -> bytes:
    from matplotlib.image import imsave

    file = BytesIO()
    if isinstance(drawn, np.ndarray):
        imsave(file, drawn, format="png")
    else:
        drawn.savefig(file, format="png")
    return file.getvalue()


class Result(ABC):
    """A finished study: what it found, and what is needed to go on from there.

    `write_folder` makes a folder of it; printed, it is a page to read.
    """

    SUMMARY: ClassVar[str] = "summary.json"
    """File of the summary."""

    PLACE: ClassVar[str] = "."
    """Where in the folder of the results all that has the same name in every folder goes."""

    @property
    @abstractmethod
    def title(self) -> str:
        """What this is, in a line."""

    @property
    def overview_first(self) -> bool:
        """Whether the overview is what is asked for, which findings comment on."""
        return False

    @property
    def completed(self) -> bool:
        """Whether all of it could be done."""
        return True

    @abstractmethod
    def findings(self) -> list[str]:
        """Return what was found, a sentence each, the most important first."""

    def notes(self) -> list[str]:
        """Return what whoever uses the findings should know, a sentence each."""
        return []

    @abstractmethod
    def numbers(self) -> dict[str, Any]:
        """Return what the summary has of this study; NaN and infinity become null there."""

    def overview(self) -> pd.DataFrame | None:
        """Return the table that is printed: few rows and columns."""
        return None

    def tables(self) -> dict[str, Table]:
        """Return all tables, by the name of their file."""
        return {}

    def figures(self) -> dict[str, Picture]:
        """Return all figures, by the name of their file."""
        return {}

    def plot(self, name: str | None = None) -> Figure:
        """Draw a figure, the main one by default.

        Parameters
        ----------
        name
            As in `figures`.

        Raises
        ------
        SpecificationError
            If there is none of that name.
        """
        figures = self.figures()
        chosen = next(iter(figures), "") if name is None else name
        if chosen not in figures:
            allowed = f"must be one of {', '.join(figures)}" if figures else "there is no figure"
            raise SpecificationError("name", chosen, allowed)
        return figures[chosen].figure()

    def specifications(self) -> dict[str, BendingTest]:
        """Return specifications to go on with, by the name of their file."""
        return {}

    def user_files(self) -> list[Path]:
        """Return Python files of the user's own that it depends on, but for those of laws."""
        return []

    def write_more(self, folder: Path) -> None:  # noqa: B027  most have nothing more
        """Write what else belongs into the folder of the results."""

    def summary(self) -> dict[str, Any]:
        """Return findings, numbers and manifest as strict JSON has them."""
        told = {"findings": self.findings(), "notes": self.notes(), "completed": self.completed}
        own = {"title": self.title, **told, **self.numbers()}
        summary: dict[str, Any] = finite(
            {**own, "folder": self._contents(), "versions": versions()}
        )
        return summary

    def _contents(self) -> dict[str, Any]:
        """Return what the folder has, as far as its files do not tell."""
        overview = self.overview()
        return {
            "result": type(self).__name__,
            "overview": None if overview is None else overview.to_dict("split"),
            "overview_first": self.overview_first,
            "tables": {
                name: {"caption": table.caption, "digits": table.digits}
                for name, table in self.tables().items()
            },
            "figures": {name: picture.caption for name, picture in self.figures().items()},
            "specifications": list(self.specifications()),
            "user_files": [path.name for path in self.user_files()],
        }

    def __repr__(self) -> str:
        """Return title, findings, overview and notes, as text."""
        overview = self.overview()
        table = [] if overview is None else [cells(overview).to_string(index=False)]
        first, then = self.findings(), table
        if self.overview_first:
            first, then = then, first
        notes = (f"note: {text}" for text in self.notes())
        return "\n".join([self.title, *first, *then, *notes])

    def _repr_html_(self) -> str:
        """Return the same as HTML, with the main figure, for notebooks."""
        from ramiefenics.results.page import brief

        return brief(self)

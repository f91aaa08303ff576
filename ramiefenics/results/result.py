"""Common interface of the results of all studies."""

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
from ramiefenics.results.text import cells, text_columns
from ramiefenics.specification import BendingTest, SpecificationError

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True)
class Table:
    """A table of a result.

    Attributes
    ----------
    data
        Content; the names of columns include units.
    caption
        Caption on the page; a table without one is only in the folder.
    digits
        Significant digits of numbers in the file.
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
        Function that returns a figure, or RGB pixels of shape (height, width, 3).
    caption
        Caption on the page.
    """

    draw: Callable[[], Figure | NDArray[np.uint8]]
    caption: str

    def figure(self) -> Figure:
        """Return it as a Matplotlib figure."""
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
        """Return the content of its PNG file."""
        return _png(self.draw())

    def files(self) -> dict[str, bytes]:
        """Return the contents of its PNG, PDF and SVG files, by the extension of their names.

        A figure made of pixels has only a PNG file.
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
    """Result of a finished study: its findings, and what is needed to continue from there.

    `write_folder` writes it to a folder; printed, it is a page of text.
    """

    SUMMARY: ClassVar[str] = "summary.json"
    """Name of the file with the summary."""

    PLACE: ClassVar[str] = "."
    """Subfolder of the folder of results for all files but those of `write_more`."""

    @property
    @abstractmethod
    def title(self) -> str:
        """Title of the result, in one line."""

    @property
    def overview_first(self) -> bool:
        """Whether the overview comes first, because it is the answer on which findings comment."""
        return False

    @property
    def completed(self) -> bool:
        """Whether the whole study could be carried out."""
        return True

    @abstractmethod
    def findings(self) -> list[str]:
        """Return the findings, one sentence each, the most important first."""

    def notes(self) -> list[str]:
        """Return what users of the findings should know, one sentence each."""
        return []

    @abstractmethod
    def numbers(self) -> dict[str, Any]:
        """Return the numbers of this study for the summary; NaN and infinity become null there."""

    def overview(self) -> pd.DataFrame | None:
        """Return the table that is printed, with few rows and columns; None if there is none."""
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
            Name of the figure, as in `figures`.

        Raises
        ------
        SpecificationError
            If there is no figure of that name.
        """
        figures = self.figures()
        chosen = next(iter(figures), "") if name is None else name
        if chosen not in figures:
            known = f"must be one of {', '.join(figures)}"
            allowed = known if figures else "cannot be drawn: this result has no figures"
            raise SpecificationError("name", chosen, allowed)
        return figures[chosen].figure()

    def specifications(self) -> dict[str, BendingTest]:
        """Return specifications to continue with, by the name of their file."""
        return {}

    def user_files(self) -> list[Path]:
        """Return the user's own Python files that it depends on, except those of laws."""
        return []

    def write_more(self, folder: Path) -> None:  # noqa: B027  most have nothing more
        """Write further files to the folder of results."""

    def summary(self) -> dict[str, Any]:
        """Return findings, numbers and manifest in the types of strict JSON."""
        told = {"findings": self.findings(), "notes": self.notes(), "completed": self.completed}
        own = {"title": self.title, **told, **self.numbers()}
        summary: dict[str, Any] = finite(
            {**own, "folder": self._contents(), "versions": versions()}
        )
        return summary

    def _contents(self) -> dict[str, Any]:
        """Return a description of the folder's content, as far as its files do not show it."""
        overview = self.overview()
        return {
            "result": type(self).__name__,
            "place": self.PLACE,
            "summary": self.SUMMARY,
            "overview": None if overview is None else overview.to_dict("split"),
            "overview_first": self.overview_first,
            "tables": {
                name: {
                    "caption": table.caption,
                    "digits": table.digits,
                    "text": text_columns(table.data),
                }
                for name, table in self.tables().items()
            },
            "figures": {name: picture.caption for name, picture in self.figures().items()},
            "specifications": list(self.specifications()),
            "user_files": [path.name for path in self.user_files()],
        }

    def __repr__(self) -> str:
        """Return title, findings, overview and notes as text."""
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

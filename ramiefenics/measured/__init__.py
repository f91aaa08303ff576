"""Measured force curves, what was bent to get them, and the raw files that they come from."""

import functools
from collections.abc import Sequence
from pathlib import Path

from ramiefenics.measured.columns import TextColumns, read_columns
from ramiefenics.measured.dataset import Dataset, Specimen, read_dataset
from ramiefenics.measured.instron import read_instron
from ramiefenics.measured.layout import Layout
from ramiefenics.measured.noise import noise
from ramiefenics.measured.raw import RawCurve, read_all
from ramiefenics.measured.seating import Seating, seat
from ramiefenics.measured.slope import InitialSlope, initial_slope

__all__ = [
    "Dataset",
    "InitialSlope",
    "Layout",
    "RawCurve",
    "Seating",
    "Specimen",
    "TextColumns",
    "import_columns",
    "import_instron",
    "initial_slope",
    "noise",
    "read_dataset",
    "seat",
]


def import_instron(paths: Sequence[str | Path]) -> dict[str, RawCurve]:
    """Read raw files of Instron's Bluehill, by name; see `read_instron`."""
    return read_all(paths, read_instron)


def import_columns(
    paths: Sequence[str | Path], layout: TextColumns | None = None
) -> dict[str, RawCurve]:
    """Read text files of columns, by name; see `TextColumns` and `read_columns`."""
    layout = TextColumns() if layout is None else layout
    return read_all(paths, functools.partial(read_columns, layout=layout))

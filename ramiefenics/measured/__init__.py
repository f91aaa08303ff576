"""Measured force curves, their specimens, and the raw files from which they come."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from ramiefenics.measured.dataset import Dataset, read_dataset
from ramiefenics.measured.layout import Layout
from ramiefenics.measured.noise import noise
from ramiefenics.measured.raw import RawCurve, read_all
from ramiefenics.measured.readers import READERS, Reader, find_reader, guess_reader, read_raw_file
from ramiefenics.measured.record import Record
from ramiefenics.measured.seating import Seating, seat
from ramiefenics.measured.slope import InitialSlope, initial_slope

__all__ = [
    "READERS",
    "Dataset",
    "InitialSlope",
    "Layout",
    "RawCurve",
    "Reader",
    "Record",
    "Seating",
    "find_reader",
    "guess_reader",
    "initial_slope",
    "noise",
    "read_dataset",
    "read_raw",
    "seat",
]


def read_raw(
    paths: Sequence[str | Path], format: str | Path | None = None, **options: Any
) -> dict[str, RawCurve]:
    """Read raw files of a testing machine.

    Parameters
    ----------
    paths
        Files, of one specimen each or of several.
    format
        A key of `READERS`, or a Python file that defines a `Reader`; by default the first of
        `READERS` that can read the first file.
    options
        Options of the format, for instance ``columns=("time_s", "force_N"),
        speed_mm_per_min=20.0``; see its module in `ramiefenics.measured.readers`.

    Returns
    -------
    dict
        Curves by specimen, which has the name of the file without its suffix. Where two files have
        the same name, that of the folder is put in front; where a file has several specimens,
        theirs are appended.

    Raises
    ------
    SpecificationError
        If there is no such format, if it has no such option, or on the first defect of a file.
    """
    reader = guess_reader(paths, options) if format is None else find_reader(format)
    reader.check_options(options)
    return read_all(paths, lambda path: read_raw_file(reader, path, options))

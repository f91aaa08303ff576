"""Definition of a reader of raw files: a name, and a function from a path to a record."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from ramiefenics.measured.raw import RawCurve, tidy
from ramiefenics.specification import SpecificationError


class OtherFormat(SpecificationError):
    """A file that is not of a reader's format, so that another may be tried."""


@dataclass(frozen=True)
class Reader:
    """Reader of one format of raw files.

    Attributes
    ----------
    name
        Name, one word.
    files
        Origin of files of this format, one sentence.
    read
        Function from a path to a `RawCurve` as recorded, in mm, N and s, or to a list of them if a
        file may have several specimens. Afterwards `tidy` corrects signs, cuts off the unloading,
        and refuses what is not a record of a bending test. The keyword arguments are the options of
        the format; of these the command line has ``columns``, ``speed_mm_per_min`` and ``rate_Hz``.
        Raises `SpecificationError` on a file that it cannot read, and `OtherFormat` if another
        reader may be able to.
    """

    name: str
    files: str
    read: Callable[..., RawCurve | Sequence[RawCurve]]

    def __post_init__(self) -> None:
        """Check the name."""
        if not self.name.isidentifier():
            raise SpecificationError("reader.name", self.name, "must be one word")

    @property
    def options(self) -> tuple[str, ...]:
        """Names of the format's options."""
        return tuple(inspect.signature(self.read).parameters)[1:]

    def check_options(self, given: Mapping[str, Any]) -> None:
        """Check that the format has the given options.

        Raises
        ------
        SpecificationError
            If it does not have one of them; the message names the first.
        """
        for name, value in given.items():
            if name not in self.options:
                allowed = f"must be left out for the format {self.name}, whose files state it"
                raise SpecificationError(name, value, allowed)


def read_raw_file(reader: Reader, path: Path, options: Mapping[str, Any]) -> list[RawCurve]:
    """Return the curves in a file, with compression positive and without unloading.

    Raises
    ------
    SpecificationError
        On the first defect, with file, row and remedy in the message; also if the reader fails.
    """
    try:
        read = reader.read(path, **options)
        curves = [read] if isinstance(read, RawCurve) else [*read]
        curves = [replace(raw, curve=raw.curve.astype(np.float64)) for raw in curves]
    except SpecificationError:
        raise
    except Exception as error:
        reason = f"{type(error).__name__}: {error}"
        allowed = f"cannot be read by the reader {reader.name} ({reason})"
        raise SpecificationError("file", str(path), allowed) from error
    if not curves or not all({"displacement_mm", "force_N"} <= {*raw.curve} for raw in curves):
        allowed = "must return a RawCurve with displacement_mm and force_N"
        raise SpecificationError(f"reader {reader.name}", None, allowed)
    return [tidy(raw) for raw in curves]

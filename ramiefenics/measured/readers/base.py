"""What a reader of raw files is: a function from a path to a record, and a name."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from ramiefenics.measured.raw import RawCurve, tidy
from ramiefenics.specification import SpecificationError


@dataclass(frozen=True)
class Reader:
    """How one format of raw files is read.

    Attributes
    ----------
    name
        One word.
    files
        Whose files these are, one sentence.
    read
        From a path to a `RawCurve` as recorded, in mm, N and s; signs and unloading are seen to
        afterwards (`tidy`), and what is no record of a bending test is refused. Its keyword
        arguments are the format's options; of these the command line has ``columns``,
        ``speed_mm_per_min`` and ``rate_Hz``. Raises `SpecificationError` on a file that it
        cannot read.
    """

    name: str
    files: str
    read: Callable[..., RawCurve]

    def __post_init__(self) -> None:
        """Check the name."""
        if not self.name.isidentifier():
            raise SpecificationError("reader.name", self.name, "must be one word")

    @property
    def options(self) -> tuple[str, ...]:
        """Names of the format's options."""
        return tuple(inspect.signature(self.read).parameters)[1:]

    def check_options(self, given: Mapping[str, Any]) -> None:
        """Check that the format has these options.

        Raises
        ------
        SpecificationError
            Naming the first that it has not.
        """
        for name, value in given.items():
            if name not in self.options:
                allowed = f"must be left out for the format {self.name}, whose files say it"
                raise SpecificationError(name, value, allowed)


def read_raw_file(reader: Reader, path: Path, options: Mapping[str, Any]) -> RawCurve:
    """Return what a file says, compression positive, without unloading.

    Raises
    ------
    SpecificationError
        On the first defect: file, row, and what to do; also if the reader fails.
    """
    try:
        raw = reader.read(path, **options)
        if isinstance(raw, RawCurve):
            raw = replace(raw, curve=raw.curve.astype(np.float64))
    except SpecificationError:
        raise
    except Exception as error:
        reason = f"{type(error).__name__}: {error}"
        allowed = f"cannot be read by the reader {reader.name} ({reason})"
        raise SpecificationError("file", str(path), allowed) from error
    if not isinstance(raw, RawCurve) or not {"displacement_mm", "force_N"} <= {*raw.curve}:
        allowed = "must return a RawCurve with displacement_mm and force_N"
        raise SpecificationError(f"reader {reader.name}", None, allowed)
    return tidy(raw)

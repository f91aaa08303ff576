"""One test of one specimen: its specification and its measured curve."""

from __future__ import annotations

import logging
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
import pandas as pd

from ramiefenics.measured.curve_file import read_curve
from ramiefenics.measured.layout import Layout
from ramiefenics.measured.noise import Array
from ramiefenics.measured.seating import seat, straight_part
from ramiefenics.specification import BendingTest, SpecificationError

log = logging.getLogger(__name__)

REDUCED = "slopes and strengths are"
"""Reason in the message that refuses other fixtures, see `Arrangement.check_beam`."""

POINTS = 28
"""Number of displacements at which a curve is compared.

Noise is correlated over about one of the intervals between them.
"""


@dataclass(frozen=True)
class Record:
    """One test of one specimen.

    Attributes
    ----------
    name
        Unique name; that of the specimen if it was tested once.
    specimen
        Name of the specimen.
    test
        Baseline with the geometry and covariates of this specimen and the conditions of this test.
    curve
        Loading: ``displacement_mm``, ascending, ``force_N``, and ``time_s`` if known.
    range_mm
        Displacements between which the curve is compared.
    row
        Cells of `specimens.csv`, and of `tests.csv` if there is one, by column, as text.
    straight_mm
        Start and end of the straight part whose line was used to zero the displacement; None if
        there was none.
    after
        Rows after the loading (`test.protocol.then`), as recorded; empty if there are none.
    """

    name: str
    specimen: str
    test: BendingTest
    curve: pd.DataFrame
    range_mm: tuple[float, float] = (0.0, 0.0)
    row: Mapping[str, str] = field(default_factory=dict)
    after: pd.DataFrame = field(default_factory=pd.DataFrame)
    straight_mm: tuple[float, float] | None = None

    @property
    def at_mm(self) -> Array:
        """Equidistant displacements at which the curve is compared, shape (POINTS,)."""
        low, high = self.range_mm
        return np.asarray(low + (high - low) * (np.arange(POINTS) + 1.0) / POINTS)


def read_record(
    place: str,
    names: tuple[str, str],
    test: BendingTest,
    path: Path,
    layout: Layout,
    row: Mapping[str, str],
) -> Record:
    """Read the curve of a test.

    Parameters
    ----------
    place
        Place where the test is listed, for error messages.
    names
        Names of the record and of its specimen.
    test
        Specification of the test.
    path
        File of the curve.
    layout
        Contents of `dataset.toml`.
    row
        Cells of the test by column, see `Record`.

    Raises
    ------
    SpecificationError
        On the first defect.
    """
    follows = bool(test.protocol.then)
    recorded, after = read_curve(path, layout, follows)
    try:
        curve = seat(recorded, layout.seating)
    except SpecificationError as error:
        raise error.inside(place) from error
    _check_sizes(place, test, curve)
    end = float(curve["displacement_mm"].iloc[-1])
    if follows:
        columns = ["displacement_mm", "force_N"]
        after[columns] += curve[columns].iloc[-1] - recorded[columns].iloc[-1]
        test = replace(test, protocol=replace(test.protocol, travel_mm=end))
    log.info("%s: %d rows to %.3f mm", names[0], len(curve), end)
    high = end if layout.to_mm is None else layout.to_mm
    straight = straight_part(recorded, layout.seating)
    return Record(*names, test, curve, (layout.from_mm, high), row, after, straight)


def _check_sizes(place: str, test: BendingTest, curve: pd.DataFrame) -> None:
    """Check that no unit has been mistaken for another.

    Nothing is bent farther than the supports are apart. No plant fibre carries more than 2 GPa
    (flax, among the strongest, 1.3 GPa: Baley 2002); the nominal stress P L / 4 W is that of a
    section without a void.
    """
    beam, stalk = test.fixture.check_beam(REDUCED), test.stalk
    span, arms = beam.supports_mm, 2.0 * beam.arm_mm
    width, height = stalk.outer_diameter_mm, stalk.height_mm
    reach, peak = float(np.ptp(curve["displacement_mm"])), float(curve["force_N"].max())
    for what, value, least, most in (
        ("outer diameter in mm", width, span / 1000.0, span),
        ("height in mm", height, span / 1000.0, span),
        ("range of displacement in mm", reach, 0.0, span),
        ("nominal stress in MPa", 8.0 * peak * arms / (np.pi * width * height**2), 0.0, 2000.0),
    ):
        if not least <= value <= most:
            allowed = f"must be between {least:g} and {most:g}; check units, span and section"
            raise SpecificationError(f"{place}, {what}", round(value, 6), allowed)

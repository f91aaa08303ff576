"""One test of one specimen: its specification, and its curve as measured."""

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
"""What fixtures of data sets are for."""

POINTS = 28
"""Displacements at which curves are compared: noise is correlated over about one such interval."""


@dataclass(frozen=True)
class Record:
    """One test of one specimen.

    Attributes
    ----------
    name
        Its own; the specimen's if that was tested once.
    specimen
        Name of what was tested.
    test
        The baseline with this specimen's geometry and covariates, and this test's conditions.
    curve
        ``displacement_mm``, ascending, ``force_N``, and ``time_s`` if known.
    range_mm
        Displacements between which it is compared.
    row
        Cells of `specimens.csv`, and of `tests.csv` if there is one, by column, as text.
    straight_mm
        Where the part of the curve begins and ends by whose line the displacement was zeroed; None
        if it was not.
    after
        Rows of what follows the loading (`test.protocol.then`), as recorded; empty if nothing does.
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
        """Displacements at which it is compared, equidistant, shape (POINTS,)."""
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
    """Read a test's curve.

    Parameters
    ----------
    place
        Where it is listed, for errors.
    names
        Of the record and of its specimen.
    test
        Its specification.
    path
        Of the curve.
    layout
        What `dataset.toml` says.
    row
        Its cells.

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
    """Check that no unit is taken for another.

    Nothing is bent farther than the supports are apart. No plant's fibre carries more than 2 GPa
    (flax, among the strongest, 1.3 GPa: Baley 2002); P L / 4 W is for the section without void.
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

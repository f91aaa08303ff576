"""What the headers of raw files state about specimens and supports."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

from ramiefenics.measured.raw import RawCurve
from ramiefenics.measured.readers.header import (
    OUTER_DIAMETER,
    SPAN,
    VOID_DIAMETER,
    Quantity,
    stated,
)
from ramiefenics.measured.readers.naming import has_term
from ramiefenics.published.citation import STUDY
from ramiefenics.specification import BendingTest, Fixture


@dataclass
class FromFiles:
    """Values that are taken from raw files.

    Attributes
    ----------
    columns
        Columns of `specimens.csv` in mm, by name and by specimen.
    layout
        Tables of `dataset.toml`.
    told
        A sentence on the origin of each value.
    """

    columns: dict[str, dict[str, float]] = field(default_factory=dict)
    layout: dict[str, dict[str, Any]] = field(default_factory=dict)
    told: list[str] = field(default_factory=list)

    def add_column(self, name: str, key: str, values: dict[str, float]) -> None:
        """Add a column that has the values of a key of the specification."""
        self.columns[name] = values
        self.layout.setdefault("specimens", {})[key] = name


def take_stated(curves: Mapping[str, RawCurve], test: BendingTest, baseline: str) -> FromFiles:
    """Return the diameters and spans that the headers of raw files state.

    Parameters
    ----------
    curves
        Curves by specimen.
    test
        Baseline specification of the specimens.
    baseline
        Its file or name.
    """
    taken = FromFiles()
    _take_diameters(taken, curves, test)
    if isinstance(test.fixture, Fixture):
        _take_span(taken, curves, test.fixture.span_mm)
    ramie = "" if baseline.endswith(".toml") else f": ramie's constants (Tables 3 and 7 of {STUDY})"
    parts = "moduli, densities, inner layers, radii and friction"
    taken.told.append(f"all else, such as {parts}, is that of the baseline {baseline}{ramie}")
    return taken


def _take_diameters(taken: FromFiles, curves: Mapping[str, RawCurve], test: BendingTest) -> None:
    outermost, size = test.stalk.layers[-1].name, test.stalk.outer_diameter_mm
    values, where = _agreed(curves, OUTER_DIAMETER)
    if values:
        key = f"stalk.layers.{outermost}.outer_diameter_mm"
        taken.add_column("outer_diameter_mm", key, values)
        taken.told.append(f"the outer diameters of {outermost} are taken from {where} in the files")
    else:
        told = where or f"no diameter {_others(curves, OUTER_DIAMETER)}in the files"
        taken.told.append(f"{told}: all specimens have that of the baseline, {size:g} mm")
    values, where = _agreed(curves, VOID_DIAMETER)
    if values:
        taken.add_column("void_diameter_mm", "stalk.void_diameter_mm", values)
        taken.told.append(f"the diameters of the void are taken from {where} in the files")
    elif where:
        taken.told.append(f"{where}: the void is that of the baseline")


def _take_span(taken: FromFiles, curves: Mapping[str, RawCurve], span_mm: float) -> None:
    values, where = _agreed(curves, SPAN)
    different = sorted({*values.values()})
    if len(different) > 1:
        taken.add_column("span_mm", "fixture.span_mm", values)
        ends = f"{different[0]:g} to {different[-1]:g} mm"
        taken.told.append(f"the spans, {ends}, are taken from {where} in the files")
    elif values:
        taken.layout["fixture"] = {"span_mm": different[0]}
        taken.told.append(f"the span of {different[0]:g} mm is taken from {where} in the files")
    else:
        told = f"the span is that of the baseline, {span_mm:g} mm"
        taken.told.append(f"{where}: {told}" if where else told)


def _agreed(curves: Mapping[str, RawCurve], quantity: Quantity) -> tuple[dict[str, float], str]:
    """Return the values by specimen, and the keys; or no values, and why not if there are any."""
    found = {name: stated(raw.header, quantity) for name, raw in curves.items()}
    keys = _quoted(key for values in found.values() for key in values)
    for name, values in found.items():
        if len({*values.values()}) > 1:
            several = " and ".join(f"{key!r} = {value:g} mm" for key, value in values.items())
            return {}, f"{curves[name].path.name} states {several}, none of which is used"
    if not all(found.values()):
        count = sum(map(bool, found.values()))
        return {}, keys and f"only {count} of {len(found)} specimens have {keys} in their files"
    return {name: next(iter(values.values())) for name, values in found.items()}, keys


def _others(curves: Mapping[str, RawCurve], quantity: Quantity) -> str:
    """Return which keys have a term of a quantity, but are not taken for it."""
    every = (key for raw in curves.values() for key in raw.header)
    keys = _quoted(key for key in every if has_term(key, quantity.terms))
    return keys and f"of the specimens, only {keys}, "


def _quoted(keys: Iterable[str]) -> str:
    return ", ".join(repr(key) for key in dict.fromkeys(keys))

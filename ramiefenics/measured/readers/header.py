"""Header of a raw file: keys and values, and the lengths and speeds among them."""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from ramiefenics.measured.readers.naming import has_term, known_unit, last_unit, split_unit
from ramiefenics.measured.readers.words import (
    DIAMETERS,
    FIXTURE,
    INNER,
    OTHER_SPANS,
    OTHER_SPEEDS,
    OUTER,
    SPANS,
    SPEEDS,
)
from ramiefenics.measured.tables import UNITS, parse_number

BLANKS = "  "
"""Delimiter of columns that are separated by two or more blanks."""

QUOTED = re.compile(r'"?([^"]+?)"?[,;\t]\s*"([^"]*)"(?:[,;\t]\s*"?([^"]*?)"?)?\s*')
"""Key, quoted value and unit; the key may itself contain commas."""

STATED = re.compile(r"([^,;\t\"]+?)\s*[:=\uff1a]\s*([+-]?\d+(?:[.,]\d+)?)\s*([^\s\d,;\t\"]\S*)?")
"""Key, number and unit with a colon or an equals sign between them."""

NUMBER_AND_UNIT = re.compile(r"([+-]?\d[\d.,]*)\s*([^\s\d]\S*)")


@dataclass(frozen=True)
class Quantity:
    """A quantity that a header may state.

    Attributes
    ----------
    terms
        Terms of which its key has one, see `words`.
    needed
        Further terms of which its key has one; none if empty.
    excluded
        Terms of other quantities, of which its key has none.
    preferred
        Terms by which a key takes precedence over those without.
    unit
        Unit that is used internally.
    """

    terms: tuple[str, ...]
    needed: tuple[str, ...] = ()
    excluded: tuple[str, ...] = ()
    preferred: tuple[str, ...] = ()
    unit: str = "mm"


OUTER_DIAMETER = Quantity(DIAMETERS, (), (*INNER, *FIXTURE), OUTER)
VOID_DIAMETER = Quantity(DIAMETERS, INNER, FIXTURE)
SPAN = Quantity(SPANS, (), OTHER_SPANS)
SPEED = Quantity(SPEEDS, (), OTHER_SPEEDS, unit="mm/min")


def split_line(line: str, delimiter: str) -> list[str]:
    """Return the cells of a line, quoted or not."""
    if delimiter == BLANKS:
        return re.split(r"\s{2,}", line.strip())
    return next(csv.reader([line], delimiter=delimiter, skipinitialspace=True), [])


def read_header(lines: Sequence[str], delimiter: str) -> dict[str, str]:
    """Return the values above a table by key, with the unit in brackets behind the key."""
    found: dict[str, str] = {}
    for line in lines:
        key, value, unit = _entry(line, delimiter)
        if not key or not value:
            continue
        together = NUMBER_AND_UNIT.fullmatch(value)
        if together and not unit and any(known_unit(together[2]) in t for t in UNITS.values()):
            value, unit = together.groups()
        short = key.rpartition(" : ")[2]
        name = f"{short} ({unit})" if unit else short
        number = value.replace(",", ".")
        if "," in value and math.isfinite(parse_number(number)):
            value = number
        found[name if name not in found else f"{key} ({unit})" if unit else key] = value
    return found


def _entry(line: str, delimiter: str) -> list[str]:
    """Return key, value and unit of a line of a header, each of which may be empty."""
    match = STATED.fullmatch(line.strip(" ,;\t#%")) or QUOTED.fullmatch(line)
    parts = match.groups("") if match else [*split_line(line, delimiter), "", "", ""][:3]
    key, value, unit = (part.strip() for part in parts)
    return [key, value, "" if math.isfinite(parse_number(unit)) else unit]


def stated(header: Mapping[str, str], quantity: Quantity) -> dict[str, float]:
    """Return what a header states about a quantity.

    Parameters
    ----------
    header
        Values by key, see `read_header`.
    quantity
        The quantity.

    Returns
    -------
    dict
        Values in the unit that is used internally, by key. Lengths without a unit are in mm.
    """
    found = {}
    for key, text in header.items():
        name, unit = split_unit(key)
        unit = unit or last_unit(name, quantity.unit) or ("mm" if quantity.unit == "mm" else "")
        value = parse_number(text) * UNITS[quantity.unit].get(unit, math.nan)
        wanted = has_term(name, quantity.terms) and not has_term(name, quantity.excluded)
        wanted = wanted and (not quantity.needed or has_term(name, quantity.needed))
        if wanted and 0.0 < value < math.inf:
            found[key] = value
    preferred = {key: value for key, value in found.items() if has_term(key, quantity.preferred)}
    return preferred or found

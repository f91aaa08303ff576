"""Meaning of names in the files of testing machines: terms, units, and quantities of columns."""

from __future__ import annotations

import functools
import re
import unicodedata
from collections.abc import Sequence

from ramiefenics.measured.readers.words import (
    COLUMN_NAMES,
    OTHER_COLUMNS,
    OTHER_UNITS,
    UNIT_SPELLINGS,
)
from ramiefenics.measured.tables import UNITS
from ramiefenics.specification import SpecificationError

MARKED = re.compile(
    r"\s*[(\[\uff08]\s*([^)\]\uff09]*?)\s*[)\]\uff09]\s*$"
    r"|\s*/\s*(\w+(?:/\w+)?)\s*$|\s+in\s+(\w+)\s*$"
)
"""A unit that follows a name: in brackets, after a slash, or after "in"."""

MOST_WORDS = 6
"""Most words of a column's name; what is longer is a sentence."""


@functools.lru_cache(1000)  # more would keep every cell of a long file
def plain(text: str) -> str:
    """Return the words of a text in lower case without accents, with single blanks between them."""
    letters = unicodedata.normalize("NFKD", text.casefold())
    bare = "".join(letter for letter in letters if not unicodedata.combining(letter))
    return " ".join(re.findall(r"[^\W_]+|⌀", bare))


def first_term(text: str, terms: Sequence[str]) -> int | None:
    """Return the index of the first of some terms that a text has, see `words`, or None."""
    there = plain(text)
    return next((index for index, term in enumerate(terms) if _has(there, term)), None)


def has_term(text: str, terms: Sequence[str]) -> bool:
    """Return whether a text has one of some terms."""
    return first_term(text, terms) is not None


def _has(there: str, term: str) -> bool:
    asked = plain(term)
    match term[0]:
        case "=":
            return there == asked
        case "-":
            return any(word.endswith(asked) for word in there.split())
        case "~":
            return asked in there
    return f" {asked} " in f" {there} "


def known_unit(unit: str) -> str:
    """Return a unit in the spelling of `UNITS`, or as it is if it is not known."""
    if any(unit in table for table in UNITS.values()):
        return unit
    return UNIT_SPELLINGS.get(unit.lower(), unit)


def split_unit(name: str) -> tuple[str, str]:
    """Return a name without the unit that is marked in it, and the unit, or ""."""
    match = MARKED.search(name.strip())
    if match is None:
        return name.strip(), ""
    return name.strip()[: match.start()], known_unit(next(filter(None, match.groups()), ""))


def last_unit(name: str, inside: str) -> str:
    """Return the last word of a name if it is a unit of some kind, as in ``force_N``, or "".

    Parameters
    ----------
    name
        Name of several words.
    inside
        Unit of this kind that is used internally, see `UNITS`.
    """
    _, *more = re.split(r"[\s_]+", name.strip())
    unit = known_unit(more[-1]) if more else ""
    return unit if unit in UNITS[inside] else ""


def assign_columns(place: str, names: Sequence[str], units: Sequence[str]) -> dict[str, int]:
    """Return the index of the column of each quantity that is named.

    Parameters
    ----------
    place
        File and row of the names, for errors.
    names
        Names of the columns, with their units or without.
    units
        Units of the columns, or "" where they are not known.

    Returns
    -------
    dict
        Indices by the keys of `COLUMN_NAMES`; empty if force is missing, or both displacement and
        time.

    Raises
    ------
    SpecificationError
        If two columns could equally well be the same quantity.
    """
    found: dict[str, list[int]] = {}
    for name in COLUMN_NAMES:
        if best := _best(name, names, units):
            found[name] = best
    if "force_N" not in found or len(found) < 2:
        return {}
    for indices in found.values():
        if len(indices) > 1:
            bare = list(dict.fromkeys(plain(split_unit(names[index])[0]) for index in indices))
            allowed = "must not occur twice" if len(bare) == 1 else "must not all be in the file"
            raise SpecificationError(f"{place}, column", ", ".join(bare), allowed)
    return {name: indices[0] for name, indices in found.items()}


def _best(quantity: str, names: Sequence[str], units: Sequence[str]) -> list[int]:
    """Return the columns with the first term of a quantity and the fewest words besides it.

    Those in units of another quantity come last; others of the same name are returned as well.
    """
    inside, ranks = quantity.rpartition("_")[2], {}
    bare = [split_unit(name)[0] for name in names]
    for index, name in enumerate(bare):
        if quantities_of(name) == (quantity,):
            rank = first_term(name, COLUMN_NAMES[quantity])
            ranks[index] = (_is_foreign(units[index], inside), rank, len(plain(name).split()))
    best = {plain(bare[index]) for index, rank in ranks.items() if rank == min(ranks.values())}
    return [index for index in ranks if plain(bare[index]) in best]


@functools.lru_cache(1000)
def quantities_of(bare: str) -> tuple[str, ...]:
    """Return the quantities that a column's name, without its unit, may stand for."""
    if len(plain(bare).split()) > MOST_WORDS or has_term(bare, OTHER_COLUMNS):
        return ()
    return tuple(name for name, terms in COLUMN_NAMES.items() if has_term(bare, terms))


def is_quantity(name: str) -> bool:
    """Return whether a column's name has a term of any quantity, known or not."""
    bare, _ = split_unit(name)
    return has_term(bare, OTHER_COLUMNS) or bool(quantities_of(bare))


def _is_foreign(unit: str, inside: str) -> bool:
    """Return whether a unit is known, but as that of another quantity."""
    other = [known for kind, table in UNITS.items() for known in table if kind != inside]
    return unit in other or unit.lower() in OTHER_UNITS

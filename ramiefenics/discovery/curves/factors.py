"""Factors on numbers of the specification, which are fitted before any effect is suspected."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import ClassVar

from ramiefenics.specification import BendingTest, SpecificationError
from ramiefenics.specification.files import value_at
from ramiefenics.specification.replacing import replaced

DIRECTIONS = {
    "axial": ("E_Z_MPa", "G_XZ_MPa"),
    "transverse": ("E_X_MPa", "G_XY_MPa"),
}
"""Elastic constants of a layer that a factor named ``layer.direction`` multiplies."""


@dataclass(frozen=True)
class Factor:
    """A common factor on one or more numbers of the specification.

    Attributes
    ----------
    name
        Name, as in ``fit`` of `dataset.toml`.
    keys
        Dotted keys of these numbers.
    """

    name: str
    keys: tuple[str, ...]

    TYPICAL: ClassVar[float] = 0.1
    """A change of the logarithm that matters."""

    def apply(self, test: BendingTest, log_factor: float) -> BendingTest:
        """Return the specification with these numbers times ``exp(log_factor)``."""
        return apply_factors(test, [self], [log_factor])


def factors(test: BendingTest, names: Sequence[str] = ()) -> tuple[Factor, ...]:
    """Return the factors of the given names; by default axial and transverse for every layer.

    Parameters
    ----------
    test
        A specification that contains all that is named.
    names
        Each is ``layer.axial``, ``layer.transverse`` or a dotted key of the specification.

    Raises
    ------
    SpecificationError
        If a name is none of these.
    """
    layers = [layer.name for layer in test.stalk.layers]
    names = names or [f"{layer}.{direction}" for layer in layers for direction in DIRECTIONS]
    found = []
    for name in names:
        layer, _, direction = name.partition(".")
        keys: tuple[str, ...] = (name,)
        if layer in layers and direction in DIRECTIONS:
            elastic = f"stalk.layers.{layer}.material.elastic"
            keys = tuple(f"{elastic}.{constant}" for constant in DIRECTIONS[direction])
            keys = tuple(key for key in keys if value_at(test, key) is not None)
        for key in keys:
            _number(test, key, name)
        found.append(Factor(name, keys))
    return tuple(found)


def apply_factors(
    test: BendingTest, used: Sequence[Factor], log_factors: Iterable[float]
) -> BendingTest:
    """Return a specification with all factors applied."""
    values: dict[str, float] = {}
    for factor, log_factor in zip(used, log_factors, strict=True):
        for key in factor.keys:
            value = values[key] if key in values else _number(test, key, factor.name)
            values[key] = math.exp(log_factor) * value
    return replaced(test, {tuple(key.split(".")): value for key, value in values.items()})


def _number(test: BendingTest, key: str, name: str) -> float:
    value = value_at(test, key)
    if not isinstance(value, float):
        allowed = "must be layer.axial, layer.transverse, or the key of a number"
        raise SpecificationError("fit", name, allowed)
    return value

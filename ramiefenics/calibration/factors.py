"""Factors of a study: numbers of the specification, in natural and in coded units."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ramiefenics.specification import BendingTest, SpecificationError, override
from ramiefenics.specification.checks import check_choice, check_number
from ramiefenics.specification.explained import unit_of
from ramiefenics.specification.files import value_at

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Factor:
    """A number that a study varies.

    Attributes
    ----------
    name
        Name of one word, such as ``X1``.
    keys
        Dotted keys of the specification, all of which receive the same value.
    low
        Least value, in the unit of the keys.
    high
        Greatest value, in the unit of the keys.
    title
        Description for tables and figures.
    scale
        Scale on which the range is halved and divided into equal steps, and on which the prior is
        flat: ``log`` if equal ratios matter equally, otherwise ``linear``.
    """

    name: str
    keys: tuple[str, ...]
    low: float
    high: float
    title: str = ""
    scale: str = "linear"

    def __post_init__(self) -> None:
        """Check name, keys and range."""
        if not isinstance(self.name, str) or not self.name.isidentifier():
            raise SpecificationError("name", self.name, "must be one word, such as X1")
        if not self.keys or not all(isinstance(key, str) for key in self.keys):
            raise SpecificationError("keys", list(self.keys), "must name at least one number")
        check_number(self, "low")
        check_number(self, "high", above=self.low)
        check_choice(self, "scale", ("linear", "log"))
        if self.scale == "log":
            check_number(self, "low", above=0.0)

    @property
    def label(self) -> str:
        """Name and title, with the unit of the first key."""
        unit = unit_of(self.keys[0])
        name = f"{self.name}: {self.title}" if self.title else self.name
        return f"{name} ({unit})" if unit else name

    def apply(self, test: BendingTest, value: float) -> BendingTest:
        """Return the specification with the factor set to a value in natural units."""
        return override(test, [f"{key}={float(value)!r}" for key in self.keys])

    def baseline(self, test: BendingTest) -> float:
        """Return the value that a specification has; the mean if there are several keys.

        Raises
        ------
        SpecificationError
            If a key does not name a number.
        """
        values = []
        for key in self.keys:
            value = value_at(test, key)
            if not isinstance(value, float):
                raise SpecificationError("keys", key, "must be the key of a number")
            values.append(value)
        return float(np.mean(values))


@dataclass(frozen=True)
class Space:
    """Factors, with the coding that makes them comparable.

    Attributes
    ----------
    factors
        Factors of the study.
    coded_high
        Coded value of `high` of each factor. That of `low` is the negative of it, and that of the
        middle is 0. If it is 1, the range is coded as [-1, 1]; if it is the axial distance alpha of
        a design, no run lies outside the range.
    """

    factors: tuple[Factor, ...]
    coded_high: float = 1.0

    def __post_init__(self) -> None:
        """Check that names are distinct and no key is set twice."""
        names = [factor.name for factor in self.factors]
        keys = [key for factor in self.factors for key in factor.keys]
        for what, several in (("name", names), ("keys", keys)):
            for word in several:
                if several.count(word) > 1:
                    raise SpecificationError(f"factors.{what}", word, "must not occur twice")

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the factors."""
        return tuple(factor.name for factor in self.factors)

    @property
    def _logarithmic(self) -> NDArray[np.bool_]:
        return np.array([factor.scale == "log" for factor in self.factors])

    def _scaled(self, natural: Array) -> Array:
        return np.asarray(np.where(self._logarithmic, np.log(natural), natural))

    @property
    def _middle_and_unit(self) -> tuple[Array, Array]:
        with np.errstate(divide="ignore", invalid="ignore"):
            low = self._scaled(np.array([factor.low for factor in self.factors]))
            high = self._scaled(np.array([factor.high for factor in self.factors]))
        return np.asarray((low + high) / 2.0), np.asarray((high - low) / (2.0 * self.coded_high))

    def natural(self, coded: Array) -> Array:
        """Return coded points in natural units; the last axis is that of the factors."""
        middle, unit = self._middle_and_unit
        scaled = middle + unit * np.asarray(coded)
        with np.errstate(over="ignore"):
            return np.asarray(np.where(self._logarithmic, np.exp(scaled), scaled))

    def coded(self, natural: Array) -> Array:
        """Return natural points in coded units; the last axis is that of the factors."""
        middle, unit = self._middle_and_unit
        return np.asarray((self._scaled(np.asarray(natural)) - middle) / unit)

    def tests(self, baseline: BendingTest, coded: Array) -> list[BendingTest]:
        """Return the specification at each of the coded points, which have shape (n, k).

        Raises
        ------
        SpecificationError
            If the specification does not accept a value; the message names the factor.
        """
        return [self._test(baseline, row) for row in self.natural(coded)]

    def _test(self, test: BendingTest, values: Sequence[float]) -> BendingTest:
        for factor, value in zip(self.factors, values, strict=True):
            # rounded to ten digits, so that points that differ only by rounding errors are equal
            try:
                test = factor.apply(test, float(f"{value:.10g}"))
            except SpecificationError as error:
                where = f"with factors.{factor.name}, {error.field}"
                raise SpecificationError(where, error.value, error.allowed) from error
        return test

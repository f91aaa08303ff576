"""Definition of an effect: a function from specification to specification, and its description."""

from __future__ import annotations

import functools
import inspect
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path

import numpy as np

from ramiefenics.specification import BendingTest, SpecificationError
from ramiefenics.specification.files import value_at
from ramiefenics.specification.user_file import load_objects


@dataclass(frozen=True)
class Companion:
    """A further parameter of an effect, and its prior, which is normal in the logarithm.

    Attributes
    ----------
    name
        Name of the argument of `Effect.apply`.
    unit
        Unit; ``1`` for a pure number.
    median
        Median of the prior, and default of the argument.
    log_sd
        Standard deviation of the logarithm.
    """

    name: str
    unit: str
    median: float
    log_sd: float

    def __str__(self) -> str:
        """Return the value with its 95 % interval."""
        low, high = (self.median * math.exp(by * self.log_sd) for by in (-1.96, 1.96))
        unit = "" if self.unit == "1" else f" {self.unit}"
        return f"{self.name} = {self.median:g}{unit} (95 %: {low:.2g} to {high:.2g}{unit})"


@dataclass(frozen=True)
class Effect:
    """A property of real stalks or machines that the baseline lacks.

    Attributes
    ----------
    name
        Name, one word.
    physics
        Physical description, one sentence.
    reference
        Publication that describes it.
    unit
        Unit of the amplitude; ``1`` for a pure number.
    bounds
        Least and largest amplitude that makes sense.
    typical
        A common amplitude, within the bounds and not zero.
    apply
        Function from a specification and an amplitude to the specification with the effect, which
        is unchanged if the amplitude is zero. Raises `SpecificationError` where the effect has no
        meaning.
    covariates
        For effects by which specimens differ: keys of the specification, by argument of `apply`.
        The zero of these quantities is a matter of convention (a height above ground, an age), so
        it is put at their mean over the specimens of a data set, and `apply` is given that mean.
        Otherwise the effect would also change all specimens alike, as an error of the load cell
        does. A quantity whose zero has a meaning (a distance from midspan) is not a covariate.
    enters
        Place where the effect enters the model, one line.
    companions
        Further parameters, which are as uncertain as the amplitude; see `given`.
    per_specimen
        Whether the amplitude differs from specimen to specimen, as the position on the supports
        does; otherwise all specimens of a batch, or of a machine, share it.
    span_mm
        Span of the tests for which bounds and typical amplitude are stated, to which they are
        proportional; 0, the default, if they are the same for all spans. See `sized`.
    even
        Whether amplitudes of both signs give the same forces, as those of mirror images are. Data
        then tell no more than the size, see `as_found`.
    by_group
        Whether the effect may also be present in one group of tests only (`BendingTest.group`), as
        an error of one of two machines is.
    group
        Group of tests in which alone the effect is present, see `within`; empty for all.
    file
        User's file that defines the effect, set by `load_effects`; None for a shipped effect.
    """

    name: str
    physics: str
    reference: str
    unit: str
    bounds: tuple[float, float]
    typical: float
    apply: Callable[..., BendingTest]
    covariates: Mapping[str, str] = field(default_factory=dict)
    enters: str = ""
    companions: tuple[Companion, ...] = ()
    per_specimen: bool = False
    span_mm: float = 0.0
    even: bool = False
    by_group: bool = False
    group: str = ""
    file: Path | None = None

    def __post_init__(self) -> None:
        """Check name, amplitudes, covariates and companions."""
        if not self.name.isidentifier():
            raise SpecificationError("effect.name", self.name, "must be one word")
        low, high = self.bounds
        if not low <= 0.0 <= high or low == high:
            allowed = "must be a lower and an upper limit, with zero between or equal to one"
            raise SpecificationError(f"effect {self.name}.bounds", self.bounds, allowed)
        if self.typical == 0.0 or not low <= self.typical <= high:
            raise SpecificationError(
                f"effect {self.name}.typical", self.typical, "must be within the bounds, not zero"
            )

        arguments = inspect.signature(self.apply).parameters
        for argument in self.covariates:
            if argument not in arguments:
                allowed = f"must be an argument of apply, which has {', '.join(arguments)}"
                raise SpecificationError(f"effect {self.name}.covariates", argument, allowed)
        for companion in self.companions:
            taken = arguments.get(companion.name)
            if taken is None or taken.default != companion.median:
                allowed = f"must be an argument of apply whose default is {companion.median:g}"
                raise SpecificationError(f"effect {self.name}.companions", companion.name, allowed)

    def given(self, **values: float) -> Effect:
        """Return the effect with given values of its companions in place of their medians.

        Raises
        ------
        SpecificationError
            If it has no companion of that name.
        """
        known = {companion.name for companion in self.companions}
        for name, value in values.items():
            if name not in known:
                names = ", ".join(sorted(known)) or "none"
                allowed = f"is not a companion of this effect; known: {names}"
                raise SpecificationError(f"effect {self.name}.{name}", value, allowed)
        companions = tuple(replace(c, median=values.get(c.name, c.median)) for c in self.companions)
        return replace(self, apply=partial(self.apply, **values), companions=companions)

    def within(self, group: str) -> Effect:
        """Return the effect in the tests of one group only (`BendingTest.group`)."""
        everywhere = self.apply

        @functools.wraps(everywhere)
        def apply(test: BendingTest, amplitude: float, **given: float) -> BendingTest:
            return everywhere(test, amplitude, **given) if test.group == group else test

        name, physics = f"{self.name}_of_{group}", f"{self.physics} Only in the group {group}."
        return replace(self, name=name, physics=physics, apply=apply, by_group=False, group=group)

    @property
    def base_name(self) -> str:
        """Name of the effect without that of its group."""
        return self.name.removesuffix(f"_of_{self.group}") if self.group else self.name

    def acts_on(self, test: BendingTest) -> bool:
        """Return whether a test belongs to the group in which the effect is present."""
        return self.group in ("", test.group)

    def centred(self, tests: Sequence[BendingTest]) -> Effect:
        """Return the effect with its covariates relative to their means over these tests.

        Raises
        ------
        SpecificationError
            If a covariate is not a number in the specification.
        """
        means = {argument: self._mean(key, tests) for argument, key in self.covariates.items()}
        return replace(self, apply=partial(self.apply, **means))

    def sized(self, tests: Sequence[BendingTest]) -> Effect:
        """Return the effect with bounds and typical amplitude for the mean span of these tests."""
        spans = [_span_mm(test) for test in tests]
        if self.span_mm == 0.0 or not all(spans):
            return self
        span = float(np.mean(spans))
        share, (low, high) = span / self.span_mm, self.bounds
        bounds, typical = (share * low, share * high), share * self.typical
        return replace(self, bounds=bounds, typical=typical, span_mm=span)

    def as_found(self, tests: Sequence[BendingTest]) -> Effect:
        """Return the effect with the amplitudes that can be found in data of these tests.

        They are those of `sized`, without negative ones if the effect is even.
        """
        sized = self.sized(tests)
        return replace(sized, bounds=(0.0, sized.bounds[1])) if self.even else sized

    def _mean(self, key: str, tests: Sequence[BendingTest]) -> float:
        values = [value_at(test, key) for test in tests]
        for value in values:
            if not isinstance(value, float):
                allowed = f"must be the key of a number, but its value is {value!r}"
                raise SpecificationError(f"effect {self.name}.covariates", key, allowed)
        return float(np.mean(values))


def _span_mm(test: BendingTest) -> float:
    """Return the distance between the outermost fixed cylinders, mm."""
    places = [cylinder.z_mm for cylinder in test.fixture.cylinders if not cylinder.moves]
    return float(np.ptp(places)) if places else 0.0


def load_effects(path: str | Path) -> dict[str, Effect]:
    """Run a Python file and return the effects that it defines, by name; see `load_objects`."""
    found = load_objects(path, Effect, "effects")
    return {effect.name: replace(effect, file=Path(path)) for effect in found}

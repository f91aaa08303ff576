"""Signatures of suspected effects in all curves, from simulations of a few stalks."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeAlias

import numpy as np
import pandas as pd

from ramiefenics.discovery.blocks import Array
from ramiefenics.discovery.linearised import Model
from ramiefenics.discovery.standing import Place, Standing, slope_of
from ramiefenics.discovery.stepping import Stepping
from ramiefenics.effects import Effect
from ramiefenics.runs import Done
from ramiefenics.runs.curve import normalised
from ramiefenics.specification import BendingTest, SpecificationError
from ramiefenics.surrogate.coordinates import (
    Direction,
    coordinates,
    is_size,
    numbers,
    rest_of,
)

if TYPE_CHECKING:
    from ramiefenics.discovery.prediction import Predictor

DERIVATIVE_SHARE = 0.25
"""Step, relative to the typical amplitude, for the derivative with respect to the amplitude of an
effect that the model contains; for other effects the step is the typical amplitude."""

SHARES = (1.0, 0.5, 0.25, 0.125)
"""Shares of a step that are tried until one is possible."""

SMALL = 1e-3
"""Step, relative to the typical amplitude, that shows what an effect changes in a specification."""


@dataclass(frozen=True)
class Along:
    """Change by an effect that only alters numbers, and all forces in proportion.

    Attributes
    ----------
    direction
        Change of the numbers of the normalised specification, see `normalised`, per typical
        amplitude.
    scale
        Change of the logarithm of the factor on its forces, per typical amplitude.
    """

    direction: Direction
    scale: float

    @classmethod
    def of(cls, effect: Effect, test: BendingTest) -> Along | None:
        """Return the change by an effect; None if it changes more than numbers, or no number.

        None also if it changes a length or a modulus that was zero.
        """
        base, factor = normalised(test)
        moved, moved_factor = normalised(effect.apply(test, SMALL * effect.typical))
        before, after = numbers(base), numbers(moved)
        paths = tuple(path for path in before if before[path] != after.get(path))
        from_zero = any(is_size(path) and before[path] == 0.0 for path in paths)
        alike = before.keys() == after.keys() and rest_of(base) == rest_of(moved)
        if not paths or from_zero or not alike:
            return None
        change = (coordinates(after, paths) - coordinates(before, paths)) / SMALL
        direction = Direction(effect.name, paths, tuple(map(float, change)))
        return cls(direction, float(np.log(moved_factor / factor)) / SMALL)


def signatures(
    predictor: Predictor,
    model: Model,
    raw: Sequence[pd.DataFrame],
    suspects: Mapping[str, Effect],
    smooth: bool,
) -> tuple[dict[str, Array], dict[str, str]]:
    """Return derivatives with respect to amplitudes, and the reasons where there are none.

    Derivatives are in N per unit of the amplitude, shape (r, m). By effects that only alter numbers
    and are not in the model, they are derivatives of the simulation along these numbers; by all
    others, they are finite differences. By errors of the machine, they need no simulation.

    Parameters
    ----------
    predictor
        Predictor of the curves.
    model
        Model around which the curves are linearised.
    raw
        All curves of the model as simulated.
    suspects
        Effects, whether the model contains them or not.
    smooth
        Whether to refuse a stalk that jumps where derivatives are asked for.
    """
    tests = predictor.tests(model)
    without = predictor.tests(dataclasses.replace(model, effects={}))
    moved, steps, refused = _moved(predictor, model, suspects)
    derived_by = moved if predictor.derives else ()
    along = _along(model, tests, {name: suspects[name] for name in derived_by})
    places = [Place.of(test) for test in tests]
    standing = {n: Standing.of(places, [Place.of(test) for test in moved[n]]) for n in along}
    stepping = {n: Stepping.of(without, tests, some) for n, some in moved.items() if n not in along}
    derived, plain = _simulated(predictor, tests, standing, along, stepping, smooth)
    curves = predictor.extrapolated(raw, model)
    force = predictor.read(tests, curves)
    found = {}
    for name in moved:
        effect = suspects[name]
        try:
            if name in along:
                shares = {i: slope_of(derived[i].result(), name) for i in standing[name].chosen}
                slopes = standing[name].changes(curves, shares)
                for slope, curve, change in zip(slopes, curves, along[name], strict=True):
                    slope += change.scale * curve["force_N"].to_numpy()
                found[name] = predictor.slopes_by(tests, curves, force, slopes) / effect.typical
            else:
                after = stepping[name].stepped(raw, lambda test: plain[id(test)].result())
                if name in model.effects:  # only then can its mesh correction be known
                    there = model.changed(effect, model.amplitude(name) + steps[name])
                else:
                    there = model
                moved_force = predictor.read(moved[name], predictor.extrapolated(after, there))
                found[name] = (moved_force - force) / steps[name]
        except SpecificationError as error:
            refused[name] = str(error)
    return found, refused


Answers: TypeAlias = dict[int, Done[pd.DataFrame]]


def _simulated(
    predictor: Predictor,
    tests: Sequence[BendingTest],
    standing: Mapping[str, Standing],
    along: Mapping[str, Sequence[Along]],
    stepping: Mapping[str, Stepping],
    smooth: bool,
) -> tuple[Answers, Answers]:
    """Return curves with derivatives, by index, and without, by identity of the specification.

    All of them are simulated together.
    """
    derived = {}
    for i in sorted({i for name in along for i in standing[name].chosen}):
        directions = (some[i].direction for n, some in along.items() if i in standing[n].chosen)
        derived[i] = predictor.task(tests[i], tuple(directions), smooth)
    plain = {id(t): predictor.task(t) for some in stepping.values() for t in some.simulated}
    done = predictor.runs.map([*derived.values(), *plain.values()])
    number = len(derived)
    return (
        dict(zip(derived, done[:number], strict=True)),
        dict(zip(plain, done[number:], strict=True)),
    )


def _moved(
    predictor: Predictor, model: Model, suspects: Mapping[str, Effect]
) -> tuple[dict[str, list[BendingTest]], dict[str, float], dict[str, str]]:
    """Return specifications with each amplitude changed, the steps, and the reasons for refusals.

    The typical amplitude may be too large for a small specimen; a smaller one is then tried, see
    `first_possible`.
    """
    moved: dict[str, list[BendingTest]] = {}
    steps: dict[str, float] = {}
    refused: dict[str, str] = {}
    for name, effect in suspects.items():

        def tests(step: float, effect: Effect = effect) -> list[BendingTest]:
            return predictor.tests(model.changed(effect, model.amplitude(effect.name) + step))

        try:
            steps[name], moved[name] = first_possible(_step(effect, model), tests)
        except SpecificationError as error:
            refused[name] = str(error)
    return moved, steps, refused


def first_possible(
    step: float, tests: Callable[[float], list[BendingTest]]
) -> tuple[float, list[BendingTest]]:
    """Return the largest share of a step that specifications allow, and these specifications.

    Raises
    ------
    SpecificationError
        The error of the whole step, if no share is possible.
    """
    refused = None
    for share in SHARES:
        try:
            return share * step, tests(share * step)
        except SpecificationError as error:
            refused = refused or error
    assert refused is not None  # there are shares
    raise refused


def _along(
    model: Model, tests: Sequence[BendingTest], suspects: Mapping[str, Effect]
) -> dict[str, list[Along]]:
    """Return the effects that change numbers only, by which derivatives are cheap.

    Effects of the model are left out, because such derivatives would tell little far from their
    amplitudes.
    """
    found = {}
    for name, effect in suspects.items():
        if name not in model.effects:
            changes = [Along.of(effect, test) for test in tests]
            if all(change is not None for change in changes):
                found[name] = [change for change in changes if change is not None]
    return found


def _step(effect: Effect, model: Model) -> float:
    """Return a step of the amplitude that stays within the bounds."""
    if effect.name not in model.effects:
        return effect.typical
    step = DERIVATIVE_SHARE * effect.typical
    low, high = effect.bounds
    return step if low <= model.amplitude(effect.name) + step <= high else -step

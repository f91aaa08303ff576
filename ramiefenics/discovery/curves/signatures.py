"""Signatures of suspected effects in all curves, from simulations of a few stalks."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from ramiefenics.discovery.curves.blocks import Array
from ramiefenics.discovery.curves.linearised import Model
from ramiefenics.discovery.curves.standing import Place, Standing, slope_of
from ramiefenics.discovery.curves.stepping import Stepping
from ramiefenics.effects import Effect
from ramiefenics.runs import Done
from ramiefenics.runs.curve import CurveTask, normalised
from ramiefenics.specification import BendingTest, SpecificationError
from ramiefenics.surrogate.coordinates import (
    Direction,
    coordinates,
    is_size,
    numbers,
    rest_of,
)

if TYPE_CHECKING:
    from ramiefenics.discovery.curves.prediction import Predictor

DERIVATIVE_SHARE, EXACT_SHARE = 0.25, 0.01
"""Steps, relative to the typical amplitude, for the derivative with respect to the amplitude of an
effect that the model contains, and of such an effect that needs no simulation; for other effects
the step is the typical amplitude."""

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


class Signatures:
    """Derivatives with respect to amplitudes, and what is simulated to find them.

    By effects that only alter numbers and are not in the model, they are derivatives of the
    simulation along these numbers; by all others, they are finite differences. By errors of the
    machine, they need no simulation.

    Parameters
    ----------
    predictor
        Predictor of the curves.
    model
        Model around which the curves are linearised.
    suspects
        Effects, whether the model contains them or not.
    smooth
        Whether to refuse a stalk that jumps where derivatives are asked for.

    Attributes
    ----------
    derived, carrying
        Tasks for all curves that are needed. Those of the latter are of representative stalks, and
        may be done without derivatives.
    """

    def __init__(
        self, predictor: Predictor, model: Model, suspects: Mapping[str, Effect], smooth: bool
    ) -> None:
        self._predictor, self._model, self._suspects = predictor, model, suspects
        self._tests = tests = predictor.tests(model)
        without = predictor.tests(dataclasses.replace(model, effects={}))
        moved, self._steps, self._refused = _moved(predictor, model, without, suspects)
        derived_by = moved if predictor.derives else ()
        along = _along(model, tests, {name: suspects[name] for name in derived_by})
        places = [Place.of(test) for test in tests]
        standing = {n: Standing.of(places, [Place.of(test) for test in moved[n]]) for n in along}
        self._stepping = {
            n: Stepping.of(without, tests, some) for n, some in moved.items() if n not in along
        }
        self._moved, self._along, self._standing = moved, along, standing
        self._derived: dict[int, CurveTask] = {}
        for i in sorted({i for name in along for i in standing[name].chosen}):
            directions = (some[i].direction for n, some in along.items() if i in standing[n].chosen)
            self._derived[i] = predictor.task(tests[i], tuple(directions), smooth)
        self._carrying = {
            name: [predictor.carrying(*one) for one in some.simulated]
            for name, some in self._stepping.items()
        }
        self.derived = [*self._derived.values()]
        self.carrying = [task for some in self._carrying.values() for task in some]

    def found(
        self, raw: Sequence[pd.DataFrame], answers: Mapping[CurveTask, Done[pd.DataFrame]]
    ) -> tuple[dict[str, Array], dict[str, str]]:
        """Return derivatives, N per unit, shape (r, m), and the reasons where there are none.

        Parameters
        ----------
        raw
            All curves of the model as simulated.
        answers
            Outcomes of the tasks.
        """
        refused, tests = dict(self._refused), self._tests
        derived = {i: answers[task] for i, task in self._derived.items()}
        curves = self._predictor.mesh_changes.extrapolated(raw, self._model)
        force = self._predictor.read(tests, curves)
        found = {}
        for name in self._moved:
            try:
                if name in self._along:
                    slopes = self._slopes(name, curves, derived)
                    by_typical = self._predictor.slopes_by(tests, curves, force, slopes)
                    found[name] = by_typical / self._suspects[name].typical
                else:
                    simulated = [answers[task].result() for task in self._carrying[name]]
                    after = self._stepping[name].stepped(raw, simulated)
                    found[name] = (self._after(name, after) - force) / self._steps[name]
            except SpecificationError as error:
                refused[name] = str(error)
        return found, refused

    def _slopes(
        self, name: str, curves: Sequence[pd.DataFrame], derived: Mapping[int, Done[pd.DataFrame]]
    ) -> list[Array]:
        """Return derivatives of the indenter's forces, per typical amplitude."""
        standing = self._standing[name]
        shares = {i: slope_of(derived[i].result(), name) for i in standing.chosen}
        slopes = standing.changes(curves, shares)
        for slope, curve, change in zip(slopes, curves, self._along[name], strict=True):
            slope += change.scale * curve["force_N"].to_numpy()
        return slopes

    def _after(self, name: str, curves: Sequence[pd.DataFrame]) -> Array:
        """Return the recorded forces after a step, given the simulated curves, shape (r, m)."""
        there = self._model
        if name in there.effects:  # only then can its mesh correction be known
            effect = self._suspects[name]
            there = there.changed(effect, there.amplitude(name) + self._steps[name])
        return self._predictor.read(
            self._moved[name], self._predictor.mesh_changes.extrapolated(curves, there)
        )


def _moved(
    predictor: Predictor,
    model: Model,
    without: Sequence[BendingTest],
    suspects: Mapping[str, Effect],
) -> tuple[dict[str, list[BendingTest]], dict[str, float], dict[str, str]]:
    """Return specifications with each amplitude changed, the steps, and the reasons for refusals.

    The typical amplitude may be too large for a small specimen; a smaller one is then tried, see
    `first_possible`.
    """
    moved: dict[str, list[BendingTest]] = {}
    steps: dict[str, float] = {}
    refused: dict[str, str] = {}
    for name, effect in suspects.items():

        def stepped(step: float, effect: Effect = effect) -> list[BendingTest]:
            return predictor.tests(model.changed(effect, model.amplitude(effect.name) + step))

        try:
            steps[name], moved[name] = first_possible(_step(effect, model, without), stepped)
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


def needs_simulation(effect: Effect, tests: Sequence[BendingTest]) -> bool:
    """Return whether an effect changes more than the machine and a factor on all moduli."""
    small = SMALL * effect.typical
    return any(normalised(effect.apply(test, small))[0] != normalised(test)[0] for test in tests)


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


def _step(effect: Effect, model: Model, without: Sequence[BendingTest]) -> float:
    """Return a step of the amplitude within the bounds, towards zero if the model has the effect.

    Stalks may jump if the effect is larger. Whether a simulation is needed is seen from stalks
    without effects, because some effects cannot be applied twice.
    """
    if effect.name not in model.effects:
        return effect.typical
    share = DERIVATIVE_SHARE if needs_simulation(effect, without) else EXACT_SHARE
    amplitude, (low, high) = model.amplitude(effect.name), effect.bounds
    step = -math.copysign(share * effect.typical, amplitude)
    return step if low <= amplitude + step <= high else -step

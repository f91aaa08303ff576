"""Signatures of suspected effects in all curves, from simulations of a few stalks."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING

import pandas as pd

from ramiefenics.discovery.curves.blocks import Array
from ramiefenics.discovery.curves.linearised import Model
from ramiefenics.discovery.curves.stepping import Stepping
from ramiefenics.effects import Effect
from ramiefenics.runs import Done
from ramiefenics.runs.curve import CurveTask, normalised
from ramiefenics.specification import BendingTest, SpecificationError

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


class Signatures:
    """Derivatives with respect to amplitudes, and what is simulated to find them.

    They are differences of forces, for errors of the machine without further simulations. If the
    model does not contain an effect, the step is the typical amplitude, because many effects are
    not in proportion to their amplitude: half a damage may do more than twice as much as a quarter.

    Parameters
    ----------
    predictor
        Predictor of the curves.
    model
        Model around which the curves are linearised.
    suspects
        Effects, whether the model contains them or not.

    Attributes
    ----------
    carrying
        Tasks for all curves that are needed, of representative stalks. They may be done without
        derivatives.
    """

    def __init__(self, predictor: Predictor, model: Model, suspects: Mapping[str, Effect]) -> None:
        self._predictor, self._model, self._suspects = predictor, model, suspects
        self._tests = tests = predictor.tests(model)
        without = predictor.tests(dataclasses.replace(model, effects={}))
        self._moved, self._steps, self._refused = _moved(predictor, model, without, suspects)
        self._stepping = {
            name: Stepping.of(without, tests, some) for name, some in self._moved.items()
        }
        self._carrying = {
            name: [predictor.carrying(*one) for one in some.simulated]
            for name, some in self._stepping.items()
        }
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
        refused = dict(self._refused)
        curves = self._predictor.mesh_changes.extrapolated(raw, self._model)
        force = self._predictor.read(self._tests, curves)
        found = {}
        for name, stepping in self._stepping.items():
            try:
                simulated = [answers[task].result() for task in self._carrying[name]]
                after = self._after(name, stepping.stepped(raw, simulated))
                found[name] = (after - force) / self._steps[name]
            except SpecificationError as error:
                refused[name] = str(error)
        return found, refused

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

"""Displacement-controlled implicit stepping to the end of the indenter's travel."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from ramiefenics.model.bending import INDENTER, BendingProblem
from ramiefenics.model.observables import Observables, Observer
from ramiefenics.solve.newton import Newton, NewtonOutcome

EASY_ITERATIONS = 8
"""A step that took no more lets the next one be twice as long."""

UPDATE_LIMIT = 4.0
"""Largest change of a displacement component in one iteration, over the step of the indenter."""

SMALLEST_SCALE_N = 0.01
"""Force to which tolerances refer before there is any."""


@dataclass(frozen=True)
class Step:
    """One converged step.

    Attributes
    ----------
    travel_mm
        Travel of the indenter at its end.
    observables
        What was measured.
    iterations
        Newton iterations, failed attempts excluded.
    save
        Whether the protocol wants full fields here.
    """

    travel_mm: float
    observables: Observables
    iterations: int
    save: bool


@dataclass(frozen=True)
class Failure:
    """Why stepping ended before the end of the travel.

    Attributes
    ----------
    travel_mm
        Last converged travel.
    reason
        One sentence.
    """

    travel_mm: float
    reason: str


class QuasiStatic:
    """Steps a problem forward, adapting the increment in both directions.

    Parameters
    ----------
    problem
        What to solve; its displacement is zero at first.
    observer
        What to measure after each step.

    Attributes
    ----------
    newton_iterations, cut_backs
        Totals so far, failed attempts included.
    failure
        Set when stepping ended early.
    """

    def __init__(self, problem: BendingProblem, observer: Observer) -> None:
        self._problem, self._observer = problem, observer
        self._settings = problem.test.numerics.stepping
        self._newton = Newton(
            problem.residual,
            problem.jacobian,
            problem.solid.displacement,
            problem.bcs,
            self._settings.max_iterations,
        )
        self._force_scale_N = SMALLEST_SCALE_N
        self._u = problem.solid.displacement.x.array
        self._last = self._u.copy()
        self._rate = self._u.copy()  # change per travel in the last step
        self.newton_iterations = 0
        self.cut_backs = 0
        self.failure: Failure | None = None

    def steps(self) -> Iterator[Step]:
        """Yield converged steps until the end of the travel, or until `failure` is set.

        While the caller holds a step, the problem is in its state, slip included.
        """
        settings, protocol = self._settings, self._problem.test.protocol
        travel, increment = 0.0, settings.first_step_mm
        while travel < protocol.travel_mm:
            stop = self._next_stop(travel)
            reaches = travel + increment > stop - settings.min_step_mm
            target = stop if reaches else travel + increment
            outcome = self._attempt(travel, target)
            if not outcome.converged:
                self.cut_backs += 1
                increment = (target - travel) / 2.0
                if increment < settings.min_step_mm:
                    self.failure = self._explain(travel, outcome)
                    return
                continue
            observables = self._observer.observe()
            yield Step(target, observables, outcome.iterations, reaches)
            self._accept(target - travel, observables)
            travel = target
            if outcome.iterations <= EASY_ITERATIONS:
                increment = min(2.0 * increment, settings.max_step_mm)

    def _next_stop(self, travel: float) -> float:
        protocol = self._problem.test.protocol
        done = int((travel + self._settings.min_step_mm) / protocol.save_every_mm)
        return min((done + 1) * protocol.save_every_mm, protocol.travel_mm)

    def _attempt(self, travel: float, target: float) -> NewtonOutcome:
        length = target - travel
        self._problem.contact.place(INDENTER, -length, length)
        if travel == 0.0:
            self._problem.first_guess(length)
        else:
            self._u[:] = self._last + length * self._rate
        outcome = self._newton.solve(
            self._settings.relative_tolerance * self._force_scale_N,
            largest_update_mm=UPDATE_LIMIT * length,
        )
        self.newton_iterations += outcome.iterations
        return outcome

    def _accept(self, length: float, observables: Observables) -> None:
        self._rate[:] = (self._u - self._last) / length
        self._last[:] = self._u
        # of the modelled part, whose residual is measured
        force = observables.force_N / self._problem.factor
        self._force_scale_N = max(force, SMALLEST_SCALE_N)
        self._problem.contact.advance()
        self._problem.contact.update_stabilisation()

    def _explain(self, travel: float, outcome: NewtonOutcome) -> Failure:
        return Failure(
            travel,
            f"no equilibrium found beyond {travel:.3f} mm of travel: in steps down to "
            f"{self._settings.min_step_mm:g} mm, {outcome.reason} (residual "
            f"{outcome.residual_N:.2g} N after {outcome.iterations} iterations)",
        )

"""Displacement-controlled implicit stepping to the end of the travel."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Generic, TypeVar

from ramiefenics.solve.driven import Driven, Observed
from ramiefenics.solve.motion import DampedMotion
from ramiefenics.solve.newton import Newton, NewtonOutcome
from ramiefenics.specification import Protocol, Stepping

EASY_ITERATIONS = 8
"""A step that took more does not let the next one be longer."""

LONGER, SHORTER, SAFETY = 2.0, 0.5, 0.9
"""By which factors the next step may differ, and how far the estimated error is to stay below the
tolerance; a step whose error asks for less than the second factor is taken again."""

UPDATE_LIMIT = 4.0
"""Largest change of a displacement component in one iteration, over the step of the drive."""

SMALLEST_SCALE_N = 0.01
"""Force to which tolerances refer before there is any."""

WORK_SHARE, STORED_SHARE = 0.1, 1e-3
"""A step that loses more than these shares of the drive's work and of the stored energy contains
a jump. The trapezoidal rule, by which the loss is measured, errs by less."""

T = TypeVar("T", bound=Observed)


@dataclass(frozen=True)
class Jump:
    """A motion between two equilibria within one step.

    Attributes
    ----------
    displacement_mm
        Travel after it; it began within the step before.
    energy_released_Nmm
        What stored energy, friction and the material's dissipation leave of the drive's work.
    force_before_N, force_after_N
        Drop of the driving force.
    """

    displacement_mm: float
    energy_released_Nmm: float
    force_before_N: float
    force_after_N: float


@dataclass(frozen=True)
class Step(Generic[T]):
    """One converged step.

    Attributes
    ----------
    travel_mm
        Travel of the drive at its end.
    observables
        What was measured.
    iterations
        Newton iterations, failed attempts excluded.
    save
        Whether the protocol wants full fields here, or nothing follows.
    jump
        The jump in this step, if any.
    """

    travel_mm: float
    observables: T
    iterations: int
    save: bool
    jump: Jump | None = None


@dataclass(frozen=True)
class Ending:
    """Why stepping ended.

    Attributes
    ----------
    kind
        ``completed`` (the whole travel), ``physical`` (what follows is outside the model),
        ``interrupted`` (by the user) or ``not converged``.
    reason
        One sentence; empty if completed.
    """

    kind: str
    reason: str = ""


class QuasiStatic(Generic[T]):
    """Steps a structure forward, adapting the increment in both directions.

    Where the shortest steps find no equilibrium, or one that only a loss of energy leads to, the
    structure is let move to where it rests.

    Parameters
    ----------
    problem
        What to solve; its displacement is zero at first.
    observe
        Measures it after each step.
    protocol, settings
        How far, and in what steps.

    Attributes
    ----------
    newton
        Solves each step.
    newton_iterations, cut_backs
        Totals so far, failed attempts included.
    ending
        Why stepping ended, once it has.
    """

    def __init__(
        self, problem: Driven, observe: Callable[[], T], protocol: Protocol, settings: Stepping
    ) -> None:
        self._problem, self._observe = problem, observe
        self._protocol, self._settings = protocol, settings
        self.newton = Newton(
            problem.residual,
            problem.jacobian,
            problem.displacement,
            problem.bcs,
            settings.max_iterations,
            settings.linear_solver,
        )
        self._motion: DampedMotion | None = None  # most structures never need it
        self._u = problem.displacement.x.array
        self._last = self._u.copy()
        self._rate = self._u.copy()  # change per travel in the last step
        self._measured: T = observe()
        self._slope = self._last_length = 0.0
        self.newton_iterations = 0
        self.cut_backs = 0
        self.ending: Ending | None = None

    def steps(self) -> Iterator[Step[T]]:
        """Yield the state before the first step, then converged steps, until `ending` is set.

        While the caller holds a step, the problem is in its state, slip included.
        """
        settings = self._settings
        yield Step(0.0, self._measured, 0, save=False)
        travel, increment = 0.0, settings.first_step_mm
        while self.ending is None:
            stop = self._next_stop(travel)
            equal = math.ceil((stop - travel) / increment - 1e-9)  # steps to the stop
            length = (stop - travel) / equal
            target = stop if equal == 1 else travel + length
            step = self._step(travel, target, equal == 1)
            if step is None:
                self.cut_backs += 1
                increment = length / 2.0
                continue
            factor = self._factor(length, step)
            if factor < SHORTER and length / 2.0 >= settings.min_step_mm:
                self.cut_backs += 1
                self.ending = None
                increment = length / 2.0
                continue
            yield step
            self._accept(length, step)
            travel = target
            increment = min(max(factor, SHORTER) * length, settings.max_step_mm)
            increment = max(increment, settings.min_step_mm)

    def _factor(self, length: float, step: Step[T]) -> float:
        """Return how much longer the next step may be, by the error of this one.

        The error is that of a straight line between the ends of the step, estimated by what the
        force differs by from its linear extrapolation (Milne's device): for a second derivative f''
        the former is ``length^2 f'' / 8``, the latter ``length (length + last length) f'' / 2``.
        """
        force, travel = step.observables.force_N, step.travel_mm
        longest = LONGER if step.iterations <= EASY_ITERATIONS else 1.0
        if self._last_length == 0.0 or step.jump is not None:
            return longest
        slope = self._slope
        predicted = self._measured.force_N + slope * length
        error = abs(force - predicted) * length / (4.0 * (length + self._last_length))
        # the force at the end of the travel, if it grew along its secant
        scale = abs(force) * self._protocol.travel_mm / travel
        allowed = self._settings.force_tolerance * scale
        return min(longest, SAFETY * math.sqrt(allowed / error)) if error > 0.0 else longest

    def _step(self, travel: float, target: float, save: bool) -> Step[T] | None:
        """Take a step, or find that it must be shorter; set `ending` if nothing follows."""
        length = target - travel
        shortest = length / 2.0 < self._settings.min_step_mm
        outcome = self._attempt(travel, length)
        smooth = False
        if outcome.converged:
            measured = self._observe()
            if measured.misses_contact and not shortest:
                return None
            jump = self._jump(target, length, measured)
            smooth = jump is None
        if not smooth:
            if not shortest:
                return None
            outcome = self._settle()
            if not outcome.converged:
                self.ending = Ending("not converged", _explain(travel, target, outcome))
                return None
            measured = self._observe()
            jump = self._jump(target, length, measured)
        self.ending = self._ending(target, measured)
        save = save or self.ending is not None
        return Step(target, measured, outcome.iterations, save, jump)

    def _next_stop(self, travel: float) -> float:
        protocol = self._protocol
        done = int(travel / protocol.save_every_mm + 1e-9)
        return min((done + 1) * protocol.save_every_mm, protocol.travel_mm)

    def _attempt(self, travel: float, length: float) -> NewtonOutcome:
        """Seek the equilibrium that continues the path."""
        self._problem.place(length, length / self._protocol.speed_mm_per_s)
        if travel == 0.0:
            self._problem.first_guess(length)
        else:
            self._u[:] = self._last + length * self._rate
        outcome = self.newton.solve(self._tolerance_N, UPDATE_LIMIT * length)
        self.newton_iterations += outcome.iterations
        return outcome

    def _settle(self) -> NewtonOutcome:
        """Let the structure move from its last accepted state to where it rests."""
        self._u[:] = self._last
        limit = UPDATE_LIMIT * self._settings.max_step_mm
        if self._motion is None:
            self._motion = DampedMotion(self._problem, self.newton)
        outcome = self._motion.settle(self._tolerance_N, limit)
        self.newton_iterations += outcome.iterations
        return outcome

    @property
    def _tolerance_N(self) -> float:
        force = abs(self._measured.force_N) / self._problem.factor
        return self._settings.relative_tolerance * max(force, SMALLEST_SCALE_N)

    def _jump(self, travel: float, length: float, measured: T) -> Jump | None:
        before = self._measured
        work = (before.force_N + measured.force_N) / 2.0 * length
        stored = measured.stored_energy_Nmm - before.stored_energy_Nmm
        rubbed = measured.friction_work_Nmm - before.friction_work_Nmm
        dissipated = measured.dissipated_Nmm - before.dissipated_Nmm
        released = work - stored - rubbed - dissipated
        least = max(WORK_SHARE * abs(work), STORED_SHARE * measured.stored_energy_Nmm)
        if released <= least or before.force_N == 0.0:  # the rule is no good for the first touch
            return None
        return Jump(travel, released, before.force_N, measured.force_N)

    def _ending(self, travel: float, measured: T) -> Ending | None:
        reason = measured.physical_end()
        if reason is not None:
            return Ending("physical", f"{reason}, at {travel:.3f} mm of travel")
        return Ending("completed") if travel >= self._protocol.travel_mm else None

    def _accept(self, length: float, step: Step[T]) -> None:
        # the direction of a jump does not tell that of the path behind it
        self._rate[:] = 0.0 if step.jump else (self._u - self._last) / length
        self._slope = (step.observables.force_N - self._measured.force_N) / length
        self._last_length = length
        self._last[:] = self._u
        self._measured = step.observables
        self._problem.accept()


def _explain(travel: float, target: float, outcome: NewtonOutcome) -> str:
    return (
        f"no equilibrium found beyond {travel:.3f} mm of travel: in a step of "
        f"{target - travel:.3g} mm, {outcome.reason} (residual {outcome.residual_N:.2g} N after "
        f"{outcome.iterations} iterations)"
    )

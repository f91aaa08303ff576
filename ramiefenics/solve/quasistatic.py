"""Displacement-controlled implicit stepping along the path of the drive."""

from __future__ import annotations

import logging
import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Generic, TypeVar

import numpy as np

from ramiefenics.solve.driven import Driven, Observed
from ramiefenics.solve.newton import Newton, NewtonOutcome
from ramiefenics.solve.path import PathSegment, segments
from ramiefenics.solve.relaxation import DynamicRelaxation
from ramiefenics.solve.repeating import Repeating, Solve
from ramiefenics.solve.solutions import Solutions
from ramiefenics.specification import Protocol, Stepping

log = logging.getLogger(__name__)

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
    travel_mm, time_s
        Travel of the drive, and time, at its end.
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
    time_s: float
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
        ``completed`` (the whole path), ``physical`` (what follows is outside the model),
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
        Along what path, and in what steps.
    jumps
        Whether it may move; else it ends there, not converged.
    solutions
        Those of the same run, as far as it got before; new ones are added.

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
        self,
        problem: Driven,
        observe: Callable[[], T],
        protocol: Protocol,
        settings: Stepping,
        jumps: bool = True,
        solutions: Solutions | None = None,
    ) -> None:
        self._problem, self._observe, self._jumps = problem, observe, jumps
        self._protocol, self._settings = protocol, settings
        self.newton = Newton(problem.equations, settings.max_iterations, settings.linear_solver)
        self._repeating = Repeating(problem, self.newton, solutions)
        self._motion: DynamicRelaxation | None = None  # most structures never need it
        self._u = problem.displacement.x.array
        self._last = self._u.copy()
        self._rate = np.zeros_like(
            self._u
        )  # change in the last step, per travel or in a hold per time
        self._measured: T = observe()
        self._slope = self._last_length = 0.0
        self._largest_N = self._work_Nmm = 0.0  # so far; in the last step that was none of a hold
        self._segment: PathSegment  # where the drive is
        self.newton_iterations = 0
        self.cut_backs = 0
        self.ending: Ending | None = None

    def steps(self) -> Iterator[Step[T]]:
        """Yield the state before the first step, then converged steps, until `ending` is set.

        While the caller holds a step, the problem is in its state, slip included.
        """
        yield Step(0.0, 0.0, self._measured, 0, save=False)
        for segment in segments(self._protocol, self._settings):
            self._enter(segment)
            yield from self._follow(segment)
            if self.ending is not None:
                return

    def _enter(self, segment: PathSegment) -> None:
        """Forget what a leg of the other kind, or one that lifted off, has told of the next."""
        lifted = self._measured.force_N <= 0.0
        if not segment.is_first and (lifted or segment.holds != self._segment.holds):
            self._rate[:] = 0.0
            self._slope = self._last_length = 0.0
        self._segment = segment

    def _follow(self, segment: PathSegment) -> Iterator[Step[T]]:
        """Yield the steps of a leg."""
        turns = not (segment.is_first or segment.holds) and self._measured.force_N > 0.0
        at, increment = 0.0, segment.shortest if turns else segment.first  # as friction turns
        while self.ending is None and at < segment.length:
            target, stops = segment.next_step(at, increment)
            length = target - at
            step = self._step(at, target, stops)
            if step is None:
                log.info("step to %.4f mm cut", self._segment.travel_mm(target))
                self.cut_backs += 1
                increment = length / 2.0
                continue
            factor = self._factor(length, step)
            if factor < SHORTER and length / 2.0 >= segment.shortest:
                log.info("step to %.4f mm cut: the force bends", step.travel_mm)
                self.cut_backs += 1
                self.ending = None
                increment = length / 2.0
                continue
            force = step.observables.force_N
            log.info("%.4f mm: %.4f N, %d iterations", step.travel_mm, force, step.iterations)
            yield step
            self._accept(length, step)
            at = target
            increment = min(max(factor, SHORTER) * length, segment.longest)
            increment = max(increment, segment.shortest)

    def _factor(self, length: float, step: Step[T]) -> float:
        """Return how much longer the next step may be, by the error of this one.

        The error is that of a straight line between the ends of the step, estimated by what the
        force differs by from its linear extrapolation (Milne's device): for a second derivative f''
        the former is ``length^2 f'' / 8``, the latter ``length (length + last length) f'' / 2``.
        """
        force = step.observables.force_N
        longest = LONGER if step.iterations <= EASY_ITERATIONS else 1.0
        if self._last_length == 0.0 or step.jump is not None:
            return longest
        predicted = self._measured.force_N + self._slope * self._change(length)
        error = abs(force - predicted) * length / (4.0 * (length + self._last_length))
        if self._segment.is_first:  # the force at its end, if it grew along its secant
            scale = abs(force) * self._protocol.travel_mm / step.travel_mm
        else:
            scale = self._largest_N
        allowed = self._settings.force_tolerance * scale
        return min(longest, SAFETY * math.sqrt(allowed / error)) if error > 0.0 else longest

    def _step(self, at: float, target: float, save: bool) -> Step[T] | None:
        """Take a step, or find that it must be shorter; set `ending` if nothing follows."""
        length, travel = target - at, self._segment.travel_mm(target)
        shortest = length / 2.0 < self._segment.shortest
        outcome = self._attempt(length)
        smooth = False
        if outcome.converged:
            measured = self._observe()
            if self._misses(measured) and not shortest:
                log.info("a cylinder is not felt")
                return None
            jump = self._jump(travel, length, measured)
            smooth = jump is None
        if not smooth:
            if not shortest:
                return None
            if not self._jumps:
                self.ending = Ending("not converged", f"no equilibrium near {travel:.4f} mm")
                return None
            outcome = self._relax(length)
            if not outcome.converged:
                before = self._segment.travel_mm(at)
                self.ending = Ending("not converged", _explain(before, travel, outcome))
                return None
            measured = self._observe()
            jump = self._jump(travel, length, measured)
        self.ending = self._ending(target, measured)
        save = save or self.ending is not None
        time_s = self._segment.start_s + self._segment.duration_s(target)
        return Step(travel, time_s, measured, outcome.iterations, save, jump)

    def _change(self, length: float) -> float:
        """Return by what travel, mm, or in a hold by what time, s, a step changes."""
        return length if self._segment.holds else self._segment.direction * length

    def _attempt(self, length: float) -> NewtonOutcome:
        """Seek the equilibrium that continues the path."""
        push = self._segment.direction * length
        self._problem.place(push, self._segment.duration_s(length))
        self._start(length)
        self._u[:] += self._change(length) * self._rate
        limit = UPDATE_LIMIT * (abs(push) or self._settings.max_step_mm)
        outcome = self._solved(lambda on_way: self.newton.solve(self._tolerance_N, limit))
        if not outcome.converged:
            log.info("no equilibrium: %s, residual %.2e N", outcome.reason, outcome.residual_N)
        return outcome

    def _start(self, length: float) -> None:
        """Go to the last accepted state, or at first to where all cylinders touch."""
        if self._segment.is_first and self._last_length == 0.0:
            self._problem.first_guess(self._segment.direction * length)
        else:
            self._u[:] = self._last

    def _relax(self, length: float) -> NewtonOutcome:
        """Let the structure move from where a step starts to where it rests."""
        self._start(length)
        limit = UPDATE_LIMIT * self._settings.max_step_mm
        if self._motion is None:
            self._motion = DynamicRelaxation(self._problem, self.newton)
        motion = self._motion
        log.info("no equilibrium nearby: the structure is let move")
        return self._solved(lambda on_way: motion.relax(self._tolerance_N, limit, on_way))

    def _solved(self, solve: Solve) -> NewtonOutcome:
        outcome = self._repeating.solved(solve)
        self.newton_iterations += outcome.iterations
        return outcome

    @property
    def _tolerance_N(self) -> float:
        force = abs(self._measured.force_N) / self._problem.factor
        return self._settings.relative_tolerance * max(force, SMALLEST_SCALE_N)

    def _work(self, length: float, measured: T) -> float:
        """Return the drive's work in a step by the trapezoidal rule, N mm."""
        push = self._segment.direction * length
        return (self._measured.force_N + measured.force_N) / 2.0 * push

    def _jump(self, travel: float, length: float, measured: T) -> Jump | None:
        before = self._measured
        work = self._work(length, measured)
        stored = measured.stored_energy_Nmm - before.stored_energy_Nmm
        rubbed = measured.friction_work_Nmm - before.friction_work_Nmm
        dissipated = measured.dissipated_Nmm - before.dissipated_Nmm
        released = work - stored - rubbed - dissipated
        scale = self._work_Nmm if self._segment.holds else work
        least = max(WORK_SHARE * abs(scale), STORED_SHARE * measured.stored_energy_Nmm)
        if released <= least or before.force_N == 0.0:  # the rule is no good for the first touch
            return None
        return Jump(travel, released, before.force_N, measured.force_N)

    def _misses(self, measured: T) -> bool:
        """Return whether the drive has gone into the structure; going back, it may lift off."""
        return self._segment.direction > 0.0 and measured.misses_contact

    def _ending(self, at: float, measured: T) -> Ending | None:
        segment = self._segment
        reason = measured.physical_end()
        if reason is None and self._misses(measured):
            reason = measured.missed_contact()
        if reason is not None:
            return Ending("physical", f"{reason}, at {segment.travel_mm(at):.3f} mm of travel")
        return Ending("completed") if segment.is_last and at >= segment.length else None

    def _accept(self, length: float, step: Step[T]) -> None:
        # the direction of a jump does not tell that of the path behind it
        change = self._change(length)
        if not self._segment.holds:
            self._work_Nmm = self._work(length, step.observables)
        self._rate[:] = 0.0 if step.jump else (self._u - self._last) / change
        self._slope = (step.observables.force_N - self._measured.force_N) / change
        self._largest_N = max(self._largest_N, abs(step.observables.force_N))
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

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
"""Largest number of Newton iterations of a step after which the next one may be longer."""

LONGER, SHORTER, SAFETY = 2.0, 0.5, 0.9
"""Largest and smallest factor between the lengths of successive steps, and the safety factor on the
length that the error estimate allows. A step whose error requires less than the smallest factor is
repeated."""

UPDATE_LIMIT = 4.0
"""Largest change of a displacement component in one iteration, relative to the drive's step."""

SMALLEST_SCALE_N = 0.01
"""Least force to which tolerances refer, used before the structure bears any."""

WORK_SHARE, STORED_SHARE = 0.1, 1e-3
"""Shares of the drive's work and of the stored energy. A step that loses more than both contains a
jump. The error of the trapezoidal rule, which measures the loss, is smaller."""

T = TypeVar("T", bound=Observed)


@dataclass(frozen=True)
class Jump:
    """A motion between two equilibria within one step.

    Attributes
    ----------
    displacement_mm
        Travel at the end of the step in which it occurs.
    energy_released_Nmm
        The drive's work in that step, less the changes of stored energy and friction work and the
        dissipation of the material.
    force_before_N
        Driving force at the beginning of that step.
    force_after_N
        Driving force at the end of that step.
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
        Travel of the drive, and time, at the end of the step.
    observables
        Observables of the converged state.
    iterations
        Newton iterations, failed attempts excluded.
    save
        Whether to save full fields, because the protocol asks for them here or no step follows.
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
        Reason, as one sentence; empty if completed.
    """

    kind: str
    reason: str = ""


class QuasiStatic(Generic[T]):
    """Steps a structure forward, lengthening and shortening the steps as needed.

    Where the shortest step finds no equilibrium, or only one that is reached with a loss of energy,
    the structure is allowed to move until it comes to rest.

    Parameters
    ----------
    problem
        The structure, in its state before the first step.
    observe
        Returns the observables of the current state; called after each step.
    protocol, settings
        Path of the drive, and settings of the stepping.
    jumps
        Whether the structure may move in this way. If not, stepping ends there, not converged.
    solutions
        Solutions stored by an earlier, possibly interrupted run of the same test, to which new ones
        are added.

    Attributes
    ----------
    newton
        Newton solver of the steps.
    newton_iterations, cut_backs
        Totals so far, failed attempts included.
    ending
        Why stepping ended; None until then.
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
        # displacement change in the last step, per mm of travel or, in a hold, per s
        self._rate = np.zeros_like(self._u)
        self._measured: T = observe()
        self._slope = self._last_length = 0.0
        self._largest_N = self._work_Nmm = 0.0  # largest so far; of the last step not in a hold
        self._segment: PathSegment  # leg that the drive is on
        self.newton_iterations = 0
        self.cut_backs = 0
        self.ending: Ending | None = None

    def steps(self) -> Iterator[Step[T]]:
        """Yield the state before the first step, then converged steps, until `ending` is set.

        While the caller processes a step, the problem is in the state of that step, and its slip
        is the slip within that step.
        """
        yield Step(0.0, 0.0, self._measured, 0, save=False)
        for segment in segments(self._protocol, self._settings):
            self._enter(segment)
            yield from self._follow(segment)
            if self.ending is not None:
                return

    def _enter(self, segment: PathSegment) -> None:
        """Begin a leg; after lift-off, or a change to or from a hold, reset the extrapolation."""
        lifted = self._measured.force_N <= 0.0
        if not segment.is_first and (lifted or segment.holds != self._segment.holds):
            self._rate[:] = 0.0
            self._slope = self._last_length = 0.0
        self._segment = segment

    def _follow(self, segment: PathSegment) -> Iterator[Step[T]]:
        """Yield the steps of a leg."""
        turns = not (segment.is_first or segment.holds) and self._measured.force_N > 0.0
        at, increment = 0.0, segment.shortest if turns else segment.first  # friction reverses
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
                log.info("step to %.4f mm cut: the force curve bends too sharply", step.travel_mm)
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
        """Return the largest ratio of the next step to this one that the error of this one allows.

        The error is that of linear interpolation between the ends of the step. It is estimated from
        the difference between the force and its linear extrapolation (Milne's device): if the force
        P has the second derivative P'', the former is ``length^2 P'' / 8``, and the latter
        ``length (length + last length) P'' / 2``.
        """
        force = step.observables.force_N
        longest = LONGER if step.iterations <= EASY_ITERATIONS else 1.0
        if self._last_length == 0.0 or step.jump is not None:
            return longest
        predicted = self._measured.force_N + self._slope * self._change(length)
        error = abs(force - predicted) * length / (4.0 * (length + self._last_length))
        if self._segment.is_first:  # force at the end of the travel, along the secant
            scale = abs(force) * self._protocol.travel_mm / step.travel_mm
        else:
            scale = self._largest_N
        allowed = self._settings.force_tolerance * scale
        return min(longest, SAFETY * math.sqrt(allowed / error)) if error > 0.0 else longest

    def _step(self, at: float, target: float, save: bool) -> Step[T] | None:
        """Take a step, or return None if it fails; set `ending` if no step follows."""
        length, travel = target - at, self._segment.travel_mm(target)
        shortest = length / 2.0 < self._segment.shortest
        outcome = self._attempt(length)
        smooth = False
        if outcome.converged:
            measured = self._observe()
            if self._misses(measured) and not shortest:
                log.info("contact with a cylinder was missed")
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
        """Return the change of travel in a step, mm, or in a hold its duration, s."""
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
        """Restore the last accepted state, or before the first step set the first guess."""
        if self._segment.is_first and self._last_length == 0.0:
            self._problem.first_guess(self._segment.direction * length)
        else:
            self._u[:] = self._last

    def _relax(self, length: float) -> NewtonOutcome:
        """Let the structure move from the start of a step until it comes to rest."""
        self._start(length)
        limit = UPDATE_LIMIT * self._settings.max_step_mm
        if self._motion is None:
            self._motion = DynamicRelaxation(self._problem, self.newton)
        motion = self._motion
        log.info("no equilibrium nearby: starting dynamic relaxation")
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
        if released <= least or before.force_N == 0.0:  # the rule is not valid at first touch
            return None
        return Jump(travel, released, before.force_N, measured.force_N)

    def _misses(self, measured: T) -> bool:
        """Return whether contact was missed; on the way back the drive may lift off."""
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
        # the direction of a jump says nothing about that of the path after it
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

"""Simulations of one family of specifications, and the curves learned from them."""

from __future__ import annotations

import os
from collections.abc import Sequence

import numpy as np
import pandas as pd

from ramiefenics.runs import Done
from ramiefenics.runs.curve import CurveTask, Simulating
from ramiefenics.specification.replacing import Path
from ramiefenics.surrogate.coordinates import Direction
from ramiefenics.surrogate.directions import components, spanning
from ramiefenics.surrogate.family import Array, Family, Run
from ramiefenics.surrogate.question import SMALL, Question
from ramiefenics.surrogate.smoothing import smoothed

TOLERANCE = 0.002
"""Largest error of a learned curve, relative to its peak; a simulation may have a larger one."""

CLOSE_TOLERANCE = TOLERANCE / 4.0
"""Tolerance where a learned curve is to be as good as a simulated one: near a known simulation."""

FIRST = 4
"""Number of runs that must have reached the end before anything is learned."""

WORTHWHILE = 12
"""Number of curves without derivatives up to which they are all simulated, rather than learned from
simulations with derivatives."""

TIME = 2.5
"""Time of a simulation with its derivatives, relative to that without."""

FEW = 0.25
"""Share of curves that may be rough where smooth ones are asked for; these are allowed to jump."""


class Pool:
    """Runs of one family of specifications.

    Parameters
    ----------
    paths
        Paths of the numbers by which these specifications differ.

    Attributes
    ----------
    runs
        Runs so far.
    error
        Largest expected error of the curves learned so far, relative to the peak.
    """

    def __init__(self, paths: tuple[Path, ...]) -> None:
        self._paths = paths
        self._family: Family | None = None
        self._learned_from = 0  # number of runs
        self.runs: list[Run] = []
        self.error = 0.0

    def answer(
        self, tasks: Sequence[CurveTask], tolerance: float = TOLERANCE
    ) -> Simulating[list[Done[pd.DataFrame]]]:
        """Return the outcomes of tasks of this family.

        Where more than a few curves that should be smooth are not, all tasks fail, because the
        others are of no use alone. Of strict tasks, only those fail.

        Parameters
        ----------
        tasks
            Tasks of this family.
        tolerance
            Largest expected error of a curve that is not simulated, relative to its peak.
        """
        questions = [Question.of(task, self._paths) for task in tasks]
        plain = not any(task.factors for task in tasks)
        smooth = plain or all(task.smooth for task in tasks)  # plain ones have no derivatives
        # derivatives are known for the loading only
        one_by_one = tolerance < TOLERANCE or bool(tasks[0].test.protocol.then)
        enough = len(self.runs) + len(tasks) / TIME
        while True:
            unknown = self._unknown(questions, tolerance)
            reasons = {i: self._roughness(question) for i, question in enumerate(questions)}
            strict = (i for i in unknown if tasks[i].strict and tasks[i].factors)
            refused = {i: reasons[i] for i in strict if reasons[i]}
            unknown = {i: error for i, error in unknown.items() if i not in refused}
            if not unknown:
                break
            every = [i for i, why in reasons.items() if why and i not in refused]
            if not plain and smooth and len(every) > FEW * len(questions):
                return [Done(None, reasons[every[0]]) for _ in questions]
            rough = {index: self._forces_known(questions[index]) for index in every}
            if new := [i for i, known in rough.items() if i in unknown and not known]:
                # a jump is simulated once, not once per derivative, which others may tell
                yield from self._simulate([questions[index] for index in new], (), False)
                continue
            directions = self._directions(questions)
            if all(index in rough for index in unknown):
                left = [questions[index] for index in unknown]
                yield from self._simulate(left, directions, False)
                continue
            unknown = {i: error for i, error in unknown.items() if i not in rough}
            if plain and (one_by_one or len(unknown) <= WORTHWHILE or len(self.runs) >= enough):
                yield from self._simulate([questions[index] for index in unknown], (), False)
                continue
            at = np.array([questions[index].at for index in unknown])
            chosen = _spread(at, np.array(list(unknown.values())), len(os.sched_getaffinity(0)))
            indices = list(unknown)
            next_ones = [questions[indices[place]] for place in chosen]
            yield from self._simulate(next_ones, directions, smooth)
        return [
            Done(None, refused[i]) if i in refused else self._answer(question)
            for i, question in enumerate(questions)
        ]

    def has_simulated(self, task: CurveTask) -> bool:
        """Return whether a task of this family has been simulated."""
        return self._run_of(Question.of(task, self._paths)) is not None

    def _unknown(self, questions: Sequence[Question], tolerance: float) -> dict[int, float]:
        """Return the questions that cannot be answered yet, with their expected errors."""
        left = [i for i, question in enumerate(questions) if self._run_of(question) is None]
        travel_mm = questions[0].test.protocol.travel_mm
        family = self._learn(travel_mm) if tolerance > 0.0 else None
        if family is None or not left:
            return dict.fromkeys(left, np.inf)
        errors = family.expected_errors(np.array([questions[i].at for i in left]))
        spanned = [family.spans(questions[i].changes) for i in left]
        errors = np.where(spanned, errors, np.inf)
        unknown = {i: float(e) for i, e in zip(left, errors, strict=True) if e > tolerance}
        if not unknown:
            self.error = max(self.error, float(errors.max()))
        return unknown

    def _learn(self, travel_mm: float) -> Family | None:
        """Return the family learned from the runs; None if these are too few."""
        if self._learned_from < len(self.runs):
            self._learned_from = len(self.runs)
            reached = [run for run in self.runs if run.reaches(travel_mm)]
            enough = len(reached) >= FIRST and any(len(run.along) for run in reached)
            self._family = Family(self.runs, travel_mm) if enough else None
        return self._family

    def _directions(self, questions: Sequence[Question]) -> tuple[Direction, ...]:
        """Return directions that span all differences and changes, see `spanning`."""
        at = np.array([*(q.at for q in questions), *(run.at for run in self.runs)])
        changes = np.concatenate([q.changes for q in questions])
        apart = np.concatenate([at - np.median(at, axis=0), changes])
        return spanning(self._paths, apart, np.abs(at).max(axis=0))

    def _simulate(
        self, chosen: Sequence[Question], directions: tuple[Direction, ...], smooth: bool
    ) -> Simulating[None]:
        tasks = [CurveTask(question.test, directions, smooth) for question in chosen]
        along = components(directions, self._paths)
        answers = yield tasks
        for question, done in zip(chosen, answers, strict=True):
            if done.error is not None:
                nothing = np.zeros(0)
                run = Run(question.at, along, nothing, nothing, nothing, done.error, smooth)
            else:
                x, force, *raw = done.result().to_numpy().T
                slopes = np.array([smoothed(x, force, one) for one in raw]).reshape(-1, len(x))
                run = Run(question.at, along, x, force, slopes)
            self.runs.append(run)

    def _roughness(self, question: Question) -> Exception | None:
        """Return the reason why there is no smooth curve; None if none is known."""
        here = (run.error for run in self.runs if run.smooth and _here(run, question))
        return next((error for error in here if error is not None), None)

    def _forces_known(self, question: Question) -> bool:
        """Return whether a simulation that may jump has succeeded or failed."""
        return any(not run.smooth and _here(run, question) for run in self.runs)

    def _run_of(self, question: Question) -> Run | None:
        for run in reversed(self.runs):
            if not _here(run, question):
                continue
            if run.error is None and run.weights(question.changes) is not None:
                return run
            if run.error is not None and not run.smooth:
                return run
        return None

    def _answer(self, question: Question) -> Done[pd.DataFrame]:
        run = self._run_of(question)
        if run is not None and run.error is not None:
            return Done(None, run.error)
        if run is not None:
            weights = run.weights(question.changes)
            assert weights is not None  # or it would not be this run
            by_changes = weights @ run.by_direction_N
            return Done(question.curve(run.displacement_mm, run.force_N, by_changes))
        family = self._family
        assert family is not None  # or it would be unknown
        step = SMALL * question.changes
        points = np.concatenate([question.at[None], question.at + step, question.at - step])
        force, *moved = family.force_N(points)
        up, down = np.array(moved).reshape(2, -1, len(force))
        x = np.append(0.0, family.at_mm)
        by_changes = np.pad((up - down) / (2.0 * SMALL), ((0, 0), (1, 0)))
        return Done(question.curve(x, np.append(0.0, force), by_changes))


def _here(run: Run, question: Question) -> bool:
    return np.allclose(run.at, question.at, rtol=0.0, atol=1e-10)


def _spread(at: Array, errors: Array, number: int) -> list[int]:
    """Return indices of points with large errors that are far from one another.

    Where all errors are infinite, the first point is the one in the middle.
    """
    scale = np.ptp(at, axis=0)
    places = (at - at.mean(axis=0)) / np.where(scale > 0.0, scale, 1.0)
    size = np.minimum(errors, 1.0)
    if np.all(np.isinf(errors)):
        chosen = [int((places**2).sum(axis=1).argmin())]
    else:
        chosen = [int(size.argmax())]
    while len(chosen) < min(number, len(at)):
        apart = ((places[:, None] - places[chosen]) ** 2).sum(axis=2).min(axis=1)
        score = size * (1.0 - np.exp(-apart))
        if size[score.argmax()] < TOLERANCE or score.max() <= 0.0:
            break
        chosen.append(int(score.argmax()))
    return chosen

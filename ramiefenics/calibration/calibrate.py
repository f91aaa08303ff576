"""A whole study: simulate a design, fit surfaces, meet targets, tell what the data fix."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pandas as pd

from ramiefenics.calibration.campaign import Campaign, Outcome, run_campaign
from ramiefenics.calibration.designs import Design
from ramiefenics.calibration.desirability import Goal, most_desirable, overall
from ramiefenics.calibration.factors import Array, Space
from ramiefenics.calibration.identifiability import (
    Information,
    Profile,
    in_words,
    information,
    profile,
)
from ramiefenics.calibration.misfit import Misfit
from ramiefenics.calibration.optimum import Optimum, find_optimum
from ramiefenics.calibration.posterior import Posterior, draw_posterior
from ramiefenics.calibration.responses import response
from ramiefenics.calibration.selection import select_surface
from ramiefenics.calibration.study import Study, read_study
from ramiefenics.calibration.surface import Surface
from ramiefenics.runs import workers
from ramiefenics.specification import BendingTest


@dataclass(frozen=True)
class Fit:
    """What the targets make of the surfaces.

    Attributes
    ----------
    misfit
        Between surfaces and targets.
    optimum
        Where it is least, and the set of equally good parameters.
    profiles
        Of every factor.
    information
        At the optimum.
    posterior
        Draws, with a flat prior over the region.
    test
        The specification at the optimum.
    confirmation
        That, simulated; None if it has not been.
    """

    misfit: Misfit
    optimum: Optimum
    profiles: tuple[Profile, ...]
    information: Information
    posterior: Posterior
    test: BendingTest
    confirmation: Outcome | None = None


@dataclass(frozen=True)
class Desired:
    """What the wishes make of the surfaces.

    Attributes
    ----------
    surfaces, goals
        The responses that a wish is on.
    best
        The most desirable point; coded, (k,).
    worth
        Overall desirability there; 0 where no point meets all wishes.
    test
        The specification there.
    """

    surfaces: tuple[Surface, ...]
    goals: tuple[Goal, ...]
    best: Array
    worth: float
    test: BendingTest

    def of(self, points: Array) -> Array:
        """Return the overall desirability at coded points, shape (n,)."""
        return overall(self.surfaces, self.goals, points)


@dataclass(frozen=True)
class Calibration:
    """A study that was done.

    Attributes
    ----------
    study
        What was asked.
    baseline
        The specification that factors change.
    space, design
        Factors with their coding, and the runs.
    campaign
        The simulations.
    runs
        One row per run of the design: coded and natural values, responses, ``ending``.
    surfaces
        By response.
    fit
        None if nothing was measured.
    desired
        None if there are no wishes.
    """

    study: Study
    baseline: BendingTest
    space: Space
    design: Design
    campaign: Campaign
    runs: pd.DataFrame
    surfaces: dict[str, Surface]
    fit: Fit | None = None
    desired: Desired | None = None

    @property
    def completed(self) -> bool:
        """Whether all simulations reached the whole travel."""
        return bool((self.runs["ending"] == "completed").all())

    def findings(self) -> list[str]:
        """Return what the study says, one plain sentence each, the most important first."""
        told = [] if self.fit is None else self._optimum_in_words(self.fit)
        if self.fit is not None:
            fit = self.fit
            told += in_words(self.space, fit.profiles, fit.information)
            if not fit.posterior.trusted:
                told.append("The chain that draws the posterior is short: take it as rough.")
            if fit.confirmation is not None and fit.confirmation.ending != "completed":
                told.append(f"The optimum did not complete: {fit.confirmation.ending}.")
        if self.desired is not None:
            told.append(self._desired_in_words(self.desired))
        for run, ending in zip(self.runs["run"], self.runs["ending"], strict=True):
            if ending != "completed":
                told.append(f"Run {run} did not complete: {ending}.")
        return told

    def _optimum_in_words(self, fit: Fit) -> list[str]:
        told = []
        targets, optimum = fit.misfit.targets, fit.optimum
        result = None if fit.confirmation is None else fit.confirmation.result
        for name, value, error, found in zip(
            targets.names, targets.values, targets.errors, optimum.predicted, strict=True
        ):
            what = response(name)
            simulated = (
                "" if result is None else f" (simulated there: {what.of_result(result):.4g})"
            )
            told.append(
                f"The {what.title} was measured as {value:.4g} ± {error:.2g} {what.unit} and is "
                f"{found:.4g} {what.unit} at the optimum{simulated}; {self._range(name)}."
            )
        if optimum.met:
            told.append(
                f"{100.0 * optimum.share:.3g} % of the region meets the targets as well as the "
                "optimum does, within the errors (95 %)."
            )
        else:
            told.append(
                "No point of the region meets the targets within their errors: the factors do not "
                "reach that far, or the model is wrong. What is left at the nearest point counts "
                "as an error of the model in what follows."
            )
        return told

    def _desired_in_words(self, desired: Desired) -> str:
        if desired.worth == 0.0:
            return "No point of the region meets all wishes: its desirability is 0 everywhere."
        at = self.space.natural(desired.best)
        values = ", ".join(f"{n} = {v:.4g}" for n, v in zip(self.space.names, at, strict=True))
        there = ", ".join(
            f"{response(s.response).title} {s.predict(desired.best[None])[0]:.4g} "
            f"{response(s.response).unit}"
            for s in desired.surfaces
        )
        return f"Most desirable, {desired.worth:.3g} of 1: {values}, with {there}."

    def _range(self, name: str) -> str:
        values = self.runs[name]
        low, high = values.min(), values.max()
        share = 100.0 * (high - low) / abs(values.mean())
        return f"the runs range from {low:.4g} to {high:.4g} ({share:.2g} %)"


def calibrate(
    study: Study | str | Path = "table4",
    executor: Executor | None = None,
    folder: Path | None = None,
    on_stage: Callable[[str, int], None] = lambda name, expected: None,
    on_done: Callable[[int], None] = lambda number: None,
) -> Calibration:
    """Do a study.

    Parameters
    ----------
    study
        A study, its file, or the name of one that comes with the code.
    executor, folder
        What does the simulations, and where they are kept: see `Runs`.
    on_stage
        Told what is begun, and how many simulations it takes.
    on_done
        Told how many simulations have been done since the last call.

    Raises
    ------
    SpecificationError
        If the study, its data or a specification that it leads to cannot be used, or too few
        simulations succeed for its model.
    KeyboardInterrupt
        If the user has interrupted it; finished simulations are kept.
    """
    study = study if isinstance(study, Study) else read_study(study)
    targets = study.targets()
    on_stage("simulating", study.distinct)
    with workers(executor) as pool:
        found = respond(study, pool, folder, on_done)
        found = replace(found, desired=_desire(found))
        if targets is None:
            return found
        used = tuple(found.surfaces[name] for name in targets.names)
        fit = fit_targets(Misfit(used, targets, found.design.region), found.space, found.baseline)
        on_stage("confirming", 1)
        (outcome,) = run_campaign([fit.test], pool, folder, on_done).outcomes
    return replace(found, fit=replace(fit, confirmation=outcome))


def respond(
    study: Study,
    executor: Executor | None = None,
    folder: Path | None = None,
    on_done: Callable[[int], None] = lambda number: None,
) -> Calibration:
    """Simulate the design of a study, and fit its surfaces; leave alone what was measured.

    Parameters and errors are those of `calibrate`.
    """
    baseline = study.test()
    for factor in study.factors:
        factor.baseline(baseline)
    for wanted in study.responses:
        response(wanted.name).check_travel(baseline.protocol.travel_mm)
    design = study.plan()
    space = study.space(design)
    tests = space.tests(baseline, design.coded)
    campaign = run_campaign(tests, executor, folder, on_done)
    runs = design.table(space)
    for wanted in study.responses:
        found = response(wanted.name)
        runs[wanted.name] = [
            np.nan if outcome.result is None else found.of_result(outcome.result)
            for outcome in campaign.outcomes
        ]
    runs["ending"] = [outcome.ending for outcome in campaign.outcomes]
    model, rule = study.polynomial, study.selection
    surfaces = {
        name: select_surface(name, space.names, design.coded, runs[name].to_numpy(), model, rule)
        for name in (wanted.name for wanted in study.responses)
    }
    return Calibration(study, baseline, space, design, campaign, runs, surfaces)


def _desire(found: Calibration) -> Desired | None:
    wishes = {w.name: w.goal for w in found.study.responses if w.goal is not None}
    if not wishes:
        return None
    surfaces, goals = tuple(found.surfaces[name] for name in wishes), tuple(wishes.values())
    best, worth = most_desirable(surfaces, goals, found.design.region)
    (test,) = found.space.tests(found.baseline, best[None])
    return Desired(surfaces, goals, best, worth, test)


def fit_targets(misfit: Misfit, space: Space, baseline: BendingTest) -> Fit:
    """Return what targets make of response surfaces, without any simulation.

    Parameters
    ----------
    misfit
        Between surfaces and targets.
    space
        The surfaces' factors.
    baseline
        The specification that factors change.
    """
    optimum, used = find_optimum(misfit)
    (test,) = space.tests(baseline, optimum.best[None])
    profiles = tuple(profile(used, number, optimum.best) for number in range(len(space.factors)))
    known = information(used, optimum.best)
    return Fit(used, optimum, profiles, known, draw_posterior(used), test)

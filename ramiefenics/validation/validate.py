"""Calibrate on some observations, and predict the others."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from ramiefenics.calibration.calibrate import respond
from ramiefenics.calibration.campaign import design_campaign, run_campaign
from ramiefenics.calibration.misfit import Misfit, Targets
from ramiefenics.calibration.optimum import nearest
from ramiefenics.runs import Runs, lasting
from ramiefenics.validation.outcome import Assessment, Observed, Validation
from ramiefenics.validation.prediction import Prediction, Weighted, condition, fix, prior
from ramiefenics.validation.strength_rule import by_strength
from ramiefenics.validation.study import Split, ValidationStudy, read_validation


def validate(
    study: ValidationStudy | str | Path = "published",
    runs: Runs | None = None,
    on_stage: Callable[[str, int], None] | None = None,
    direct: bool = False,
) -> Validation:
    """Calibrate on some observations, predict others, and compare with the measurements.

    The curves of large designs are learned from simulations of a part of them, if that takes less
    time.

    Parameters
    ----------
    study
        A validation, its file, or the name of one that comes with the code.
    runs
        Runs the simulations; by default on all cores, with results kept in the user's cache.
    on_stage
        Called at the beginning of each stage with its name and its number of simulations.
    direct
        Whether to simulate all runs of the designs.

    Raises
    ------
    SpecificationError
        If the study, its data or a specification derived from it cannot be used, or too few
        simulations succeed to fit the model.
    KeyboardInterrupt
        If the user interrupts the validation; finished simulations are kept.
    """
    on_stage = on_stage or (lambda name, expected: None)
    study = study if isinstance(study, ValidationStudy) else read_validation(study)
    parts = {observation.name: study.of(observation) for observation in study.observations}
    targets = {name: part.targets() for name, part in parts.items()}
    tests = {name: part.tests() for name, part in parts.items()}
    every = [test for some in tests.values() for test in some]
    observed, assessments = {}, []
    with lasting(runs) as runs:
        campaign = design_campaign(every, runs, on_stage, direct)
        outcomes = iter(campaign.outcomes)
        for observation in study.observations:
            name, target = observation.name, targets[observation.name]
            assert target is not None  # every observation has a target
            own = tuple(itertools.islice(outcomes, len(tests[name])))
            found = respond(parts[name], replace(campaign, outcomes=own))
            value, error = float(target.values[0]), float(target.errors[0])
            observed[name] = Observed(value, error, observation.published, found)
        for split in study.splits:
            number = len(split.on) + len(study.predicted(split))
            on_stage(f"calibrating on {', '.join(split.on)}", number)
            assessments.append(_assess(study, split, observed, runs))
    return Validation(study, observed, tuple(assessments), campaign)


def _assess(
    study: ValidationStudy,
    split: Split,
    observed: Mapping[str, Observed],
    runs: Runs,
) -> Assessment:
    names = (*split.on, *study.predicted(split))
    surfaces = {name: observed[name].found.surfaces[study.response] for name in names}
    some = observed[split.on[0]].found
    values = np.array([observed[name].value for name in split.on])
    covariance = np.diag([observed[name].error ** 2 for name in split.on])
    on = tuple(surfaces[name] for name in split.on)
    misfit = Misfit(on, Targets(split.on, values, covariance), some.design.region)

    before = prior(misfit)
    best = nearest(misfit)
    after, reached = condition(misfit, before, best)
    baseline = [factor.baseline(some.baseline) for factor in study.factors]
    nuisance = [i for i, factor in enumerate(study.factors) if factor.name in study.nuisance]
    held = fix(before, nuisance, some.space.coded(np.array(baseline)))
    fixed, reached_fixed = condition(misfit, held)
    tests = [
        observed[n].found.space.tests(observed[n].found.baseline, best[None])[0] for n in names
    ]
    outcomes = run_campaign(tests, runs).outcomes

    def predictions(weighted: Weighted) -> dict[str, Prediction]:
        return {name: Prediction(weighted, surface) for name, surface in surfaces.items()}

    return Assessment(
        split,
        reached,
        reached_fixed,
        best,
        predictions(before),
        predictions(after),
        predictions(fixed),
        dict(zip(names, outcomes, strict=True)),
        _rule(study, split, {name: observed[name] for name in names}),
    )


def _rule(
    study: ValidationStudy, split: Split, observed: Mapping[str, Observed]
) -> dict[str, float]:
    """Return the predictions of the strength rule; NaN if it does not apply."""
    tests = {name: seen.found.baseline for name, seen in observed.items()}
    bent = all(test.fixture.beam_mm is not None for test in tests.values())
    if study.response != "max_force_N" or not bent:
        return dict.fromkeys(observed, np.nan)
    return by_strength(tests, {n: (observed[n].value, observed[n].error) for n in split.on})

"""A whole study: simulate a design, fit response surfaces, calibrate the parameters."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from ramiefenics.calibration.campaign import Campaign, design_campaign, run_campaign
from ramiefenics.calibration.desirability import Desired, most_desirable
from ramiefenics.calibration.fit import fit_targets
from ramiefenics.calibration.misfit import Misfit
from ramiefenics.calibration.outcome import Calibration
from ramiefenics.calibration.responses import response
from ramiefenics.calibration.selection import select_surface
from ramiefenics.calibration.study import Study, read_study
from ramiefenics.runs import Runs, lasting


def calibrate(
    study: Study | str | Path = "table4",
    runs: Runs | None = None,
    on_stage: Callable[[str, int], None] | None = None,
    direct: bool = False,
) -> Calibration:
    """Simulate the design of a study, fit response surfaces, and calibrate the parameters.

    The curves of a large design are learned from simulations of a part of it, if that takes less
    time.

    Parameters
    ----------
    study
        A study, its file, or the name of one that comes with the code.
    runs
        Runs the simulations; by default on all cores, with results kept in the user's cache.
    on_stage
        Called at the beginning of each stage with its name and its number of simulations.
    direct
        Whether to simulate all runs of the design.

    Raises
    ------
    SpecificationError
        If the study, its data or a specification derived from it cannot be used, or too few
        simulations succeed to fit the model.
    KeyboardInterrupt
        If the user interrupts the study; finished simulations are kept.
    """
    on_stage = on_stage or (lambda name, expected: None)
    study = study if isinstance(study, Study) else read_study(study)
    targets = study.targets()
    tests = study.tests()
    with lasting(runs) as runs:
        found = respond(study, design_campaign(tests, runs, on_stage, direct))
        found = replace(found, desired=_desire(found))
        if targets is None:
            return found
        used = tuple(found.surfaces[name] for name in targets.names)
        fit = fit_targets(Misfit(used, targets, found.design.region), found.space, found.baseline)
        on_stage("confirming", 1)
        (outcome,) = run_campaign([fit.test], runs).outcomes
    return replace(found, fit=replace(fit, confirmation=outcome))


def respond(study: Study, campaign: Campaign) -> Calibration:
    """Fit the response surfaces of a study to the runs of its design, without calibrating.

    Raises
    ------
    SpecificationError
        If too few runs succeeded to fit the model.
    """
    design = study.plan()
    space = study.space(design)
    table = design.table(space)
    for wanted in study.responses:
        found = response(wanted.name)
        table[wanted.name] = [outcome.response(found) for outcome in campaign.outcomes]
    table["ending"] = [outcome.ending for outcome in campaign.outcomes]
    model, rule = study.polynomial, study.selection
    surfaces = {
        name: select_surface(name, space.names, design.coded, table[name].to_numpy(), model, rule)
        for name in (wanted.name for wanted in study.responses)
    }
    return Calibration(study, study.test(), space, design, campaign, table, surfaces)


def _desire(found: Calibration) -> Desired | None:
    goal_of = {r.name: r.goal for r in found.study.responses if r.goal is not None}
    if not goal_of:
        return None
    surfaces, goals = tuple(found.surfaces[name] for name in goal_of), tuple(goal_of.values())
    best, desirability = most_desirable(surfaces, goals, found.design.region)
    (test,) = found.space.tests(found.baseline, best[None])
    return Desired(found.space, surfaces, goals, best, desirability, test)

"""What tests could show, before they are made, and which test would tell most."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from functools import partial
from typing import Any, ClassVar

import numpy as np
import pandas as pd

from ramiefenics.discovery.curves.mesh_changes import MeshChanges
from ramiefenics.discovery.planning.power import Design, Power, power, predicted_evidence, repeated
from ramiefenics.discovery.report.wording import with_space
from ramiefenics.effects import EFFECTS, Effect
from ramiefenics.measured.changes import changed
from ramiefenics.results.result import Picture, Result, Table
from ramiefenics.runs import lasting
from ramiefenics.runs.curve import CurveTask, Mapper, simulated
from ramiefenics.specification import BendingTest, SpecificationError
from ramiefenics.specification.files import to_dict, value_at
from ramiefenics.specification.sources import Source, as_test

SHARES = {"fixture.span_mm": 0.7, "fixture.indenter_radius_mm": 2.0}
"""Values in other tests by default, relative to those in the standard test."""

UNLOADED = "protocol.then=[{to_mm=0}]"
"""Setting of a further test by default."""

HELPS = 1.0
"""Log-evidence between two effects that a second test must add to be worth making."""

ALIKE = 0.9
"""Cosine above which effects are mistaken for one another."""


@dataclass(frozen=True, repr=False)
class Plan(Result):
    """What can be found, and by which tests.

    Attributes
    ----------
    test
        The standard test.
    design
        Number of stalks, and how well they are known and tested.
    effects
        The suspects.
    powers
        What can be found, by the settings of the other test that each stalk is given in addition;
        that of the standard test alone comes first.
    """

    SUMMARY: ClassVar[str] = "plan.json"

    test: BendingTest
    design: Design
    effects: Mapping[str, Effect]
    powers: Mapping[str, Power]

    @property
    def alone(self) -> Power:
        """What can be found with the standard test alone."""
        return next(iter(self.powers.values()))

    @property
    def next_experiment(self) -> str:
        """Settings of the other test that tells most effects apart; ``alone`` if none helps."""
        each, alone = self.powers, self.alone
        best = max(each, key=lambda name: (each[name].told_apart, each[name].weakest))
        more = each[best].told_apart > alone.told_apart
        if more or each[best].weakest > alone.weakest + HELPS:
            return best
        return next(iter(each))

    @property
    def title(self) -> str:
        """Title of the plan."""
        return f"Plan: {self.design.stalks} stalks"

    def findings(self) -> list[str]:
        """Return how many effects are told apart, and by which tests."""
        pairs = len(self.alone.smallest) * (len(self.alone.smallest) - 1) // 2
        hidden = [name for name, size in self.alone.smallest.items() if not np.isfinite(size)]
        told = [
            f"The standard test alone tells apart {self.alone.told_apart} of {pairs} pairs of "
            "effects of typical size."
        ]
        best = self.next_experiment
        if self.powers[best] is not self.alone:
            told.append(
                f"Adding a second test of each stalk, with {best}, tells apart "
                f"{self.powers[best].told_apart} pairs, the most of all tests tried."
            )
        if hidden:
            told.append(
                "The standard test alone cannot find these effects at any size: "
                f"{', '.join(hidden)}."
            )
        return told

    def overview(self) -> pd.DataFrame:
        """Return a table of the smallest amplitudes that are found."""
        rows = []
        for name in self.alone.smallest:
            effect = self.effects[name]
            row = {"effect": name, "typical": f"{effect.typical:g}{with_space(effect.unit)}"}
            row |= {what: _size(found.smallest[name]) for what, found in self.powers.items()}
            rows.append(row | {"mistaken for": ", ".join(self.mistaken_for(name))})
        return pd.DataFrame(rows)

    def mistaken_for(self, name: str) -> list[str]:
        """Return the effects with nearly the same signature in the standard test."""
        names = list(self.alone.smallest)
        row = np.abs(self.alone.cosines[names.index(name)])
        return [n for n, c in zip(names, row, strict=True) if n != name and c > ALIKE]

    def numbers(self) -> dict[str, Any]:
        """Return the smallest amplitudes, and the design that they are for."""
        return {
            "next_experiment": self.next_experiment,
            "told_apart": {name: found.told_apart for name, found in self.powers.items()},
            "smallest": {name: found.smallest for name, found in self.powers.items()},
            "units": {name: self.effects[name].unit for name in self.alone.smallest},
            "design": asdict(self.design),
            "specification": to_dict(self.test),
        }

    def tables(self) -> dict[str, Table]:
        """Return the cosines between signatures, for each choice of tests."""
        names = list(self.alone.smallest)
        rows = [
            {"tests": what, "effect": a, "other": b, "cosine": float(found.cosines[i, j])}
            for what, found in self.powers.items()
            for i, a in enumerate(names)
            for j, b in enumerate(names)
            if i < j
        ]
        columns = ["tests", "effect", "other", "cosine"]  # also of a single suspect, without rows
        return {"cosines": Table(pd.DataFrame(rows, columns=columns))}

    def figures(self) -> dict[str, Picture]:
        """Return figures of the smallest amplitudes, and of effects mistaken for one another."""
        from ramiefenics.discovery.planning import plan_figures as figures

        return {
            "smallest": Picture(
                partial(figures.smallest_figure, self),
                "Smallest amplitudes that are found in 95 % of data sets, relative to the typical "
                "ones; effects without a mark are not found within their bounds, or their mark "
                "lies outside the figure.",
            ),
            "mistaken": Picture(
                partial(figures.mistaken_figure, self),
                "Similarity of signatures after removal of what fitted factors, mesh and simulator "
                "can imitate.",
            ),
        }

    def specifications(self) -> dict[str, BendingTest]:
        """Return the standard test."""
        return {"test": self.test}


def plan(
    test: Source,
    others: Sequence[Sequence[str]] | None = None,
    design: Design | None = None,
    effects: Mapping[str, Effect] | None = None,
    runs: Mapper | None = None,
    **changes: Any,
) -> Plan:
    """Find out what tests could show.

    Curves are simulated for one stalk, with every effect at its typical size, and repeated for the
    number of stalks that is planned.

    Parameters
    ----------
    test
        The standard test, its file, or the name of a published one.
    others
        Settings, ``key=value``, of each other test that stalks could be given in addition; by
        default a shorter span, a blunter indenter, and unloading after the loading.
    design
        Number of stalks, and how well they are known and tested.
    effects
        Suspects; by default all shipped effects.
    runs
        Runs the simulations; by default on all cores, with results kept in the user's cache.
    changes
        Changes to the standard test, see `as_test`.

    Raises
    ------
    SpecificationError
        If a setting is refused, or a simulation does not reach the end of its travel.
    """
    test = as_test(test, **changes)
    design = Design() if design is None else design
    suspects = EFFECTS if effects is None else effects
    with lasting(runs) as runs:
        return planned(test, others, design, suspects, runs)


def planned(
    test: BendingTest,
    others: Sequence[Sequence[str]] | None,
    design: Design,
    suspects: Mapping[str, Effect],
    runs: Mapper,
    mesh_changes: MeshChanges | None = None,
) -> Plan:
    """Find out what tests could show, given what finer meshes change, if that is known.

    Parameters
    ----------
    test, others, design, suspects, runs
        As for `plan`.
    mesh_changes
        What finer meshes change of a similar test; by default these are simulated.

    Raises
    ------
    SpecificationError
        As `plan`.
    """
    effects = {name: effect.as_found([test]) for name, effect in suspects.items()}
    given = _default_others(test) if others is None else others
    curves = [_curves(test), *(_curves(changed(test, settings)) for settings in given)]
    every = [one for some in curves for one in some]
    _check_ends(every, runs)
    evidence = predicted_evidence(every, effects, design.fit_sd, runs, mesh_changes)
    ends = np.cumsum([len(some) for some in curves])
    first, *rows = (list(range(e - len(some), e)) for e, some in zip(ends, curves, strict=True))
    choices = {"alone": first} | {" ".join(o): first + r for o, r in zip(given, rows, strict=True)}
    powers = {
        name: power(repeated(evidence, which, design.stalks), design)
        for name, which in choices.items()
    }
    return Plan(test, design, effects, powers)


def _default_others(test: BendingTest) -> list[list[str]]:
    values = {key: value_at(test, key) for key in SHARES}
    others = [[f"{k}={SHARES[k] * v:g}"] for k, v in values.items() if isinstance(v, float)]
    return others if test.protocol.then else [*others, [UNLOADED]]


def _curves(test: BendingTest) -> list[BendingTest]:
    """Return specifications of a test's curves: that of loading, and that of unloading if any."""
    loading = replace(test, protocol=replace(test.protocol, then=()))
    if not test.protocol.then:
        return [loading]
    if not test.protocol.unloads:
        allowed = "must include unloading, the only part after the loading that is compared"
        raise SpecificationError("protocol.then", f"{len(test.protocol.then)} targets", allowed)
    return [loading, test]


def _check_ends(tests: Sequence[BendingTest], runs: Mapper) -> None:
    """Raise an error where a loading does not reach its travel, before effects are simulated."""
    loadings = [test for test in tests if not test.protocol.then]
    curves = simulated(runs, [CurveTask(test) for test in loadings])
    for test, curve in zip(loadings, curves, strict=True):
        reached, travel = curve["displacement_mm"].iloc[-1], test.protocol.travel_mm
        if reached < travel - 1e-9:
            allowed = f"must be less, as the simulation of such a test ends at {reached:.2f} mm"
            raise SpecificationError("protocol.travel_mm", travel, allowed)


def _size(amplitude: float) -> str:
    return f"{amplitude:.2g}" if np.isfinite(amplitude) else "not found"

"""Outcome of a discovery."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import pandas as pd

from ramiefenics.discovery.anatomy import Anatomy
from ramiefenics.discovery.curves.blocks import Array
from ramiefenics.discovery.curves.observed import Observed
from ramiefenics.discovery.planning.plan import Plan
from ramiefenics.discovery.report import tables
from ramiefenics.discovery.report.findings import findings
from ramiefenics.discovery.search.fitted import Fitted
from ramiefenics.discovery.statistics.causes import Causes
from ramiefenics.discovery.statistics.gain import Gain
from ramiefenics.discovery.statistics.hidden import Limit
from ramiefenics.effects import Effect
from ramiefenics.effects.combining import with_effects
from ramiefenics.measured import Dataset
from ramiefenics.results.result import Picture, Result, Table
from ramiefenics.specification import BendingTest, SpecificationError
from ramiefenics.surrogate import Effort

ALIKE = 0.9
"""Cosine between two signatures above which they are easily mistaken for one another."""


@dataclass(frozen=True, repr=False)
class Discovery(Result):
    """Outcome of a discovery: the verdict, and all that it rests on.

    Attributes
    ----------
    dataset
        The measured curves.
    observed
        The measured curves as they are compared, with the errors that are assumed of them.
    effects
        The suspects.
    verdict
        One of `ramiefenics.discovery.statistics.verdict.VERDICTS`.
    groups
        Groups of effects that are accepted, at least one effect of each being practically certain
        to be present; a group of one is a cause.
    p_value
        Probability of a gain like that of the best suspect if no effect is present.
    fitted_none
        Probability that there is no effect, if only the sets that were fitted are possible.
    baseline_misfit_p_value
        Probability of a common misfit like the baseline's, if the baseline is right.
    misfit_p_value
        Probability of a common misfit like the one that is left in the end, if the model with the
        most probable set is right.
    conflict_p_value
        Probability of factors at least as far as these from what was stated of them.
    posterior
        Posterior over sets of effects.
    reasons
        Reasons why suspects are not tested or not accepted, by name.
    baseline
        The fit without effects.
    extended
        The fit with the most probable set; None where nothing was suspected.
    limits
        How large each suspect may be, by name.
    plan
        How well a second test of each specimen would separate the effects left open. None where
        nothing is open, or no test could be planned.
    alike
        Cosines between pairs of signatures, after removal of what factors and simulator can
        imitate.
    gain
        Gain in the prediction of the curves of left-out specimens by the most probable set, from
        what is known of specimens without bending them. None where nothing was suspected.
    shape_gain
        The same of the shapes of these curves, with the specimens' own factors fitted to them.
    condition_gain
        Gain in the prediction of curves under left-out conditions (`tests.csv`), from the other
        curves of the same specimens. None also where there is only one condition.
    anatomy
        What is missing, learned inside the model; None unless the verdict is unknown.
    effort
        Number of curves and simulations that the discovery took.
    """

    SUMMARY: ClassVar[str] = "verdict.json"

    dataset: Dataset
    observed: Observed
    effects: Mapping[str, Effect]
    verdict: str
    groups: tuple[tuple[str, ...], ...]
    p_value: float
    fitted_none: float
    baseline_misfit_p_value: float
    misfit_p_value: float
    conflict_p_value: float
    posterior: Causes
    reasons: Mapping[str, str]
    baseline: Fitted
    extended: Fitted | None
    limits: Mapping[str, Limit]
    plan: Plan | None
    alike: Mapping[tuple[str, str], float]
    gain: Gain | None
    shape_gain: Gain | None
    condition_gain: Gain | None
    anatomy: Anatomy | None
    effort: Effort

    @property
    def causes(self) -> tuple[str, ...]:
        """Effects that are named, both causes and the members of groups that are not told apart."""
        named = self.verdict in ("cause", "ambiguous")
        return tuple(name for group in self.groups for name in group) if named else ()

    @property
    def fitted(self) -> Fitted:
        """The final fit, which is with the most probable set if something was suspected."""
        return self.baseline if self.extended is None else self.extended

    @property
    def amplitudes(self) -> dict[str, float]:
        """Amplitudes of the effects in the most probable set, if something was suspected."""
        return self.fitted.fit.amplitudes

    @property
    def sd_between_specimens(self) -> dict[str, float]:
        """Standard deviations of the amplitudes that may differ between specimens, by effect."""
        return self.fitted.fit.sd_between_specimens

    def interval(self, name: str) -> tuple[float, float]:
        """Return the 95 % interval of a fitted amplitude, within its bounds.

        Raises
        ------
        SpecificationError
            If none of that name was fitted.
        """
        if name not in self.amplitudes:
            fitted = ", ".join(self.amplitudes) or "there is none"
            raise SpecificationError("name", name, f"must be a fitted effect ({fitted})")
        return self.fitted.fit.interval(name)

    @property
    def factor_moves(self) -> dict[str, float]:
        """Mean log factors relative to their prior standard deviation, by name."""
        moves = self.mean_log_factors() / self.dataset.layout.fit_sd
        names = (factor.name for factor in self.fitted.curves.model.factors)
        return dict(zip(names, map(float, moves), strict=True))

    def mean_log_factors(self) -> Array:
        """Return the mean log factors of the specimens that are not broken, shape (k,)."""
        return self.fitted.fit.mean_log_factors

    @property
    def broken(self) -> tuple[str, ...]:
        """Names of specimens that are taken for broken."""
        return tuple(self.dataset.specimens[s] for s in sorted(self.fitted.fit.evidence.broken))

    @property
    def confusable_with(self) -> tuple[str, ...]:
        """Other suspects whose signature is nearly parallel to that of a named one."""
        pairs = [pair for pair, cosine in self.alike.items() if abs(cosine) > ALIKE]
        found = {n for pair in pairs if set(pair) & set(self.causes) for n in pair}
        return tuple(sorted(found - set(self.causes)))

    @property
    def next_experiment(self) -> str:
        """Settings of the second test that would best separate the effects left open.

        ``alone`` if none of those tried would; empty where there is no `plan`.
        """
        return "" if self.plan is None else self.plan.next_experiment

    @property
    def explained(self) -> float | None:
        """Share of the squared error of the baseline's curve shapes that the effects remove."""
        return None if self.shape_gain is None else 1.0 - self.shape_gain.ratio**2

    def baseline_test(self) -> BendingTest:
        """Return the baseline with its fitted factors."""
        factors = self.baseline.fit.mean_log_factors
        return self.baseline.curves.model.test(self.dataset.baseline, factors)

    def extended_test(self, group: str = "") -> BendingTest:
        """Return the baseline with the factors and effects that were fitted together.

        Parameters
        ----------
        group
            Group of tests (`BendingTest.group`) whose own effects are added to those of all tests.

        Raises
        ------
        ValueError
            If nothing was suspected.
        """
        if self.extended is None:
            raise ValueError("nothing was suspected: there is no extended model")
        plain = dataclasses.replace(self.extended.curves.model, effects={})
        baseline = dataclasses.replace(self.dataset.baseline, group=group)
        test = plain.test(baseline, self.extended.fit.mean_log_factors)
        added = self.extended.fit.amplitudes.items()
        return with_effects(test, [(self.effects[name], value) for name, value in added])

    @property
    def title(self) -> str:
        """Title of the data set, with the verdict."""
        return f"{self.dataset.title}: {self.verdict}"

    def findings(self) -> list[str]:
        """Return the verdict, and what to know before believing it."""
        return findings(self)

    def notes(self) -> list[str]:
        """Return how specimens scatter, and what is attributed to mesh and simulator."""
        scatter, (low, high) = self.fitted.fit.scatter, self.dataset.range_mm
        mesh, left = self.corrections()
        names = (factor.name for factor in self.fitted.curves.model.factors)
        own = ", ".join(
            f"{100 * sd:.0f} % in {n}" for n, sd in zip(names, scatter.own, strict=True)
        )
        return [
            f"{len(self.observed.force_N)} curves of {len(self.dataset.specimens)} specimens, "
            f"{low:g} to {high:g} mm. Specimens differ by {own}; the noise is "
            f"{100 * scatter.noise:.2g} % of the peak force, and the smooth error of each curve "
            f"{100 * scatter.drift:.2g} %.",
            f"Forces on the mesh recipe {self.mesh} are corrected by up to "
            f"{100 * mesh:+.1f} % of the peak, as estimated with finer meshes; of the residual, "
            f"up to {100 * left:+.1f} % of the peak is attributed to errors of mesh and simulator.",
            *self.dataset.notes(),
            self.effort.told(),
        ]

    @property
    def mesh(self) -> str:
        """Name of the mesh recipe of the simulations."""
        return self.dataset.records[0].test.numerics.mesh.name

    def corrections(self) -> tuple[float, float]:
        """Return the largest mesh correction, and the largest error attributed to the simulator."""
        for_mesh = self.fitted.curves.mesh_correction / self.observed.peak_N[:, None]
        return _largest(for_mesh), _largest(self.fitted.fit.remaining()[1])

    def overview(self) -> pd.DataFrame:
        """Return a table of the suspects, the most probable first."""
        return tables.overview(self)

    def numbers(self) -> dict[str, Any]:
        """Return the verdict, and what it rests on."""
        return tables.numbers(self)

    def tables(self) -> dict[str, Table]:
        """Return the suspects' physics, the fitted factors, and how alike signatures are."""
        return tables.tables(self)

    def figures(self) -> dict[str, Picture]:
        """Return figures of what is wrong, why, how much better it gets, and what to test next."""
        from ramiefenics.discovery.report.pictures import pictures

        return pictures(self)

    def user_files(self) -> list[Path]:
        """Return the user's own files that define suspects."""
        return sorted({effect.file for effect in self.effects.values() if effect.file is not None})

    def specifications(self) -> dict[str, BendingTest]:
        """Return the fitted baseline, and its extension by causes or by what was learned."""
        extended = {}
        if self.verdict == "cause":
            extended["extended"] = self.extended_test()
            groups = sorted({self.effects[name].group for name in self.amplitudes} - {""})
            extended |= {f"extended_{group}": self.extended_test(group) for group in groups}
        elif self.anatomy is not None and self.anatomy.supported:
            extended["extended"] = self.anatomy.extended_test()
        return {"baseline": self.baseline_test(), **extended}


def _largest(shares: Array) -> float:
    """Return the mean over curves, from shape (r, m), where its magnitude is largest."""
    mean = shares.mean(axis=0)
    return float(mean[np.abs(mean).argmax()])

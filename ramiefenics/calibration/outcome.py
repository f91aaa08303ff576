"""Result of a designed study: runs, response surfaces, and calibrated and desirable parameters."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from functools import partial
from typing import Any

import pandas as pd

from ramiefenics.calibration.campaign import Campaign
from ramiefenics.calibration.designs import Design
from ramiefenics.calibration.desirability import Desired
from ramiefenics.calibration.factors import Space
from ramiefenics.calibration.fit import Fit
from ramiefenics.calibration.responses import response
from ramiefenics.calibration.selection import RULES
from ramiefenics.calibration.study import Study
from ramiefenics.calibration.surface import Surface
from ramiefenics.results.result import Picture, Result, Table
from ramiefenics.results.text import stack
from ramiefenics.specification import BendingTest
from ramiefenics.specification.files import to_dict


@dataclass(frozen=True, repr=False)
class Calibration(Result):
    """Result of a designed study.

    Attributes
    ----------
    study
        The study.
    baseline
        Specification in which the factors are varied.
    space
        Factors with their coding.
    design
        Design of experiments.
    campaign
        Simulations of the design.
    runs
        One row per run of the design: coded and natural values, responses, ``ending``.
    surfaces
        Response surfaces, by the name of the response.
    fit
        Calibrated parameters; None if there are no measured values.
    desired
        Most desirable parameters; None if there are no goals.
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
    def overview_first(self) -> bool:
        """Whether the overview comes first. It does, as it contains the calibrated values."""
        return True

    @property
    def completed(self) -> bool:
        """Whether all runs of the design completed the whole travel."""
        return bool((self.runs["ending"] == "completed").all())

    @property
    def title(self) -> str:
        """Title of the study."""
        return self.study.title or "Designed study"

    def findings(self) -> list[str]:
        """Return the findings of the study, one sentence each, the most important first."""
        told = [] if self.fit is None else self.fit.findings(self.runs)
        if self.desired is not None:
            told.append(self.desired.in_words())
        for run, ending in zip(self.runs["run"], self.runs["ending"], strict=True):
            if ending != "completed":
                told.append(f"Run {run} did not complete: {ending}.")
        return told

    def notes(self) -> list[str]:
        """Return what was run, how the surfaces were fitted, and caveats of their statistics."""
        end, kind = self.space.coded_high, self.design.kind
        told = [
            f"{kind[0].upper()}{kind[1:]} design, {len(self.design.coded)} runs, of which "
            f"{self.campaign.distinct} differ; mesh recipe {self.baseline.numerics.mesh.name}. The "
            f"ends of a range are coded -{end:.4g} and {end:.4g}.",
            self.campaign.effort.told(),
            f"Terms of the {self.study.polynomial} model: {RULES[self.study.selection]}.",
        ]
        if self.fit is not None:
            told.append(
                "An end of an interval in brackets is set by the ranges of the factors; the data "
                "would allow a wider interval."
            )
        for name, surface in self.surfaces.items():
            told += [f"{response(name).label}: {text}" for text in surface.notes()]
        return told

    def overview(self) -> pd.DataFrame | None:
        """Return the calibrated values with their intervals."""
        return None if self.fit is None else self.fit.calibrated()

    def numbers(self) -> dict[str, Any]:
        """Return the surfaces, the optimum, what the data determine, and the study itself."""
        numbers: dict[str, Any] = {
            "title": self.study.title,
            "design": {
                "kind": self.design.kind,
                "runs": len(self.design.coded),
                "distinct": self.campaign.distinct,
                "alpha": self.design.alpha,
            },
            **dataclasses.asdict(self.campaign.effort),
            "simulated_now": self.campaign.simulated,
            "surfaces": {
                name: {
                    "coefficients_coded": dict(zip(s.labels, s.fit.params, strict=True)),
                    **s.quality,
                    "notes": s.notes(),
                }
                for name, s in self.surfaces.items()
            },
            "study": {n: part for n, part in to_dict(self.study).items() if n != "folder"},
            "mesh": self.baseline.numerics.mesh.name,
            "specification": to_dict(self.baseline),
        }
        if self.fit is not None:
            numbers |= self.fit.numbers()
        if self.desired is not None:
            numbers["desirable"] = self.desired.numbers()
        return numbers

    def tables(self) -> dict[str, Table]:
        """Return tables of identifiability, factors, runs, and statistics of the surfaces."""
        quality = {name: pd.DataFrame([s.quality]) for name, s in self.surfaces.items()}
        return {
            **({} if self.fit is None else self.fit.tables()),
            "factors": Table(self._factors(), "Factors that were varied."),
            "runs": Table(self.runs, "The design in coded and natural units, with the responses."),
            "quality": Table(stack(quality, "response"), "How well the surfaces predict."),
            **{
                name: Table(self._of_surfaces(name), caption)
                for name, caption in (
                    ("coefficients", "Coefficients of the surfaces, in coded units."),
                    ("anova", "Analysis of variance."),
                    ("diagnostics", ""),
                )
            },
        }

    def _factors(self) -> pd.DataFrame:
        return pd.DataFrame(
            [
                {"factor": f.name, "title": f.title, "low": f.low, "high": f.high, "scale": f.scale}
                | {"keys": ", ".join(f.keys)}
                for f in self.space.factors
            ]
        )

    def _of_surfaces(self, table: str) -> pd.DataFrame:
        return stack({name: getattr(s, table)() for name, s in self.surfaces.items()}, "response")

    def figures(self) -> dict[str, Picture]:
        """Return figures of curves, equally good parameters, profiles, posterior and surfaces."""
        from ramiefenics.calibration import figures, surface_figures

        several = len(self.space.factors) > 1
        drawn = {
            "curves": Picture(
                lambda: figures.curves_figure(self),
                "Force curves of all runs, and of the optimum.",
            )
        }
        if self.fit is not None:
            drawn |= figures.of_fit(self, self.fit)
        if self.desired is not None and several:
            drawn["desirability"] = Picture(
                partial(figures.desirability_figure, self, self.desired),
                "Overall desirability, with the other factors at their best values. Star: the "
                "most desirable point.",
            )
        for name in self.surfaces:
            drawn |= surface_figures.of_response(self, name)
        return drawn

    def specifications(self) -> dict[str, BendingTest]:
        """Return the baseline, the calibrated and the most desirable specifications."""
        tests = {"baseline": self.baseline}
        if self.fit is not None:
            tests["calibrated"] = self.fit.test
        if self.desired is not None:
            tests["desirable"] = self.desired.test
        return tests

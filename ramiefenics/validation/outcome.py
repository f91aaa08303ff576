"""Result of a validation: predictions compared with measurements, and effects of the factors."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
import pandas as pd

from ramiefenics.calibration.campaign import Campaign, Outcome
from ramiefenics.calibration.factors import Array
from ramiefenics.calibration.outcome import Calibration
from ramiefenics.calibration.responses import Response, response
from ramiefenics.results.result import Picture, Result, Table
from ramiefenics.results.text import stack
from ramiefenics.specification.files import to_dict
from ramiefenics.validation.findings import told_of
from ramiefenics.validation.prediction import Prediction, weighted_quantiles
from ramiefenics.validation.study import Split, ValidationStudy

PREDICTORS = {
    "calibrated": "calibrated model",
    "fixed": "calibrated model with all nuisance factors at their defaults",
    "uncalibrated": "uncalibrated model",
    "rule": "P L / 4 W constant",
    "published": "published simulation",
}
"""Predictors by their column in the table of predictions, with descriptions."""


@dataclass(frozen=True)
class Observed:
    """An observation with its simulations.

    Attributes
    ----------
    value, error
        Measured value and its standard error.
    published
        Result of another simulation, or None.
    found
        Simulations of the design for this stalk, and the response surface fitted to them.
    """

    value: float
    error: float
    published: float | None
    found: Calibration


@dataclass(frozen=True)
class Assessment:
    """A calibration and its predictions.

    Attributes
    ----------
    split
        Observations calibrated on, and observations predicted.
    reached
        Whether some point of the prior meets the measurements within their errors (95 %).
    reached_fixed
        Whether this is so with all nuisance factors at their baseline values.
    best
        The point that meets the measurements best; if there are several, the one nearest to the
        middle of the prior. Coded, shape (k,).
    before, after, fixed
        Predictions by observation: from the prior; calibrated; calibrated with all nuisance factors
        at their baseline values.
    confirmed
        Simulations at the best point, by observation.
    rule
        Predictions of the strength rule, by observation.
    """

    split: Split
    reached: bool
    reached_fixed: bool
    best: Array
    before: Mapping[str, Prediction]
    after: Mapping[str, Prediction]
    fixed: Mapping[str, Prediction]
    confirmed: Mapping[str, Outcome]
    rule: Mapping[str, float]


@dataclass(frozen=True, repr=False)
class Validation(Result):
    """Result of a validation.

    Attributes
    ----------
    study
        The study.
    observed
        Observations with their simulations, by name.
    assessments
        Calibrations with their predictions, one per split.
    campaign
        The runs of all designs.
    """

    study: ValidationStudy
    observed: Mapping[str, Observed]
    assessments: tuple[Assessment, ...]
    campaign: Campaign

    @property
    def completed(self) -> bool:
        """Whether all runs of the designs completed the whole travel."""
        return all(observed.found.completed for observed in self.observed.values())

    @property
    def response(self) -> Response:
        """The response that is compared."""
        return response(self.study.response)

    def table(self, assessment: Assessment) -> pd.DataFrame:
        """Return one row per observation of a split, those calibrated on first.

        Returns
        -------
        pandas.DataFrame
            ``observation``, ``role``, ``measured``, ``standard_error``, then the value of each
            predictor and its error in percent: ``published``, ``calibrated`` (median, with the 95 %
            interval ``low`` to ``high``), ``simulated`` (at the best point), ``uncalibrated``
            (prior median, ``prior_low`` to ``prior_high``), ``fixed`` (nuisance factors at the
            baseline), ``rule``; and ``covered``, whether measurement and calibrated median agree
            within the errors of both.
        """
        return pd.DataFrame([self._row(assessment, name) for name in assessment.after])

    def _row(self, assessment: Assessment, name: str) -> dict[str, object]:
        seen = self.observed[name]
        after = assessment.after[name]
        low, median, high = after.interval
        prior_low, prior_median, prior_high = assessment.before[name].interval
        said = {
            "published": np.nan if seen.published is None else seen.published,
            "calibrated": median,
            "simulated": assessment.confirmed[name].response(self.response),
            "uncalibrated": prior_median,
            "fixed": assessment.fixed[name].interval[1],
            "rule": assessment.rule[name],
        }
        role = "calibrated on" if name in assessment.split.on else "predicted"
        row: dict[str, object] = {"observation": name, "role": role, "measured": seen.value}
        row |= {"standard_error": seen.error, "low": low, "high": high}
        row |= {"prior_low": prior_low, "prior_high": prior_high}
        for predictor, value in said.items():
            row[predictor] = value
            row[f"{predictor}_error_percent"] = round(100.0 * (value / seen.value - 1.0), 6)
        # the half interval on the side of the measurement and 1.96 standard errors, as independent
        allowed = np.hypot(
            1.96 * seen.error, (high - median) if seen.value > median else median - low
        )
        row["covered"] = bool(abs(seen.value - median) <= allowed)
        return row

    def scores(self, assessment: Assessment) -> pd.DataFrame:
        """Return one row per predictor: its errors over the predicted observations, in percent.

        Columns ``number`` (of observations that it predicts), ``rms_percent``, ``mean_percent`` and
        ``largest_percent`` (the error of largest magnitude).
        """
        table = self.table(assessment)
        table = table[table["role"] == "predicted"]
        rows = []
        for name, words in PREDICTORS.items():
            errors = table[f"{name}_error_percent"].dropna().to_numpy()
            if len(errors):
                row = {"predictor": name, "what": words, "number": len(errors)}
                row |= {"rms_percent": float(np.sqrt(np.mean(errors**2)))}
                row |= {"mean_percent": float(errors.mean())}
                row |= {"largest_percent": float(errors[np.abs(errors).argmax()])}
                rows.append(row)
        return pd.DataFrame(rows)

    def factors(self, assessment: Assessment) -> pd.DataFrame:
        """Return one row per factor: its prior and its posterior."""
        name = assessment.split.on[0]
        weighted, space = assessment.after[name].weighted, self.observed[name].found.space
        natural = space.natural(weighted.points)
        best = space.natural(assessment.best)
        rows = []
        for number, factor in enumerate(self.study.factors):
            low, middle, high = weighted_quantiles(natural[:, number], weighted.weights)
            row = {
                "factor": factor.name,
                "title": factor.title,
                "nuisance": factor.name in self.study.nuisance,
            }
            row |= {"prior_low": factor.low, "prior_high": factor.high, "scale": factor.scale}
            row |= {"baseline": factor.baseline(self.observed[name].found.baseline)}
            rows.append(row | {"low": low, "median": middle, "high": high, "best": best[number]})
        return pd.DataFrame(rows)

    def swings(self, assessment: Assessment) -> pd.DataFrame:
        """Return the change of each prediction by each factor, percent.

        Columns ``before`` and ``after`` are those without and with the calibration.
        """
        rows = []
        for number, factor in enumerate(self.study.factors):
            for name in self.study.predicted(assessment.split):
                row: dict[str, object] = {"factor": factor.name, "observation": name}
                for when in ("before", "after"):
                    prediction: Prediction = getattr(assessment, when)[name]
                    row[when] = 100.0 * prediction.swing(number) / prediction.mean
                rows.append(row)
        return pd.DataFrame(rows)

    def findings(self) -> list[str]:
        """Return the findings of the validation, one sentence each."""
        told = [text for part in self.assessments for text in told_of(self, part)]
        for name, seen in self.observed.items():
            ends = zip(seen.found.runs["run"], seen.found.runs["ending"], strict=True)
            told += [f"{name}: run {n} did not complete: {e}." for n, e in ends if e != "completed"]
        confirmed = (run for part in self.assessments for run in part.confirmed.values())
        simulated = [
            run.result for run in (*self.campaign.outcomes, *confirmed) if run.result is not None
        ]
        lost = sum("ellipticity" in result.losses_mm for result in simulated)
        if lost:
            told.append(
                f"In {lost} of {len(simulated)} simulations the material loses strong ellipticity "
                "somewhere: their forces depend on the mesh."
            )
        return told

    def notes(self) -> list[str]:
        """Return how many curves were learned, and what is not known of these."""
        told = [self.campaign.effort.told()]
        if self.campaign.effort.learned_error:
            told.append("Strong ellipticity is only checked in the simulations at the best points.")
        return told

    @property
    def title(self) -> str:
        """Title of the study."""
        return self.study.title or "Validation"

    def overview(self) -> pd.DataFrame:
        """Return the errors of each predictor."""
        columns = ["split", "what", "number", "rms_percent", "mean_percent", "largest_percent"]
        return self._by_split(self.scores)[columns]

    def _by_split(self, table: Callable[[Assessment], pd.DataFrame]) -> pd.DataFrame:
        return stack({part.split.title: table(part) for part in self.assessments}, "split")

    def numbers(self) -> dict[str, Any]:
        """Return the predictions, their errors, and the study itself."""
        return {
            "title": self.study.title,
            "predictions": self._by_split(self.table).to_dict("records"),
            "scores": self._by_split(self.scores).to_dict("records"),
            **dataclasses.asdict(self.campaign.effort),
            "simulated_now": self.campaign.simulated,
            "study": {name: part for name, part in to_dict(self.study).items() if name != "folder"},
            "specifications": {
                n: to_dict(seen.found.baseline) for n, seen in self.observed.items()
            },
        }

    def tables(self) -> dict[str, Table]:
        """Return tables of the predictions, the factors, and the simulations behind them."""
        runs = {name: seen.found.runs for name, seen in self.observed.items()}
        surfaces = {
            name: pd.DataFrame([seen.found.surfaces[self.study.response].quality])
            for name, seen in self.observed.items()
        }
        return {
            "predictions": Table(
                self._by_split(self.table), "Measurements, and the values of each predictor."
            ),
            "scores": Table(self._by_split(self.scores)),
            "factors": Table(
                self._by_split(self.factors), "Factors before and after the calibration."
            ),
            "swings": Table(self._by_split(self.swings)),
            "runs": Table(stack(runs, "observation")),
            "surfaces": Table(stack(surfaces, "observation"), "How well the surfaces predict."),
        }

    def figures(self) -> dict[str, Picture]:
        """Return figures of the predictions and of the effects of the factors, for each split."""
        from ramiefenics.validation.figures import nuisance_figure, prediction_figure

        drawn = {}
        for number, part in enumerate(self.assessments, start=1):
            title = part.split.title
            drawn[f"predictions_{number}"] = Picture(
                partial(prediction_figure, self, part),
                f"{title}: measured and predicted values. Star: used for the calibration.",
            )
            drawn[f"nuisance_{number}"] = Picture(
                partial(nuisance_figure, self, part),
                f"{title}: how far a factor moves the predictions, from the lower to the upper "
                "fifth of its range, on average over the stalks predicted and all other factors. "
                "No bar: the calibration rules out one of the fifths.",
            )
        return drawn

"""What came of a validation: predictions beside measurements, and what moves them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import pandas as pd

from ramiefenics.calibration.calibrate import Calibration
from ramiefenics.calibration.campaign import Outcome
from ramiefenics.calibration.factors import Array
from ramiefenics.calibration.responses import Response, response
from ramiefenics.validation.prediction import ENOUGH, Prediction, weighted_quantiles
from ramiefenics.validation.study import Split, ValidationStudy

PREDICTORS = {
    "calibrated": "the model, calibrated",
    "fixed": "the same with all nuisance factors at their defaults",
    "uncalibrated": "the model, over all of its prior",
    "rule": "P L / 4 W constant",
    "published": "the published simulation",
}
"""Columns of the table of predictions, in words."""


@dataclass(frozen=True)
class Observed:
    """An observation with its simulations.

    Attributes
    ----------
    value, error
        What was measured, and its standard error.
    published
        What another simulation gave, or None.
    found
        The design's simulations of this stalk, and the response surface through them.
    """

    value: float
    error: float
    published: float | None
    found: Calibration


@dataclass(frozen=True)
class Assessment:
    """A calibration, and its predictions.

    Attributes
    ----------
    split
        What was calibrated on what.
    reached
        Whether some point of the prior meets the measurements within their errors (95 %).
    reached_fixed
        The same with all nuisance factors at their baseline values.
    best
        Of the points that meet the measurements best, that nearest to the middle of the prior;
        coded, shape (k,).
    before, after, fixed
        Predictions by observation: by the prior; calibrated; calibrated with all nuisance factors
        at their baseline values.
    confirmed
        Simulations at the best point, by observation.
    rule
        Predictions by the strength rule.
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


@dataclass(frozen=True)
class Validation:
    """A validation that was done.

    Attributes
    ----------
    study
        What was asked.
    observed
        By name.
    assessments
        One per split.
    """

    study: ValidationStudy
    observed: Mapping[str, Observed]
    assessments: tuple[Assessment, ...]

    @property
    def completed(self) -> bool:
        """Whether all simulations of the designs reached the whole travel."""
        return all(observed.found.completed for observed in self.observed.values())

    @property
    def response(self) -> Response:
        """What is compared."""
        return response(self.study.response)

    def table(self, assessment: Assessment) -> pd.DataFrame:
        """Return one row per observation of a split, the calibrated ones first.

        Returns
        -------
        pandas.DataFrame
            ``observation``, ``role``, ``measured``, ``standard_error``, then what each predictor
            says and its error in percent: ``published``, ``calibrated`` (median, with the 95 %
            interval ``low`` to ``high``), ``simulated`` (at the best point), ``uncalibrated``
            (prior median, ``prior_low`` to ``prior_high``), ``fixed`` (nuisance factors at the
            baseline), ``rule``; and ``covered``, whether measurement and interval agree within
            both errors.
        """
        return pd.DataFrame([self._row(assessment, name) for name in assessment.after])

    def _row(self, assessment: Assessment, name: str) -> dict[str, object]:
        seen = self.observed[name]
        after = assessment.after[name]
        low, median, high = after.interval
        prior_low, prior_median, prior_high = assessment.before[name].interval
        result = assessment.confirmed[name].result
        said = {
            "published": np.nan if seen.published is None else seen.published,
            "calibrated": median,
            "simulated": np.nan if result is None else self.response.of_result(result),
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
        # half the interval and twice the error, as independent
        allowed = np.hypot(
            1.96 * seen.error, (high - median) if seen.value > median else median - low
        )
        row["covered"] = bool(abs(seen.value - median) <= allowed)
        return row

    def scores(self, assessment: Assessment) -> pd.DataFrame:
        """Return one row per predictor: how it errs over the predicted observations, in percent.

        ``number`` of observations it says something about, ``rms``, ``mean`` and ``largest`` error.
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
        """Return one row per factor: its prior, and what the calibration leaves of it."""
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
        """Return how far each factor moves each prediction, percent, ``before`` and ``after``."""
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
        """Return what the validation says, in plain sentences."""
        told = [text for assessment in self.assessments for text in self._told(assessment)]
        for name, seen in self.observed.items():
            ends = zip(seen.found.runs["run"], seen.found.runs["ending"], strict=True)
            told += [f"{name}: run {n} did not complete: {e}." for n, e in ends if e != "completed"]
        lost = [
            run.result is not None and "ellipticity" in run.result.losses_mm
            for seen in self.observed.values()
            for run in seen.found.campaign.outcomes
        ]
        if any(lost):
            told.append(
                f"In {sum(lost)} of {len(lost)} runs the material loses strong ellipticity "
                "somewhere: their forces depend on the mesh."
            )
        return told

    def _told(self, assessment: Assessment) -> list[str]:
        title = assessment.split.title
        table, scores = self.table(assessment), self.scores(assessment)
        predicted = table[table["role"] == "predicted"]
        told = [f"{title[0].upper()}{title[1:]}:"]
        if not assessment.reached:
            told.append(
                "No values of the factors meet what they are calibrated on: the model is wrong, or "
                "the priors are too narrow. What is left at the nearest counts as an error of the "
                "model."
            )
        elif not assessment.reached_fixed:
            told.append(
                "With the nuisance factors at their defaults, the others cannot be calibrated: "
                "they do not reach what was measured."
            )
        errors = [
            f"{what} {error:.1f} % (of {number})"
            for what, error, number in scores[["what", "rms_percent", "number"]].to_numpy()
        ]
        told.append(f"Root mean square errors of prediction: {', '.join(errors)}.")
        told += _winner(scores)
        effective = next(iter(assessment.after.values())).weighted.effective
        if effective < ENOUGH:
            told.append(
                f"Only {effective:.0f} points of the prior share the weight: intervals are rough."
            )
        after, before = (
            50.0 * ((predicted[high] - predicted[low]) / predicted[middle]).mean()
            for low, middle, high in (
                ("low", "calibrated", "high"),
                ("prior_low", "uncalibrated", "prior_high"),
            )
        )
        told.append(
            f"What is not known leaves ± {after:.0f} % of the predictions open after the "
            f"calibration, ± {before:.0f} % before it (95 %)."
        )
        missed = predicted.loc[~predicted["covered"], "observation"].tolist()
        told.append(
            f"{len(predicted) - len(missed)} of {len(predicted)} measurements agree with their "
            f"prediction within both errors{'; not ' + ', '.join(missed) if missed else ''}."
        )
        return told


def _winner(scores: pd.DataFrame) -> list[str]:
    """Say whether the model predicts better than the rule, where there is one."""
    errors = dict(zip(scores["predictor"], scores["rms_percent"], strict=True))
    if "rule" not in errors:
        return []
    model, rule = errors["calibrated"], errors["rule"]
    verdict = "better" if model < rule else "worse"
    return [
        f"The calibrated model predicts {verdict} than the rule: {model:.1f} against {rule:.1f} %."
    ]

"""Findings of a validation, as sentences."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pandas as pd

from ramiefenics.validation.prediction import ENOUGH

if TYPE_CHECKING:
    from ramiefenics.validation.outcome import Assessment, Validation


def told_of(found: Validation, assessment: Assessment) -> list[str]:
    """Return how well the predictions of one calibration agree with the measurements."""
    title = assessment.split.title
    table, scores = found.table(assessment), found.scores(assessment)
    predicted = table[table["role"] == "predicted"]
    said = [f"{title[0].upper()}{title[1:]}:"]
    if not assessment.reached:
        said.append(
            "No values of the factors meet what they are calibrated on: the model is wrong, or "
            "the priors are too narrow. What is left at the nearest counts as an error of the "
            "model."
        )
    elif not assessment.reached_fixed:
        said.append(
            "With the nuisance factors at their defaults, the others cannot be calibrated: "
            "they do not reach what was measured."
        )
    errors = [
        f"{what} {error:.1f} % (of {number})"
        for what, error, number in scores[["what", "rms_percent", "number"]].to_numpy()
    ]
    said.append(f"Root mean square errors of prediction: {', '.join(errors)}.")
    said += _winner(scores)
    effective = next(iter(assessment.after.values())).weighted.effective
    if effective < ENOUGH:
        said.append(
            f"Only {effective:.0f} points of the prior share the weight: intervals are rough."
        )
    after, before = (
        50.0 * ((predicted[high] - predicted[low]) / predicted[middle]).mean()
        for low, middle, high in (
            ("low", "calibrated", "high"),
            ("prior_low", "uncalibrated", "prior_high"),
        )
    )
    said.append(
        f"What is not known leaves ± {after:.0f} % of the predictions open after the "
        f"calibration, ± {before:.0f} % before it (95 %)."
    )
    missed = predicted.loc[~predicted["covered"], "observation"].tolist()
    said.append(
        f"{len(predicted) - len(missed)} of {len(predicted)} measurements agree with their "
        f"prediction within both errors{'; not ' + ', '.join(missed) if missed else ''}."
    )
    return said


def _winner(scores: pd.DataFrame) -> list[str]:
    """Return whether the model predicts better than the strength rule, if the rule applies."""
    errors = dict(zip(scores["predictor"], scores["rms_percent"], strict=True))
    if "rule" not in errors:
        return []
    model, rule = errors["calibrated"], errors["rule"]
    verdict = "better" if model < rule else "worse"
    return [
        f"The calibrated model predicts {verdict} than the rule: {model:.1f} against {rule:.1f} %."
    ]

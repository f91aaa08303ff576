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
            "No values of the factors meet the measurements that they are calibrated on: the "
            "model is wrong, or the priors are too narrow. The misfit that remains at the nearest "
            "point counts as an error of the model."
        )
    elif not assessment.reached_fixed:
        said.append(
            "With the nuisance factors at their defaults, the others cannot be calibrated: "
            "they do not reach the measured values."
        )
    errors = [
        f"{what} {error:.1f} % (n = {number})"
        for what, error, number in scores[["what", "rms_percent", "number"]].to_numpy()
    ]
    said.append(f"Root mean square errors of prediction: {', '.join(errors)}.")
    said += _winner(scores)
    effective = next(iter(assessment.after.values())).weighted.effective
    if effective < ENOUGH:
        said.append(
            f"Only {effective:.0f} points of the prior carry the weight, so the intervals are only "
            "approximate."
        )
    after, before = (
        50.0 * ((predicted[high] - predicted[low]) / predicted[middle]).mean()
        for low, middle, high in (
            ("low", "calibrated", "high"),
            ("prior_low", "uncalibrated", "prior_high"),
        )
    )
    said.append(
        f"The predictions are uncertain by ± {after:.0f} % after the calibration, and by "
        f"± {before:.0f} % before it (95 %)."
    )
    missed = predicted.loc[~predicted["covered"], "observation"].tolist()
    said.append(
        f"{len(predicted) - len(missed)} of {len(predicted)} measurements agree with their "
        "predictions within the errors of both"
        f"{'; these do not: ' + ', '.join(missed) if missed else ''}."
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
        f"The calibrated model predicts {verdict} than the rule that P L / 4 W is constant: "
        f"{model:.1f} against {rule:.1f} %."
    ]

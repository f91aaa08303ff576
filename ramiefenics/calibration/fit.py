"""Calibration by response surfaces: optimum, intervals, and which parameters are determined."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from ramiefenics.calibration.campaign import Outcome
from ramiefenics.calibration.factors import Space
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
from ramiefenics.results.result import Table
from ramiefenics.specification import BendingTest

LISTED = 1000
"""Number of equally good points that are written to the table."""


@dataclass(frozen=True)
class Fit:
    """Parameters calibrated to the targets, by means of response surfaces.

    Attributes
    ----------
    space
        Factors of the surfaces, with their coding.
    baseline
        Specification in which the factors are varied.
    misfit
        Misfit between surfaces and targets.
    optimum
        Point of least misfit, and the set of equally good parameters.
    profiles
        Profile likelihood of each factor.
    information
        Fisher information at the optimum.
    posterior
        Samples of the posterior for a flat prior in the region.
    test
        Specification at the optimum.
    confirmation
        Simulation of that specification; None if it has not been simulated.
    """

    space: Space
    baseline: BendingTest
    misfit: Misfit
    optimum: Optimum
    profiles: tuple[Profile, ...]
    information: Information
    posterior: Posterior
    test: BendingTest
    confirmation: Outcome | None = None

    def findings(self, runs: pd.DataFrame) -> list[str]:
        """Return how close the optimum is to the targets, and what the data determine.

        Parameters
        ----------
        runs
            Runs of the design, with one column per response.
        """
        told = self._optimum_in_words(runs)
        told += in_words(self.space, self.profiles, self.information, self.optimum.met)
        if not self.posterior.trusted:
            told.append("The Markov chain is short, so the posterior is only approximate.")
        if self.confirmation is not None and self.confirmation.ending != "completed":
            ending = self.confirmation.ending
            told.append(f"The simulation at the optimum did not complete: {ending}.")
        return told

    def _optimum_in_words(self, runs: pd.DataFrame) -> list[str]:
        told = []
        targets, optimum = self.misfit.targets, self.optimum
        result = None if self.confirmation is None else self.confirmation.result
        for name, value, error, found in zip(
            targets.names, targets.values, targets.errors, optimum.predicted, strict=True
        ):
            what = response(name)
            simulated = (
                "" if result is None else f" (simulated there: {what.of_result(result):.4g})"
            )
            told.append(
                f"The {what.title} was measured as {value:.4g} ± {error:.2g} {what.unit} "
                f"(standard error) and is {found:.4g} {what.unit} at the optimum{simulated}; "
                f"{_range(runs[name])}."
            )
        if optimum.met:
            told.append(
                f"{100.0 * optimum.share:.3g} % of the region meets the targets as well as the "
                "optimum does, within the errors (95 %)."
            )
        else:
            told.append(
                "No point of the region meets the targets within their errors: the factors do not "
                "reach that far, or the model is wrong. The misfit that remains at the nearest "
                "point counts as an error of the model in what follows."
            )
        return told

    def numbers(self) -> dict[str, Any]:
        """Return the targets, the optimum, and what the data determine."""
        optimum, targets = self.optimum, self.misfit.targets
        names = self.space.names
        result = None if self.confirmation is None else self.confirmation.result
        return {
            "targets": dict(zip(targets.names, targets.values, strict=True)),
            "target_covariance": targets.covariance.tolist(),
            "optimum": {
                "natural": dict(zip(names, self.space.natural(optimum.best), strict=True)),
                "coded": dict(zip(names, optimum.best, strict=True)),
                "predicted": dict(zip(targets.names, optimum.predicted, strict=True)),
                "simulated_max_force_N": None if result is None else result.max_force_N,
                "chi2": optimum.misfit,
                "targets_met": optimum.met,
                "discrepancy": list(self.misfit.discrepancy),
                "share_of_region_as_good": optimum.share,
            },
            "identifiability": self.identifiability().to_dict("records"),
            "posterior_chain_length": self.posterior.chain_length,
        }

    def tables(self) -> dict[str, Table]:
        """Return tables of what the data determine, and of the equally good parameters."""
        return {
            "identifiability": Table(
                self.identifiability(), "Which parameters the data determine."
            ),
            "information": Table(
                self.combinations(),
                "Combinations of the coded parameters, the best determined first.",
            ),
            "optimum_set": Table(self.optimum_set()),
        }

    def calibrated(self) -> pd.DataFrame:
        """Return the optimum with its intervals.

        Ends of intervals are in brackets if the ranges of the factors, not the data, set them.
        """
        table = self.identifiability()
        shown = table[["parameter", "title"]].assign(calibrated=table["optimum"])
        for side, end in enumerate(("low", "high")):
            ends = []
            for number, found in enumerate(self.profiles):
                coded = (found.low, found.high)[side]
                whole = coded is None or found.by_others[side]
                value = self._natural(number, found.at[(0, -1)[side]] if coded is None else coded)
                ends.append(f"({value:.4g})" if whole else f"{value:.4g}")
            shown[f"95 % {end}"] = ends
        return shown.assign(verdict=table["verdict"])

    def identifiability(self) -> pd.DataFrame:
        """Return one row per parameter: interval, verdict, and quantiles of the posterior."""
        low, median, high = self.space.natural(self.posterior.quantiles(0.025, 0.5, 0.975))
        contraction = self.posterior.contraction
        rows = []
        for index, (factor, found) in enumerate(
            zip(self.space.factors, self.profiles, strict=True)
        ):
            rows.append(
                {
                    "parameter": factor.name,
                    "title": factor.title,
                    "baseline": factor.baseline(self.baseline),
                    "optimum": self._natural(index, float(self.optimum.best[index])),
                    "low": self._natural(index, found.low),
                    "high": self._natural(index, found.high),
                    "verdict": found.verdict,
                    "share_of_range": found.share,
                    "posterior_low": low[index],
                    "posterior_median": median[index],
                    "posterior_high": high[index],
                    "contraction": contraction[index],
                }
            )
        return pd.DataFrame(rows)

    def _natural(self, factor: int, coded: float | None) -> float:
        if coded is None:
            return math.nan
        point = np.zeros(len(self.space.factors))
        point[factor] = coded
        return float(self.space.natural(point)[factor])

    def combinations(self) -> pd.DataFrame:
        """Return one row per combination of coded parameters, the best determined first."""
        told = self.information
        known = {
            "eigenvalue": told.eigenvalues,
            "standard_error": told.errors,
            "determined": told.determined,
        }
        directions = pd.DataFrame(told.directions, columns=list(self.space.names))
        return pd.concat([pd.DataFrame(known), directions], axis=1)

    def optimum_set(self) -> pd.DataFrame:
        """Return the best point and others that are as good, in natural and coded values."""
        good, names = self.optimum.good[:LISTED], self.space.names
        table = pd.DataFrame(self.space.natural(good), columns=list(names))
        table[[f"{name}_coded" for name in names]] = good
        table[list(self.misfit.targets.names)] = self.misfit.predict(good)
        table["chi2"] = self.misfit.of(good)
        return table


def _range(values: pd.Series) -> str:
    low, high = values.min(), values.max()
    share = 100.0 * (high - low) / abs(values.mean())
    return f"the runs range from {low:.4g} to {high:.4g} ({share:.2g} %)"


def fit_targets(misfit: Misfit, space: Space, baseline: BendingTest) -> Fit:
    """Calibrate the parameters by means of response surfaces, without any simulation.

    Parameters
    ----------
    misfit
        Misfit between surfaces and targets.
    space
        Factors of the surfaces, with their coding.
    baseline
        Specification in which the factors are varied.
    """
    optimum, used = find_optimum(misfit)
    (test,) = space.tests(baseline, optimum.best[None])
    profiles = tuple(profile(used, number, optimum.best) for number in range(len(space.factors)))
    known = information(used, optimum.best)
    return Fit(space, baseline, used, optimum, profiles, known, draw_posterior(used), test)

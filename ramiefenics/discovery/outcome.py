"""What a discovery comes to."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import pandas as pd
from scipy.stats import t as student

from ramiefenics.discovery.comparison import Observed
from ramiefenics.discovery.evidence import Array
from ramiefenics.discovery.findings import findings, with_space
from ramiefenics.discovery.fitting import Fitted
from ramiefenics.discovery.verdict import Gain, Score
from ramiefenics.effects import Effect
from ramiefenics.measured import Dataset
from ramiefenics.results.result import Picture, Result, Table
from ramiefenics.specification import BendingTest
from ramiefenics.specification.files import to_dict


@dataclass(frozen=True)
class Effort:
    """What force curves took.

    Attributes
    ----------
    curves
        Asked for.
    simulations
        Of which the others were learned, those done before included.
    learned_error
        The largest to be expected of a learned curve, over its peak; 0 if all were simulated.
    """

    curves: int
    simulations: int
    learned_error: float

    def told(self) -> str:
        """Return it as a sentence."""
        if self.learned_error == 0.0:
            return f"{self.curves} force curves, all of them simulated."
        return (
            f"{self.curves} force curves took {self.simulations} simulations; the others were "
            f"learned from these, to {100 * self.learned_error:.1g} % of the peak."
        )


@dataclass(frozen=True, repr=False)
class Discovery(Result):
    """What was found.

    Attributes
    ----------
    dataset, observed
        The measured curves.
    effects
        The suspects.
    verdict
        ``none``, ``cause``, ``ambiguous`` or ``unknown``.
    causes
        Effects named: one, or for ``ambiguous`` all that are not told apart.
    p_value
        Probability of a gain like the best suspect's without any effect.
    baseline_misfit_p_value, misfit_p_value
        Probability of a common misfit like the baseline's, and like the one that is left in the
        end, if the model is right.
    scores
        Of all suspects.
    baseline, extended
        The fits without and with the best suspect; the latter is None where nothing was suspected.
    gain, shape_gain
        Of predictions of specimens left out, with the best suspect: of their curves, by what is
        known of them without bending them; and of the curves' shapes, where their own factors are
        fitted to them. None where nothing was suspected.
    explained
        Share of the baseline's squared errors of shape that the best suspect takes away.
    confusable_with
        Suspects that are not told apart, or would hardly be with weaker data.
    effort
        What it took.
    """

    SUMMARY: ClassVar[str] = "verdict.json"

    dataset: Dataset
    observed: Observed
    effects: Mapping[str, Effect]
    verdict: str
    causes: tuple[str, ...]
    p_value: float
    baseline_misfit_p_value: float
    misfit_p_value: float
    scores: Mapping[str, Score]
    baseline: Fitted
    extended: Fitted | None
    gain: Gain | None
    shape_gain: Gain | None
    explained: float | None
    confusable_with: tuple[str, ...]
    effort: Effort

    @property
    def fitted(self) -> Fitted:
        """The last fit: with the best suspect if there is one, else the baseline."""
        return self.baseline if self.extended is None else self.extended

    @property
    def factor_moves(self) -> dict[str, float]:
        """Logarithms of the fitted factors over their prior standard deviation, by name."""
        moves = self.fitted.log_factors / self.dataset.layout.fit_sd
        names = (factor.name for factor in self.fitted.curves.model.factors)
        return dict(zip(names, map(float, moves), strict=True))

    def interval(self, name: str) -> tuple[float, float]:
        """Return the 95 % interval of a suspect's amplitude, within its bounds."""
        score = self.scores[name]
        low, high = self.effects[name].bounds
        # the specimen is the unit
        half = float(student.ppf(0.975, len(self.dataset.specimens) - 1)) * score.error
        return max(score.amplitude - half, low), min(score.amplitude + half, high)

    def baseline_test(self) -> BendingTest:
        """Return the baseline with its fitted factors."""
        return self._test(self.baseline)

    def extended_test(self) -> BendingTest:
        """Return the baseline with factors and effect as fitted together.

        Raises
        ------
        ValueError
            If nothing was suspected.
        """
        if self.extended is None:
            raise ValueError("nothing was suspected: there is no extended model")
        return self._test(self.extended)

    def _test(self, fitted: Fitted) -> BendingTest:
        model = fitted.curves.model.at(fitted.log_factors, fitted.amplitude)
        return model.test(self.dataset.baseline)

    @property
    def title(self) -> str:
        """That of the data set, with the verdict."""
        return f"{self.dataset.title}: {self.verdict}"

    def findings(self) -> list[str]:
        """Return the verdict, and where the fitted factors went."""
        return findings(self)

    def notes(self) -> list[str]:
        """Return how specimens scatter, and what is put down to mesh and simulator."""
        scatter, (low, high) = self.fitted.fit.scatter, self.dataset.range_mm
        mesh, left = self._corrections()
        return [
            f"{len(self.dataset.specimens)} specimens, {low:g} to {high:g} mm, scatter by "
            f"{100 * scatter.tau:.0f} % in each factor; the noise is {100 * scatter.sigma:.2g} % "
            "of the peak force.",
            f"Forces on the mesh recipe {self.mesh} are corrected by up to "
            f"{100 * mesh:+.1f} % of the peak, as a finer mesh shows; of what the "
            f"fit leaves, up to {100 * left:+.1f} % is put down to mesh and "
            "simulator.",
            self.effort.told(),
        ]

    @property
    def mesh(self) -> str:
        """Recipe of the simulations."""
        return self.dataset.specimens[0].test.numerics.mesh.name

    def _corrections(self) -> tuple[float, float]:
        """Return what is corrected for the mesh, and put down to it and the simulator."""
        for_mesh = self.fitted.curves.mesh_correction / self.observed.peak_N[:, None]
        return _largest(for_mesh), _largest(self.fitted.remaining()[1])

    def overview(self) -> pd.DataFrame:
        """Return the suspects, the most probable first."""
        rows = []
        gains = {
            n: -math.inf if s.log_likelihood_ratio is None else s.log_likelihood_ratio
            for n, s in self.scores.items()
        }
        for name in sorted(gains, key=lambda key: -gains[key]):
            score, unit = self.scores[name], with_space(self.effects[name].unit)
            size = f"{score.amplitude:.3g} ± {score.error:.2g}{unit}"
            rows.append(
                {
                    "suspect": name,
                    "log-likelihood gained": ""
                    if score.log_likelihood_ratio is None
                    else f"{score.log_likelihood_ratio:.1f}",
                    "amplitude": "not tested" if score.log_likelihood_ratio is None else size,
                    "but": score.reason,
                }
            )
        return pd.DataFrame(rows)

    def numbers(self) -> dict[str, Any]:
        """Return the verdict, and what it rests on."""
        fitted, (mesh, left) = self.fitted, self._corrections()
        names = (factor.name for factor in fitted.curves.model.factors)
        return {
            "verdict": self.verdict,
            "causes": self.causes,
            "amplitudes": {
                name: {
                    "value": self.scores[name].amplitude,
                    "interval": self.interval(name),
                    "unit": self.effects[name].unit,
                }
                for name in self.causes
            },
            "explained": self.explained,
            "p_value": self.p_value,
            "baseline_misfit_p_value": self.baseline_misfit_p_value,
            "misfit_p_value": self.misfit_p_value,
            "gain": None if self.gain is None else self.gain.numbers(),
            "shape_gain": None if self.shape_gain is None else self.shape_gain.numbers(),
            "scores": {name: dataclasses.asdict(score) for name, score in self.scores.items()},
            "confusable_with": self.confusable_with,
            "log_factors": dict(zip(names, fitted.log_factors, strict=True)),
            "log_factors_over_sd": self.factor_moves,
            "scatter": dataclasses.asdict(fitted.fit.scatter),
            "specimens": [specimen.name for specimen in self.dataset.specimens],
            "range_mm": self.dataset.range_mm,
            "dataset": to_dict(self.dataset.layout),
            "specification": to_dict(self.dataset.baseline),
            **dataclasses.asdict(self.effort),
            "mesh": self.mesh,
            "mesh_correction": mesh,
            "put_down_to_simulator": left,
        }

    def tables(self) -> dict[str, Table]:
        """Return the suspects' physics, and the fitted factors."""
        physics = [(n, e.physics, e.reference) for n, e in self.effects.items()]
        sd, moves = self.dataset.layout.fit_sd, self.factor_moves
        factors = [(name, math.exp(sd * move), move) for name, move in moves.items()]
        return {
            "suspects": Table(
                pd.DataFrame(physics, columns=["suspect", "physics", "reference"]),
                "What was tried.",
            ),
            "factors": Table(
                pd.DataFrame(factors, columns=["factor", "value", "over_sd"]),
                "Fitted factors, mean of the specimens, and over what was known of them.",
            ),
        }

    def figures(self) -> dict[str, Picture]:
        """Return residuals, suspects, and predictions of specimens left out."""
        from ramiefenics.discovery import figures

        return {
            "residual": Picture(
                partial(figures.residual_figure, self),
                "What the fit of the factors leaves, before and after. Grey: specimens. "
                "Dashed: what is put down to mesh and simulator.",
            ),
            "suspects": Picture(
                partial(figures.suspects_figure, self),
                "How much more probable each suspect makes the data, its amplitude fitted.",
            ),
            "left_out": Picture(
                partial(figures.left_out_figure, self), "Each specimen predicted from all others."
            ),
        }

    def user_files(self) -> list[Path]:
        """Return the files of the suspects that are the user's own."""
        return sorted({effect.file for effect in self.effects.values() if effect.file is not None})

    def specifications(self) -> dict[str, BendingTest]:
        """Return the fitted baseline, and that with the cause if one is named."""
        named = {"extended": self.extended_test()} if self.verdict == "cause" else {}
        return {"baseline": self.baseline_test(), **named}


def _largest(shares: Array) -> float:
    """Return the mean over specimens, shape (n, m), where it is largest."""
    mean = shares.mean(axis=0)
    return float(mean[np.abs(mean).argmax()])

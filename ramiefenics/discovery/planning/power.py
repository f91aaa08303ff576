"""What tests yet to be made could show, judged by simulated curves."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ramiefenics.discovery.curves.blocks import Array, Blocks
from ramiefenics.discovery.curves.both_ways import predictor_of
from ramiefenics.discovery.curves.factors import factors
from ramiefenics.discovery.curves.linearised import Model
from ramiefenics.discovery.curves.mesh_changes import MeshChanges
from ramiefenics.discovery.curves.observed import Observed
from ramiefenics.discovery.curves.prediction import Predictor
from ramiefenics.discovery.search.fitting import linear_evidence
from ramiefenics.discovery.statistics.causes import log_evidence_gains
from ramiefenics.discovery.statistics.evidence import Evidence, Suspect
from ramiefenics.discovery.statistics.scatter import LENGTH, Scatter
from ramiefenics.discovery.statistics.verdict import ENOUGH, SIGNIFICANCE
from ramiefenics.discovery.statistics.whitened import Reduced
from ramiefenics.effects import Effect
from ramiefenics.measured.record import POINTS
from ramiefenics.measured.unloading import FROM_TURN
from ramiefenics.runs.curve import Mapper
from ramiefenics.specification import BendingTest
from ramiefenics.specification.checks import check_integer, check_number

POWER = 0.95
"""Share of data sets in which an effect must be found for its size to count as detectable."""

DRAWS = 20000
"""Number of random data sets behind each share."""

LOADING, UNLOADING = (0.0, 1.0), (0.2, FROM_TURN)
"""Ranges in which curves are compared, as shares of the travel."""

BISECTIONS = 30
"""Number of bisections for the smallest amplitude that is found."""


@dataclass(frozen=True)
class Design:
    """Number of stalks, and how well they are known and tested.

    Attributes
    ----------
    stalks
        Number of stalks.
    fit_sd
        How well the batch's moduli are known: standard deviation of their logarithms.
    own
        How much the moduli differ between stalks: standard deviation of their logarithms.
    noise
        Standard deviation of the curves' noise, relative to the peak force.
    drift
        Standard deviation of the curves' smooth errors, relative to the peak force.
    noise_length
        Correlation length of the noise, as a share of the range. The shorter it is, the harder it
        is to find effects that change a curve within a short part of it.
    """

    stalks: int = 8
    fit_sd: float = 0.3
    own: float = 0.05
    noise: float = 0.01
    drift: float = 0.004
    noise_length: float = LENGTH[0]

    def __post_init__(self) -> None:
        """Check the ranges."""
        check_integer(self, "stalks", at_least=2)
        for name in ("fit_sd", "own", "noise", "noise_length"):
            check_number(self, name, above=0.0)
        check_number(self, "drift", at_least=0.0)


def predicted_evidence(
    tests: Sequence[BendingTest],
    effects: Mapping[str, Effect],
    fit_sd: float,
    runs: Mapper,
    mesh_changes: MeshChanges | None = None,
) -> Evidence:
    """Return the evidence that tests of one stalk would give if the baseline were right.

    Effects that have no meaning for these tests are not among its suspects. Finer meshes, which
    take most of the time, are simulated for the first test at most, and taken to change the others
    by the same share of the force at the same share of the travel.

    Parameters
    ----------
    tests
        Specifications of the curves, the first of a loading; one of unloading has the whole path,
        and follows that of its loading.
    effects, fit_sd, runs
        Suspects, how well the moduli are known, and what runs the simulations.
    mesh_changes
        What finer meshes change of a similar test; by default these are simulated.

    Raises
    ------
    SpecificationError
        If a simulation does not reach the end of its travel.
    """
    ways = [UNLOADING if test.protocol.then else LOADING for test in tests]
    shares = [low + (high - low) * (np.arange(POINTS) + 1.0) / POINTS for low, high in ways]
    at = np.array([s * t.protocol.travel_mm for s, t in zip(shares, tests, strict=True)])
    blocks = Blocks.of(["stalk"] * len(tests), POINTS)
    nothing = Observed(at, np.zeros_like(at), np.ones(len(tests)), blocks)
    used = factors(tests[0])
    predictor = predictor_of(tests, nothing, runs)
    if mesh_changes is None:
        mesh_changes = Predictor(tests[:1], nothing.of(np.array([0])), runs).mesh_changes
    predictor.share_mesh_changes(mesh_changes)
    curves = predictor.linearise(Model(used, np.zeros((1, len(used)))), effects)
    observed = Observed(at, curves.force, curves.force.max(axis=1), blocks)
    return linear_evidence(curves, observed, effects, fit_sd)


def repeated(evidence: Evidence, which: Sequence[int], stalks: int) -> Evidence:
    """Return the evidence of several identical stalks, each under some of the tests."""

    def rows(values: Array) -> Array:
        return np.concatenate([values[list(which)]] * stalks)

    names = [str(stalk) for stalk in range(stalks) for _ in which]
    suspects = {n: Suspect(s.effect, rows(s.signature)) for n, s in evidence.suspects.items()}
    return dataclasses.replace(
        evidence,
        residual=rows(evidence.residual),
        by_common=rows(evidence.by_common),
        by_own=rows(evidence.by_own),
        nuisance=rows(evidence.nuisance),
        blocks=Blocks.of(names, evidence.blocks.points),
        suspects=suspects,
    )


@dataclass(frozen=True)
class Power:
    """What a number of stalks can show under certain tests.

    Attributes
    ----------
    smallest
        Smallest amplitude that is found in 95 % of data sets, by effect, with the sign of the
        typical one; infinite if not even the bound is found.
    cosines
        Cosines between signatures, in the inner product of the inverse covariance, in the order of
        `smallest`, shape (p, p).
    apart
        Log-evidence by which an effect of typical size is expected to surpass another one that
        imitates it, shape (p, p).
    """

    smallest: dict[str, float]
    cosines: Array
    apart: Array

    @property
    def weakest(self) -> float:
        """Log-evidence between the two effects that are hardest to tell apart."""
        both = np.minimum(self.apart, self.apart.T)
        return float(both[np.triu_indices(len(both), 1)].min(initial=np.inf))

    @property
    def told_apart(self) -> int:
        """Number of pairs of effects of typical size that are told apart by odds of 20."""
        both = np.minimum(self.apart, self.apart.T)
        return int((both[np.triu_indices(len(both), 1)] >= ENOUGH).sum())


def power(evidence: Evidence, design: Design) -> Power:
    """Return what the evidence can show of its suspects, given the scatter of stalks and curves."""
    number = evidence.by_own.shape[1]
    own = (design.own,) * number
    scatter = Scatter(own, design.noise, design.noise_length, design.drift)
    gram = evidence.whiten(scatter).reduce().gram
    typical = [s.effect.typical for s in evidence.suspects.values()] / evidence.scale
    size = np.sqrt(np.maximum(np.diag(gram), 1e-300))
    cosines = gram / size / size[:, None]
    apart = 0.5 * (typical * size)[:, None] ** 2 * (1.0 - cosines**2)
    found = _smallest(gram, evidence.bounds, np.sign(typical)) * evidence.scale
    return Power(dict(zip(evidence.names, map(float, found), strict=True)), cosines, apart)


def _smallest(gram: Array, bounds: Array, directions: Array) -> Array:
    """Return the smallest amplitudes found, relative to `Evidence.scale`, shape (p,)."""
    rng = np.random.default_rng(0)
    singles = [(index,) for index in range(len(gram))]
    values, vectors = np.linalg.eigh(gram)
    root = vectors * np.sqrt(np.maximum(values, 0.0))
    noise = root @ rng.standard_normal((len(gram), DRAWS))

    def gains(signal: Array) -> Array:
        drawn = Reduced(gram, signal[:, None] + noise, np.zeros(DRAWS))
        return np.asarray(log_evidence_gains(drawn, bounds, singles).max(axis=0))

    critical = np.quantile(gains(np.zeros(len(gram))), 1.0 - SIGNIFICANCE)
    found = np.full(len(gram), np.inf)
    for index, direction in enumerate(directions):
        low, high = 0.0, float(np.abs(bounds[index, 1 if direction > 0 else 0]))
        if (gains(direction * high * gram[:, index]) > critical).mean() < POWER:
            continue
        for _ in range(BISECTIONS):
            middle = (low + high) / 2.0
            seen = (gains(direction * middle * gram[:, index]) > critical).mean() >= POWER
            low, high = (low, middle) if seen else (middle, high)
        found[index] = direction * high
    return found

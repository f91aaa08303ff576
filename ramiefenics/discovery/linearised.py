"""Models of what was measured, and their curves near where they were simulated."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ramiefenics.discovery.blocks import Array, Integers
from ramiefenics.discovery.factors import Factor, apply_factors
from ramiefenics.effects import Effect
from ramiefenics.specification import BendingTest


@dataclass(frozen=True)
class Model:
    """A point around which curves are linearised.

    Attributes
    ----------
    factors
        What is fitted.
    log_factors
        Their values for every specimen, shape (n, k).
    effects
        By name, what has been added to the baseline, with its amplitude.
    """

    factors: tuple[Factor, ...]
    log_factors: Array
    effects: Mapping[str, tuple[Effect, float]] = dataclasses.field(default_factory=dict)

    def test(self, test: BendingTest, log_factors: Array) -> BendingTest:
        """Return a specification with factors and effects."""
        test = apply_factors(test, self.factors, [float(value) for value in log_factors])
        for effect, amplitude in self.effects.values():
            test = effect.apply(test, amplitude)
        return test

    def amplitude(self, name: str) -> float:
        """Return that of an effect; zero if it is not there."""
        return self.effects[name][1] if name in self.effects else 0.0

    def changed(self, effect: Effect, amplitude: float) -> Model:
        """Return the model with another amplitude of an effect."""
        effects = {**self.effects, effect.name: (effect, amplitude)}
        return dataclasses.replace(self, effects=effects)


@dataclass(frozen=True)
class Linearised:
    """Predictions of a model and how they change; forces in N, r curves, m displacements.

    Attributes
    ----------
    model
        Which.
    force
        Predicted for vanishing cells, shape (r, m).
    mesh_correction
        What that is more than on the mesh of the simulations, shape (r, m).
    by_factors
        Derivatives by the log factors, shape (r, k, m).
    by_mesh
        Smooth deviations from the expected correction, each with its standard deviation,
        shape (r, q, m).
    by_effects
        By name, the derivative by the amplitude, per unit of it, shape (r, m).
    refused
        By name, why there is none.
    """

    model: Model
    force: Array
    mesh_correction: Array
    by_factors: Array
    by_mesh: Array
    by_effects: Mapping[str, Array]
    refused: Mapping[str, str]

    def at(self, log_factors: Array, specimen: Integers) -> Linearised:
        """Return the curves near other log factors, without simulating any.

        Forces are linear in the factors, not in their logarithms: those of an elastic stalk are
        exactly in proportion to all of its moduli together.

        Parameters
        ----------
        log_factors
            Of every specimen, shape (n, k).
        specimen
            Of every curve, shape (r,).
        """
        growth = np.exp((log_factors - self.model.log_factors)[specimen])
        by_factors = self.by_factors * growth[..., None]
        return dataclasses.replace(
            self,
            model=dataclasses.replace(self.model, log_factors=log_factors),
            force=self.force + (by_factors - self.by_factors).sum(axis=1),
            by_factors=by_factors,
        )

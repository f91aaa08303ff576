"""Models of the measured specimens, and their curves linearised around simulations."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ramiefenics.discovery.curves.blocks import Array, Integers
from ramiefenics.discovery.curves.factors import Factor, apply_factors
from ramiefenics.effects import Effect
from ramiefenics.specification import BendingTest

LOADED = 0.01
"""Share of the largest force above which the ratio of a derivative to the force is meaningful; a
smaller force may be an offset of the load cell."""


@dataclass(frozen=True)
class Model:
    """A point around which curves are linearised.

    Attributes
    ----------
    factors
        The fitted factors.
    log_factors
        Logarithms of the factors of every specimen, shape (n, k).
    effects
        Effects added to the baseline, with their amplitudes, by name.
    step, share
        Change of the log factors that led here from the point before, shape (n, k), and which share
        of the wanted change it was for each specimen, shape (n,); no step if there was no
        such point.
    before
        Amplitudes of the effects at that point, and their changes wanted there, by name.
    """

    factors: tuple[Factor, ...]
    log_factors: Array
    effects: Mapping[str, tuple[Effect, float]] = dataclasses.field(default_factory=dict)
    step: Array | None = None
    share: Array | float = 1.0
    before: Mapping[str, tuple[float, float]] = dataclasses.field(default_factory=dict)

    def test(self, test: BendingTest, log_factors: Array) -> BendingTest:
        """Return a specification with factors, and with the effects of the model, applied."""
        test = apply_factors(test, self.factors, [float(value) for value in log_factors])
        for effect, amplitude in self.effects.values():
            test = effect.apply(test, amplitude)
        return test

    def amplitude(self, name: str) -> float:
        """Return the amplitude of an effect; zero if the model does not contain it."""
        return self.effects[name][1] if name in self.effects else 0.0

    @property
    def median(self) -> Array:
        """Medians of the log factors over the specimens, shape (k,)."""
        return np.asarray(np.median(self.log_factors, axis=0))

    @property
    def typical(self) -> Model:
        """The model with these medians as the log factors of every specimen."""
        everywhere = np.broadcast_to(self.median, self.log_factors.shape).copy()
        return dataclasses.replace(self, log_factors=everywhere)

    def changed(self, effect: Effect, amplitude: float) -> Model:
        """Return the model with an effect at the given amplitude."""
        effects = {**self.effects, effect.name: (effect, amplitude)}
        return dataclasses.replace(self, effects=effects)


@dataclass(frozen=True)
class Linearised:
    """Predicted forces of a model, and their derivatives; in N, r curves, m displacements.

    Derivatives with respect to what specimens share, namely common factors and amplitudes, are
    those of stalks with typical factors, in proportion to each stalk's own force. If they depended
    on a specimen's own factors in any other way, common factors and amplitudes that cancel for a
    typical stalk would not cancel for others, and could explain a part of the scatter.

    Attributes
    ----------
    model
        The model.
    force
        Forces predicted for vanishing cell size, shape (r, m).
    mesh_correction
        These forces minus those on the mesh of the simulations, shape (r, m).
    by_own
        Derivatives with respect to a specimen's own log factors, shape (r, k, m).
    by_common
        Derivatives with respect to the common log factors, shape (r, k, m).
    by_mesh
        Smooth deviations from the expected mesh correction, each as large as its standard
        deviation, shape (r, q, m).
    by_effects
        Derivatives with respect to the amplitudes, per unit, by name of the effect, shape (r, m)
        each.
    refused
        Reasons why effects have no derivative, by name.
    correction
        The part of the forces that is known from simulations of every curve near by, in addition to
        what few simulations predict, shape (r, m).
    """

    model: Model
    force: Array
    mesh_correction: Array
    by_own: Array
    by_common: Array
    by_mesh: Array
    by_effects: Mapping[str, Array]
    refused: Mapping[str, str]
    correction: Array | float = 0.0

    def at(self, log_factors: Array, specimen: Integers) -> Linearised:
        """Return the curves linearised near other log factors, without further simulations.

        Forces are taken for products of powers of the factors. The forces of an elastic stalk are
        exactly proportional to all of its moduli together, as such products are, and lie between
        those of layers side by side and those of flexibilities one after the other. What effects
        and common factors change stays in proportion to the stalk's own force.

        Parameters
        ----------
        log_factors
            Log factors of every specimen, shape (n, k).
        specimen
            Index of the specimen of every curve, shape (r,).
        """
        change = (log_factors - self.model.log_factors)[specimen]
        rise = np.einsum("rkm,rk->rm", self.by_own, change)
        loaded = self.force > LOADED * self.force.max(axis=1, keepdims=True)
        growth = np.exp(np.divide(rise, self.force, out=np.zeros_like(rise), where=loaded))
        force = np.where(loaded, self.force * growth, self.force + rise)
        size = force.sum(axis=1, keepdims=True) / self.force.sum(axis=1, keepdims=True)
        return dataclasses.replace(
            self,
            model=dataclasses.replace(self.model, log_factors=log_factors),
            force=force,
            by_own=self.by_own * growth[:, None],
            by_common=self.by_common * size[..., None],
            by_effects={name: size * by for name, by in self.by_effects.items()},
        )

"""Stiffness changes with the position on the plant."""

from dataclasses import replace

from ramiefenics.effects.base import Effect
from ramiefenics.specification import BendingTest


def _apply(test: BendingTest, amplitude: float, reference_mm: float = 0.0) -> BendingTest:
    if amplitude == 0.0:
        return test
    stalk = test.stalk
    # effect on the moduli, at this position, of the gradient that the stalk may already have
    factor = replace(stalk, position_mm=reference_mm).position_factor
    stalk = replace(
        stalk,
        layers=tuple(replace(x, material=x.material.scaled(factor)) for x in stalk.layers),
        stiffness_gradient_per_m=stalk.stiffness_gradient_per_m / factor + amplitude,
        reference_position_mm=reference_mm,
    )
    return replace(test, stalk=stalk)


STIFFNESS_GRADIENT = Effect(
    name="stiffness_gradient",
    physics="The moduli of all layers change in proportion to the specimen's position on the plant "
    "(stalk.position_mm), relative to the specimens' mean position.",
    reference="Speck and Rowe 1999, in The Evolution of Plant Architecture, 447-479",
    unit="1/m",
    bounds=(-1.0, 1.0),
    typical=0.25,
    apply=_apply,
    enters="the moduli of every layer: stalk.stiffness_gradient_per_m",
    covariates={"reference_mm": "stalk.position_mm"},
)

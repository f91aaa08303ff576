"""Tissue changes with its place on the plant."""

from dataclasses import replace

from ramiefenics.effects.base import Effect
from ramiefenics.specification import BendingTest


def _apply(test: BendingTest, amplitude: float) -> BendingTest:
    total = test.stalk.stiffness_gradient_per_m + amplitude
    return replace(test, stalk=replace(test.stalk, stiffness_gradient_per_m=total))


STIFFNESS_GRADIENT = Effect(
    name="stiffness_gradient",
    physics="The moduli of all layers change in proportion to where the specimen was on the plant "
    "(stalk.position_mm).",
    reference="Speck and Rowe 1999, in The Evolution of Plant Architecture, 447-479",
    unit="1/m",
    bounds=(-1.0, 1.0),
    typical=0.25,
    apply=_apply,
)

"""Fibres give way in compression at another stress."""

from dataclasses import replace

from ramiefenics.effects.base import Effect
from ramiefenics.effects.materials import with_large_strain
from ramiefenics.specification import BendingTest


def _apply(test: BendingTest, amplitude: float) -> BendingTest:
    return with_large_strain(
        test, lambda x: replace(x, fibre_strength=(1.0 + amplitude) * x.fibre_strength)
    )


FIBRE_STRENGTH = Effect(
    name="fibre_strength",
    physics="Pressed fibres kink at another stress than was assumed, as they are more or less "
    "straight; the amplitude is what its factor differs by from one. Above "
    "large_strain.shear_residual_tangent it is refused: the matrix would not hold them.",
    reference="Budiansky and Fleck 1993, Journal of the Mechanics and Physics of Solids 41, "
    "183-211",
    unit="1",
    bounds=(-0.8, 1.0),
    typical=-0.3,
    apply=_apply,
    enters="the compressive stress of the fibres of every layer: large_strain.fibre_strength",
)

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
    physics="Compressed fibres kink at a different stress from the one assumed, depending on how "
    "straight they are; the amplitude is the relative change of that stress. A strength above "
    "large_strain.shear_residual_tangent is refused: the matrix would not hold the fibres.",
    reference="Budiansky and Fleck 1993, Journal of the Mechanics and Physics of Solids 41, "
    "183-211",
    unit="1",
    bounds=(-0.8, 1.0),
    typical=-0.3,
    apply=_apply,
    enters="the compressive stress of the fibres of every layer: large_strain.fibre_strength",
)

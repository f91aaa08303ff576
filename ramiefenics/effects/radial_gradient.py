"""Tissue is stiffer towards the outside of each layer."""

from dataclasses import replace

from ramiefenics.effects.base import Effect
from ramiefenics.specification import BendingTest


def _apply(test: BendingTest, amplitude: float) -> BendingTest:
    tissue = test.stalk.tissue
    tissue = replace(tissue, radial_gradient=tissue.radial_gradient + amplitude)
    return replace(test, stalk=replace(test.stalk, tissue=tissue))


RADIAL_GRADIENT = Effect(
    name="radial_gradient",
    physics="Within each layer all moduli increase from the inside out, or, with a negative "
    "amplitude, decrease, while their mean over the layer's area stays the same; the amplitude is "
    "the difference over the mean.",
    reference="Rueggeberg, Speck, Paris, Lapierre, Pollet, Koch and Burgert 2008, Proceedings of "
    "the Royal Society B 275, 2221-2229",
    unit="1",
    bounds=(-1.0, 1.0),
    typical=0.4,
    apply=_apply,
    enters="the moduli at every quadrature point: stalk.tissue.radial_gradient",
)

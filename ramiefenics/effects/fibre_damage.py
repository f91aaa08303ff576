"""Fibres break."""

from dataclasses import replace

from ramiefenics.effects.base import Effect
from ramiefenics.specification import BendingTest


def _apply(test: BendingTest, amplitude: float) -> BendingTest:
    layers = []
    for layer in test.stalk.layers:
        large_strain = layer.material.large_strain
        damaged = replace(large_strain, fibre_damage=large_strain.fibre_damage + amplitude)
        layers.append(replace(layer, material=replace(layer.material, large_strain=damaged)))
    return replace(test, stalk=replace(test.stalk, layers=tuple(layers)))


FIBRE_DAMAGE = Effect(
    name="fibre_damage",
    physics="Strained fibres fail one by one, and the rest bear less: the stored axial energy has "
    "a limit; the amplitude is the share of their stress lost at a tensile strain of 0.05.",
    reference="Volokh 2007, Journal of the Mechanics and Physics of Solids 55, 2237-2264",
    unit="1",
    bounds=(0.0, 0.95),
    typical=0.5,
    apply=_apply,
    enters="the stored axial energy of every layer: large_strain.fibre_damage",
)

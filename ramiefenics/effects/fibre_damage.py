"""Fibres break one by one."""

from dataclasses import replace

from ramiefenics.effects.base import Effect
from ramiefenics.effects.materials import with_large_strain
from ramiefenics.specification import BendingTest


def damaged(test: BendingTest, amplitude: float) -> BendingTest:
    """Return the test with the damage of the fibres increased by an amplitude."""
    return with_large_strain(test, lambda x: replace(x, fibre_damage=x.fibre_damage + amplitude))


FIBRE_DAMAGE = Effect(
    name="fibre_damage",
    physics="Strained fibres fail one by one, and the rest bear less: the stored axial energy has "
    "a limit; the amplitude is the share of their stress lost at a tensile strain of 0.05.",
    reference="Volokh 2007, Journal of the Mechanics and Physics of Solids 55, 2237-2264",
    unit="1",
    bounds=(0.0, 0.95),
    typical=0.5,
    apply=damaged,
    enters="the stored axial energy of every layer: large_strain.fibre_damage",
)

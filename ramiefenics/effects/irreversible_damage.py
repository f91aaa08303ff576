"""Broken fibres stay broken."""

from dataclasses import replace

from ramiefenics.effects.base import Effect
from ramiefenics.effects.fibre_damage import damaged
from ramiefenics.effects.materials import law_with
from ramiefenics.specification import BendingTest


def _apply(test: BendingTest, amplitude: float) -> BendingTest:
    if amplitude == 0.0:
        return test
    return replace(damaged(test, amplitude), law=law_with(test, "inelastic"))


IRREVERSIBLE_DAMAGE = Effect(
    name="irreversible_damage",
    physics="Fibres fail one by one when strained, as with fibre_damage, and never recover: "
    "unloading and reloading follow the secant; the amplitude is the share of their stress lost "
    "at a tensile strain of 0.05. A single loading cannot tell the two effects apart.",
    reference="Simo and Ju 1987, International Journal of Solids and Structures 23, 821-840",
    unit="1",
    bounds=(0.0, 0.95),
    typical=0.4,
    apply=_apply,
    enters="the law inelastic and large_strain.fibre_damage of every layer",
)

"""Tissue is crushed permanently."""

from ramiefenics.effects.base import Companion, Effect
from ramiefenics.effects.materials import with_part
from ramiefenics.specification import BendingTest


def _apply(test: BendingTest, amplitude: float, crushing_strain: float = 0.05) -> BendingTest:
    if amplitude == 0.0:
        return test
    return with_part(test, "inelastic", "crushed_share", amplitude, crushing_strain=crushing_strain)


CRUSHING = Effect(
    name="crushing",
    physics="Cells under the cylinders, and where the void flattens, collapse permanently across "
    "the fibres, until all are closed: the amplitude is the permanent share of the section's "
    "strain beyond crushing_strain.",
    reference="Gibson and Ashby 1997, Cellular Solids, section 5.3",
    unit="1",
    bounds=(0.0, 1.0),
    typical=0.4,
    apply=_apply,
    enters="the law inelastic: crushed_share, crushing_strain of every layer",
    companions=(Companion("crushing_strain", "1", 0.05, log_sd=0.5),),
)

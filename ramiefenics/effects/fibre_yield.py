"""Fibres yield."""

from ramiefenics.effects.base import Companion, Effect
from ramiefenics.effects.materials import with_part
from ramiefenics.specification import BendingTest


def _apply(test: BendingTest, amplitude: float, yield_strain: float = 0.01) -> BendingTest:
    if amplitude == 0.0:
        return test
    return with_part(test, "inelastic", "yielding_share", amplitude, yield_strain=yield_strain)


FIBRE_YIELD = Effect(
    name="fibre_yield",
    physics="Fibres strained beyond yield_strain in tension or compression deform permanently: the "
    "amplitude is the plastic share of the strain beyond yield; the rest hardens them.",
    reference="Keckes and others 2003, Nature Materials 2, 810-813",
    unit="1",
    bounds=(0.0, 0.95),
    typical=0.4,
    apply=_apply,
    enters="the law inelastic: yielding_share, yield_strain of every layer",
    companions=(Companion("yield_strain", "1", 0.01, log_sd=0.5),),
)

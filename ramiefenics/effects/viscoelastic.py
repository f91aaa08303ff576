"""Stress in the tissue relaxes."""

from ramiefenics.effects.base import Companion, Effect
from ramiefenics.effects.materials import with_part
from ramiefenics.specification import BendingTest


def _apply(test: BendingTest, amplitude: float, relaxation_time_s: float = 10.0) -> BendingTest:
    if amplitude == 0.0:
        return test
    return with_part(
        test,
        "viscoelasticity",
        "relaxing_share_1",
        amplitude,
        relaxation_time_1_s=relaxation_time_s,
    )


VISCOELASTIC = Effect(
    name="viscoelastic",
    physics="The force relaxes in a hold and is lower in slow loading: a share of the stress under "
    "fast loading decays with the time constant relaxation_time_s; the amplitude is that share.",
    reference="Simo 1987, Computer Methods in Applied Mechanics and Engineering 60, 153-173",
    unit="1",
    bounds=(0.0, 0.9),
    typical=0.2,
    apply=_apply,
    enters="the law viscoelasticity: relaxing_share_1, relaxation_time_1_s of every layer",
    companions=(Companion("relaxation_time_s", "s", 10.0, log_sd=1.5),),
)

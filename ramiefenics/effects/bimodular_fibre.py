"""Fibres are softer in compression than in tension."""

from dataclasses import replace

from ramiefenics.effects.base import Effect
from ramiefenics.effects.materials import with_large_strain
from ramiefenics.specification import BendingTest


def _apply(test: BendingTest, amplitude: float) -> BendingTest:
    if amplitude == 0.0:
        return test
    return with_large_strain(
        test,
        # a share of what is left, so that two such effects never take away more than all
        lambda x: replace(x, bimodularity=1.0 - (1.0 - amplitude) * (1.0 - x.bimodularity)),
    )


BIMODULAR_FIBRE = Effect(
    name="bimodular_fibre",
    physics="Fibres are softer in compression than in tension, and the neutral axis moves towards "
    "the tension side; the amplitude is the share of the axial stiffness that is missing in "
    "compression.",
    reference="Ambartsumyan 1986, Elasticity Theory of Different Moduli",
    unit="1",
    bounds=(0.0, 0.8),
    typical=0.3,
    apply=_apply,
    enters="the axial tangent of every layer in compression: large_strain.bimodularity",
)

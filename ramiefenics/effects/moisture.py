"""Wet tissue is softer."""

from dataclasses import replace

from ramiefenics.effects.base import Effect
from ramiefenics.specification import BendingTest


def _apply(test: BendingTest, amplitude: float, reference: float = 0.0) -> BendingTest:
    if amplitude == 0.0:
        return test
    stalk = test.stalk
    # effect on the moduli, at this moisture, of the softening that the stalk may already have
    factor = replace(stalk, moisture=reference).moisture_factor
    stalk = replace(
        stalk,
        layers=tuple(replace(x, material=x.material.scaled(factor)) for x in stalk.layers),
        moisture_softening=stalk.moisture_softening + amplitude,
        reference_moisture=reference,
    )
    return replace(test, stalk=stalk)


MOISTURE = Effect(
    name="moisture",
    physics="All moduli of all layers fall exponentially with the specimen's mass of water over "
    "its dry mass (stalk.moisture), relative to the specimens' mean; the amplitude is the "
    "relative loss per unit of that ratio.",
    reference="Kretschmann 2010, in Wood Handbook, FPL-GTR-190, chapter 5",
    unit="1",
    bounds=(-5.0, 5.0),
    typical=1.5,
    apply=_apply,
    enters="the moduli of every layer: stalk.moisture_softening",
    covariates={"reference": "stalk.moisture"},
)

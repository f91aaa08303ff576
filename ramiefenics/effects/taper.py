"""The stalk tapers along its length."""

from dataclasses import replace

from ramiefenics.effects.base import Effect
from ramiefenics.specification import BendingTest


def _apply(test: BendingTest, amplitude: float) -> BendingTest:
    if amplitude == 0.0:
        return test
    test = replace(test, numerics=test.numerics.whole_length())
    return replace(test, stalk=replace(test.stalk, taper=test.stalk.taper + amplitude))


TAPER = Effect(
    name="taper",
    physics="The stalk's diameters fall linearly along it; where they were not measured at midspan "
    "(stalk.measured_at_mm), the loaded section differs from the measured one.",
    reference="Robertson, Julias, Lee and Cook 2017, Crop Science 57, 926-934",
    unit="mm/mm",
    bounds=(-0.02, 0.02),
    typical=0.005,
    apply=_apply,
    enters="the nodes of the mesh: stalk.taper",
)

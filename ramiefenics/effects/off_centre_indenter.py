"""The indenter is not in the middle."""

from dataclasses import replace

from ramiefenics.effects.base import Effect
from ramiefenics.specification import BendingTest


def _apply(test: BendingTest, amplitude: float) -> BendingTest:
    if amplitude == 0.0:
        return test
    offset = test.fixture.indenter_offset_mm + amplitude
    fixture = replace(test.fixture, indenter_offset_mm=offset)
    return replace(test, fixture=fixture, numerics=test.numerics.whole_length())


OFF_CENTRE_INDENTER = Effect(
    name="off_centre_indenter",
    physics="The indenter comes down beside the middle between the supports, where the stalk is "
    "stiffer.",
    reference="Timoshenko 1955, Strength of Materials, Part I, chapter V",
    unit="mm",
    bounds=(-20.0, 20.0),
    typical=5.0,
    apply=_apply,
    enters="the place of the indenter: fixture.indenter_offset_mm",
)
